"""The methods that a surface lacks for its use: an error in one sentence, before anything is compiled.

Which methods a definition in contract.py, march.py, approach.py or newton.py is made of is read from its code. One that
has no definition there, such as `hessian`, must be given where it is asked for, or something that is made of it is.
"""

import inspect
import sys
import types
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ..errors import SceneError
from . import approach, march, newton
from .contract import Smooth
from .fields.members import Members
from .rotation import Rotated
from .shapes.solid import SolidNumbers
from .surface import Surface

# Their definitions hold for the inner function q = phi only: a surface with another q gives these too.
_OF_PHI = ("gap_of", "gap_slope", "inner_gradient")
# What a solid of several parts asks of each.
_OF_PARTS = ("phi", "gradient", "distance", "gap_scale", "unit_normal", "first_hit")
_DESCRIPTION = ("size", "bounds", "extent")


def require(surfaces: Sequence[Surface], purpose: str, asked: Iterable[str], name: str | None = None) -> None:
    """Raise a `SceneError` where a surface does not give what the functions `asked` of its walls are made of.

    `name` is that of the only surface, where it is none of a scene's.
    """
    asked = tuple(asked)
    for i, surface in enumerate(surfaces):
        for wall in surface.walls():
            for part, methods in _asked_of(wall, asked):
                lacking = sorted({name for method in methods for name in _lacking(part, method)})
                if lacking:
                    raise SceneError(
                        f"{name or f'surfaces[{i}]'} ({type(surface).__name__}) must give what {purpose} needs, got "
                        f"{type(part).__name__} without {' and '.join(lacking)}; derive it from "
                        "contract.Smooth and give it what is missing as the files in swarm/surfaces/shapes do"
                    )


def require_description(surfaces: Sequence[Surface], name: str | None = None) -> None:
    """Raise a `SceneError` where the class of a surface lacks a method, or its walls phi and gradient."""
    for i, surface in enumerate(surfaces):
        kind = type(surface)
        lacking = [name for name in _DESCRIPTION if getattr(kind, name) is getattr(Surface, name)]
        if kind.numbers is Surface.numbers and kind.walls is Surface.walls:
            lacking.append("numbers")
        if lacking:
            names = " and ".join(f"{name}()" for name in lacking)
            where = name or f"surfaces[{i}]"
            raise SceneError(f"{where} must have every method of a surface, got {kind.__name__} without {names}")
    require(surfaces, "a scene", ("phi", "gradient"), name)


def _asked_of(wall: Any, asked: tuple[str, ...]) -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Whose numbers the methods of a wall are asked of, and which: those of a turned body, and of a solid's parts."""
    if isinstance(wall, Rotated):
        yield from _asked_of(wall.body, asked)
        return
    if isinstance(wall, Members):
        yield from _asked_of(wall.like, asked)
        return
    yield wall, asked
    if isinstance(wall, SolidNumbers):
        falls = tuple(one for one in asked if one in ("falling_hit", "safe_time"))
        for part in wall.parts:
            yield from _asked_of(part, (*_OF_PARTS, *falls))


def _lacking(wall: Any, name: str) -> Iterator[str]:
    """The methods without which a method of a wall does not work."""
    if not isinstance(wall, Smooth):
        yield "the base class swarm.surfaces.contract.Smooth"
        return
    if name == "falling_hit" and wall.is_quartic and not wall.gives("course"):
        yield _named("course")
    if wall.gives(name):
        return
    if name in _OF_PHI and wall.gives("inner"):
        yield f"{_named(name)} for its `inner`"
        return
    if name in ("first_hit", "falling_hit") and not (
        wall.gives("near") or wall.gives("hessian_bounds") or _falls(wall, name)
    ):
        yield f"{_named(name)} (or hessian_bounds(), from which it follows by safe steps)"
        return
    for used in _names_in(_definition(wall, name)):
        if used == "NotImplementedError":
            yield _named(name)
        elif used == "side" and not hasattr(wall, "side"):
            yield "the field `side`"
        elif isinstance(getattr(Smooth, used, None), types.FunctionType):
            yield from _lacking(wall, used)


def _falls(wall: Any, name: str) -> bool:
    """Whether what is asked about a fall follows from its quartic."""
    return name in ("falling_hit", "safe_time") and bool(wall.is_quartic)


def _definition(wall: Any, name: str) -> types.FunctionType:
    """The function that a method follows by which a surface does not give."""
    if name == "safe_time" or _falls(wall, name):
        return _nothing  # type: ignore[return-value]
    if name in ("first_hit", "falling_hit"):
        return inspect.unwrap(approach.first_hit if wall.gives("near") else march.march)  # type: ignore[no-any-return]
    return inspect.unwrap(getattr(newton if name in ("push", "rise", "resolve") else Smooth, name))  # type: ignore[no-any-return]


def _nothing(*_asked: Any) -> None:
    """Of a bound that may be 0, or of what is asked for already."""


def _names_in(definition: types.FunctionType) -> Iterator[str]:
    """The names that a definition uses, in the functions of its module that it calls too."""
    for name in definition.__code__.co_names:
        called = vars(sys.modules[definition.__module__]).get(name)
        if isinstance(called, types.FunctionType) and called.__module__ == definition.__module__:
            yield from _names_in(called)
        else:
            yield name


def _named(name: str) -> str:
    return "hessian()" if name in ("push", "rise", "resolve") else f"{name}()"
