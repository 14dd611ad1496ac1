"""Signatures that `help` shows in lines of a terminal: a parameter each, with the short names of types.

Public names get them when they are first used, see `__getattr__` of the package.
"""

import inspect
import re
from types import FunctionType
from typing import Any

from numpy.typing import ArrayLike

from .validated import bare

# The columns of a terminal; the modules of a type, before its name.
_COLUMNS, _MODULES = 80, re.compile(r"\b(?:\w+\.)+(?=[A-Za-z])")
# What NumPy's name of all that becomes an array stands for: a line of 300 characters.
_ARRAY = inspect.formatannotation(ArrayLike)


class Lined(inspect.Signature):
    """A signature: its text has a line for each parameter where one line would be too long."""

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
        if len(line) <= (max_width or _COLUMNS):
            return line
        return "".join(["(\n", *(f"    {part},\n" for part in parts), ")", returned])


def _short(text: str) -> str:
    """The text of an annotation without modules, and with the names that stand for long ones."""
    text = re.sub(r"\btyping\.", "", text)
    inner = _ARRAY.removeprefix("typing.").removeprefix("Union[").removesuffix("]")
    for end, name in ((", NoneType]", "ArrayLike | None"), ("]", "ArrayLike")):
        text = text.replace(f"Union[{inner}{end}", name)
    return _MODULES.sub("", text.replace(f"{_ARRAY} | None", "ArrayLike | None").replace(_ARRAY, "ArrayLike"))


def show_in_lines(value: Any) -> None:
    """Show the signature of a function in lines where it is long, of a class those of its methods too.

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
    for kind in value.__mro__ if isinstance(value, type) else ():
        if kind.__module__.partition(".")[0] == value.__module__.partition(".")[0]:
            for one in vars(kind).values():
                function = getattr(one, "__func__", one)
                if isinstance(function, FunctionType):
                    _line(function)


def _line(function: FunctionType) -> None:
    """Give a function a `Lined` signature, if its own is long; checks of arguments are not part of it."""
    if "__signature__" not in vars(function):
        for name, kind in function.__annotations__.items() if function.__name__ == "__init__" else ():
            if not isinstance(kind, (type, str)):
                function.__annotations__[name] = bare(kind)
        signature = Lined.from_callable(function)
        if len(inspect.Signature.__str__(signature)) > _COLUMNS:
            function.__signature__ = signature  # type: ignore[attr-defined]
