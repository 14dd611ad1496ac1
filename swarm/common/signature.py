"""What `help` shows in lines of a terminal, signatures and docstrings; and errors that name the arguments there are.

Public names get them when they are first used, see `__getattr__` of the package.
"""

import functools
import inspect
import re
import sys
import textwrap
from types import FunctionType
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from .checks import closest
from .validated import bare

# The columns of a terminal; the modules of a type, before its name.
_COLUMNS, _MODULES = 80, re.compile(r"\b(?:\w+\.)+(?=[A-Za-z])")
# What `help` puts before the lines of a docstring, and before those of a method.
_INDENTED, _OF_METHOD = 4, 8
# Headings of sections that have entries, the lines of these, and paragraphs that begin with a word and a colon.
_SECTION = re.compile(r"(Args|Attributes|Returns|Raises|Yields)\b[^:]*:$")
_ENTRY = re.compile(r" {4}(?! )[*\w.\"-]+(, [*\w.\"-]+)*: ")
_NOTE = re.compile(r"(Conserves|Order|Cost|Source|Reference): ")
# What NumPy's name of all that becomes an array stands for: a line of 300 characters.
_ARRAY = inspect.formatannotation(ArrayLike)
# An error of Python about the arguments of a call: the function, and what Python 3.13 proposes.
_CALLED, _PROPOSED = re.compile(r"^[\w.<>]+\(\)"), re.compile(r"\. Did you mean '\w+'\?$")
_Kind = TypeVar("_Kind")
_OF_NUMPY = re.compile(r"ndarray\[tuple\[Any, \.\.\.\], dtype\[(\w+)\]\]")


class Lined(inspect.Signature):
    """A signature: its text has a line for each parameter where one line would be too long."""

    # Of a line, less the name of the function and what `help` puts before it.
    columns = _COLUMNS

    def __str__(self) -> str:
        return self.format()

    def format(self, *, max_width: int | None = None, **_more: Any) -> str:
        """The text; a line is as wide as a terminal, or as `max_width`, for which Python 3.13 asks."""
        returned = _short(str(inspect.Signature(return_annotation=self.return_annotation)))[2:]
        parts: list[str] = []
        named = False
        for parameter in self.parameters.values():
            if parameter.kind is parameter.KEYWORD_ONLY and not named:
                parts.append("*")
            named |= parameter.kind in (parameter.KEYWORD_ONLY, parameter.VAR_POSITIONAL)
            parts.append(_short(str(parameter)))
        line = f"({', '.join(parts)}){returned}"
        if len(line) <= (max_width or self.columns):
            return line
        return "".join(["(\n", *(f"    {part},\n" for part in parts), ")", returned])


def _short(text: str) -> str:
    """The text of an annotation without modules, and with the names that stand for long ones."""
    text = re.sub(r"\btyping\.", "", text)
    inner = _ARRAY.removeprefix("typing.").removeprefix("Union[").removesuffix("]")
    for end, name in ((", NoneType]", "ArrayLike | None"), ("]", "ArrayLike")):
        text = text.replace(f"Union[{inner}{end}", name)
    return _OF_NUMPY.sub(
        r"NDArray[\1]",
        _MODULES.sub("", text.replace(f"{_ARRAY} | None", "ArrayLike | None").replace(_ARRAY, "ArrayLike")),
    )


def in_columns(text: str, width: int = _COLUMNS - _INDENTED) -> str:
    """A docstring with its paragraphs and entries in lines of so many characters; examples and tables stay.

    >>> in_columns("Conserves: the energy, and the momentum of all.", 24).splitlines()
    ['Conserves: the energy,', 'and the momentum of all.']
    """
    done: list[str] = []
    for indent, lines in _blocks(text.splitlines()):
        if indent is None or max(map(len, lines)) <= width:
            done += lines
        else:
            later = " " * (indent + 4 if indent and _ENTRY.match(lines[0]) else indent)
            done += textwrap.wrap(
                " ".join(line.strip() for line in lines), width, initial_indent=" " * indent,
                subsequent_indent=later, break_long_words=False, break_on_hyphens=False,
            )  # fmt: skip
    return "\n".join(done)


def _blocks(lines: list[str]) -> list[tuple[int | None, list[str]]]:
    """Paragraphs and entries of a docstring, with the indent of each; None of what stays as it is."""
    found: list[tuple[int | None, list[str]]] = []
    in_section = stays = False
    for line in lines:
        indent = len(line) - len(line.lstrip())
        if not line.strip():
            stays = False
            found.append((None, [line]))
            continue
        if indent == 0:
            in_section = _SECTION.match(line) is not None
        begins = not found or not found[-1][1][0].strip()
        stays = stays or line.lstrip().startswith((">>>", "| ")) or (indent > 0 and not in_section and begins)
        if stays or _SECTION.match(line):
            found.append((None, [line]))
        elif found and found[-1][0] is not None and not _ENTRY.match(line) and not _NOTE.match(line):
            found[-1][1].append(line)
        else:
            found.append((4 if in_section else 0, [line]))
    return found


def show_in_lines(value: Any) -> None:
    """Show the signature and the docstring of a function in lines, of a class those of its methods too.

    >>> from collections.abc import Callable
    >>> def function(first: Callable[[int], str] | None = None, *, second: str = "none", third: float = 0.5): ...
    >>> show_in_lines(function)
    >>> print(inspect.signature(function))
    (
        first: Callable[[int], str] | None = None,
        *,
        second: str = 'none',
        third: float = 0.5,
    )
    """
    if isinstance(value, FunctionType):
        _line(value)
    _line_text(value, _INDENTED)
    for kind in value.__mro__ if isinstance(value, type) else ():
        if kind.__module__.partition(".")[0] == value.__module__.partition(".")[0]:
            if kind is not value and re.search(r"^ *Args:$", kind.__doc__ or "", re.MULTILINE):
                _name_others(value, kind)
            _line_text(kind, _INDENTED)
            for one in vars(kind).values():
                function = getattr(one, "__func__", one)
                if isinstance(function, FunctionType):
                    _line(function, _INDENTED)
                if isinstance(function, FunctionType | property | functools.cached_property):
                    _line_text(function, _OF_METHOD)


def _name_others(cls: type[Any], base: type[Any]) -> None:
    """Say behind the arguments of a class where `help` has those of its base."""
    first, raises, rest = inspect.cleandoc(cls.__doc__ or "").partition("\n\nRaises:")
    if raises and "Other arguments:" not in first:
        of = f"those of every {base.__name__.lower()}, see\nhelp({base.__module__}.{base.__name__})."
        cls.__doc__ = f"{first}\n\nOther arguments: {of}{raises}{rest}"


def _line_text(value: Any, indent: int) -> None:
    """Give a docstring lines that are as wide as a terminal, less the indent that `help` adds."""
    text = value.__doc__
    if isinstance(text, str) and max(map(len, text.splitlines()), default=0) > _COLUMNS - indent:
        value.__doc__ = in_columns(inspect.cleandoc(text), _COLUMNS - indent)


def _line(function: FunctionType, indent: int = 0) -> None:
    """Give a function a `Lined` signature, if its own is long; checks of arguments are not part of it."""
    if "__signature__" not in vars(function):
        for name, kind in function.__annotations__.items() if function.__name__ == "__init__" else ():
            if not isinstance(kind, (type, str)):
                function.__annotations__[name] = bare(kind)
        signature, columns = Lined.from_callable(function), _COLUMNS - len(function.__name__) - indent
        if len(inspect.Signature.__str__(signature)) > columns:
            signature.columns = columns
            function.__signature__ = signature  # type: ignore[attr-defined]


def explain_calls(value: Any) -> Any:
    """A function, or a class, of which a call with wrong arguments says which there are.

    >>> def function(radius: float, *, side: str = "inside"): ...
    >>> explain_calls(function)(1.0, sdie="outside")
    Traceback (most recent call last):
    TypeError: function() got an unexpected keyword argument 'sdie'; did you mean 'side'? Its arguments: radius, side
    """
    if isinstance(value, FunctionType):
        explained = _explained(value, value)
        # Pickles name a function by its module.
        setattr(sys.modules[value.__module__], value.__name__, explained)
        return explained
    if isinstance(value, type):
        maker = "__new__" if issubclass(value, tuple) else "__init__"
        function = getattr(value, maker)
        if isinstance(function, FunctionType):
            setattr(value, maker, _explained(function, value))
    return value


def explain_methods(kind: type[_Kind]) -> type[_Kind]:
    """A class; its public methods say which arguments they have when they are called with others."""
    for name, method in list(vars(kind).items()):
        if isinstance(method, FunctionType) and not name.startswith("_"):
            setattr(kind, name, _explained(method, method))
    return kind


def _explained(function: FunctionType, public: Any) -> Any:
    @functools.wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        try:
            return function(*args, **named)
        except TypeError as error:
            if error.__traceback__ is not None and error.__traceback__.tb_next is None:  # of the call itself
                raise TypeError(_with_arguments(str(error), public)) from None
            raise

    return call


def _with_arguments(message: str, public: Any) -> str:
    """An error of Python about the arguments of a call, with those that there are, and the nearest."""
    parameters = inspect.signature(public).parameters.values()
    given = [one.name for one in parameters if one.kind != one.VAR_KEYWORD and not one.name.startswith("_")]
    known = [name for name in given if name != "self"]
    message = _PROPOSED.sub("", _CALLED.sub(f"{public.__qualname__}()", message))
    wrong = re.search(r"unexpected keyword argument '(\w+)'", message)
    return f"{message}{(closest(wrong[1], known) if wrong else '') or '.'} Its arguments: {', '.join(known)}"
