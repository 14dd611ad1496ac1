"""The text of `help`: signatures and docstrings in lines of a terminal; and errors that name the possible arguments.

Public names get it when they are first used, see `__getattr__` of the package.
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

# The columns of a terminal; the modules before the name of a type.
_COLUMNS, _MODULES = 80, re.compile(r"\b(?:\w+\.)+(?=[A-Za-z])")
# The indents that `help` adds to the lines of a docstring, and to those of a method's.
_INDENTED, _OF_METHOD = 4, 8
# Headings of sections with entries, the lines of entries, and paragraphs that begin with a word and a colon.
_SECTION = re.compile(r"(Args|Attributes|Returns|Raises|Yields)\b[^:]*:$")
_ENTRY = re.compile(r" {4}(?! )[*\w.\"-]+(, [*\w.\"-]+)*: ")
_NOTE = re.compile(r"(Conserves|Order|Cost|Source|Reference): ")
# The meaning of NumPy's name for array-like arguments: a line of 300 characters.
_ARRAY = inspect.formatannotation(ArrayLike)
# A Python error about the arguments of a call: the function, and the suggestion of Python 3.13.
_CALLED, _PROPOSED = re.compile(r"^[\w.<>]+\(\)"), re.compile(r"\. Did you mean '\w+'\?$")
_Kind = TypeVar("_Kind")
_OF_NUMPY = re.compile(r"ndarray\[tuple\[Any, \.\.\.\], dtype\[(\w+)\]\]")


class Lined(inspect.Signature):
    """A signature; its text has a line for each parameter if one line would be too long."""

    # The width without the name of the function and the indent that `help` adds.
    columns = _COLUMNS

    def __str__(self) -> str:
        return self.format()

    def format(self, *, max_width: int | None = None, **_more: Any) -> str:
        """Return the text, in lines of the width of a terminal, or of `max_width`, which Python 3.13 sets."""
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
    """Return the text of an annotation without modules, and with short names for long ones."""
    text = re.sub(r"\btyping\.", "", text)
    inner = _ARRAY.removeprefix("typing.").removeprefix("Union[").removesuffix("]")
    for end, name in ((", NoneType]", "ArrayLike | None"), ("]", "ArrayLike")):
        text = text.replace(f"Union[{inner}{end}", name)
    return _OF_NUMPY.sub(
        r"NDArray[\1]",
        _MODULES.sub("", text.replace(f"{_ARRAY} | None", "ArrayLike | None").replace(_ARRAY, "ArrayLike")),
    )


def in_columns(text: str, width: int = _COLUMNS - _INDENTED) -> str:
    """Return a docstring with its paragraphs and entries in lines of `width` characters; examples and tables stay.

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
    """Return paragraphs and entries of a docstring with their indents; None for parts that stay as they are."""
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
    """Show the signature and the docstring of a function in lines, for a class also those of its methods.

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
    """Add to the arguments of a class where `help` shows those of its base."""
    first, raises, rest = inspect.cleandoc(cls.__doc__ or "").partition("\n\nRaises:")
    if raises and "Other arguments:" not in first:
        of = f"those of every {base.__name__.lower()}, see\nhelp({base.__module__}.{base.__name__})."
        cls.__doc__ = f"{first}\n\nOther arguments: {of}{raises}{rest}"


def _line_text(value: Any, indent: int) -> None:
    """Give a docstring lines of the width of a terminal, without the indent that `help` adds."""
    text = value.__doc__
    if isinstance(text, str) and max(map(len, text.splitlines()), default=0) > _COLUMNS - indent:
        value.__doc__ = in_columns(inspect.cleandoc(text), _COLUMNS - indent)


def _line(function: FunctionType, indent: int = 0) -> None:
    """Give a function a `Lined` signature if its own is long, without checks of arguments."""
    if "__signature__" not in vars(function):
        for name, kind in function.__annotations__.items() if function.__name__ == "__init__" else ():
            if not isinstance(kind, (type, str)):
                function.__annotations__[name] = bare(kind)
        signature, columns = Lined.from_callable(function), _COLUMNS - len(function.__name__) - indent
        if len(inspect.Signature.__str__(signature)) > columns:
            signature.columns = columns
            function.__signature__ = signature  # type: ignore[attr-defined]


def explain_calls(value: Any) -> Any:
    """Return a function or class that raises an error with the possible arguments when called with wrong ones.

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
    """Return a class with public methods that name their arguments when they are called with others."""
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
    """Return a Python error about the arguments of a call with the possible arguments, and the most similar."""
    parameters = inspect.signature(public).parameters.values()
    given = [one.name for one in parameters if one.kind != one.VAR_KEYWORD and not one.name.startswith("_")]
    known = [name for name in given if name != "self"]
    message = _PROPOSED.sub("", _CALLED.sub(f"{public.__qualname__}()", message))
    wrong = re.search(r"unexpected keyword argument '(\w+)'", message)
    return f"{message}{(closest(wrong[1], known) if wrong else '') or '.'} Its arguments: {', '.join(known)}"
