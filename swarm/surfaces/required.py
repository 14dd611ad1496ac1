"""What a surface must give for what is done with it: asked before anything is compiled, and said in one sentence.

Which functions a definition in contract.py, march.py or newton.py is made of is read from its code. One that has no
definition there, such as `hessian`, must be given where it is asked for, or something that is made of it is.
"""

import types
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ..errors import SceneError
from . import contract, march, newton
from .fields.members import Members
from .fold import Chain
from .rotation import Rotated
from .shapes.solid import SolidNumbers
from .surface import Surface

# Their definitions hold for the inner function q = phi only: a surface with another q registers these too.
_OF_PHI = (contract.gap_of, contract.gap_slope, contract.slope)
# What a solid of several parts asks of each.
_OF_PARTS = (
    contract.phi, contract.gradient, contract.distance, contract.gap_scale, contract.unit_normal, contract.first_hit,
)  # fmt: skip
_DESCRIPTION = ("size", "bounds", "extent")
# Definitions that follow from others are in these modules and in contract.py; their helpers are read too.
_LOOPS = (march, newton)
_OWN = tuple(module.__name__ for module in (contract, *_LOOPS))


def require(surfaces: Sequence[Surface], purpose: str, asked: Iterable[Any], name: str | None = None) -> None:
    """Raise a `SceneError` where a surface does not give what the functions `asked` of its walls are made of.

    `name` is that of the only surface, where it is none of a scene's.
    """
    asked = tuple(asked)
    for i, surface in enumerate(surfaces):
        for wall in surface.walls():
            for part, functions in _asked_of(wall, asked):
                lacking = sorted({name for function in functions for name in _lacking(part, function)})
                if lacking:
                    raise SceneError(
                        f"{name or f'surfaces[{i}]'} ({type(surface).__name__}) must give what {purpose} needs, got "
                        f"{type(part).__name__} without {' and '.join(lacking)}; register what is missing as the files "
                        "in swarm/surfaces/shapes do"
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
    require(surfaces, "a scene", (contract.phi, contract.gradient), name)


def _asked_of(wall: Any, asked: tuple[Any, ...]) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """Whose numbers the functions of a wall are asked of, and which: those of a turned body, and of a solid's parts."""
    if isinstance(wall, Rotated):
        yield from _asked_of(wall.body, asked)
        return
    if isinstance(wall, Members):
        yield from _asked_of(wall.like, asked)
        return
    yield wall, asked
    if isinstance(wall, SolidNumbers):
        falls = tuple(one for one in asked if one in (contract.falling_hit, contract.safe_time))
        parts = wall.parts
        while isinstance(parts, Chain):
            yield from _asked_of(parts.first, (*_OF_PARTS, *falls))
            parts = parts.rest


def _lacking(wall: Any, function: Any) -> Iterator[str]:
    """What must be registered before a function of a wall's numbers works."""
    definition = function.dispatch(type(wall))
    if function is contract.falling_hit and wall.is_quartic and not _gives(wall, contract.course):
        yield _named(contract.course)
    if definition.__module__ not in _OWN:
        return
    if function in _OF_PHI and _gives(wall, contract.inner):
        yield f"{_named(function)} for its `inner`"
        return
    for name in _names_in(definition):
        if name == "NotImplementedError":
            yield _named(function)
        elif name == "side" and not hasattr(wall, "side"):
            yield "the field `side`"
        elif hasattr(getattr(contract, name, None), "dispatch"):
            yield from _lacking(wall, getattr(contract, name))


def _names_in(definition: types.FunctionType) -> Iterator[str]:
    """The names that a definition uses, in the loops that it calls too."""
    for name in definition.__code__.co_names:
        yield name
        for module in _LOOPS:
            called = vars(module).get(name)
            if isinstance(called, types.FunctionType) and called.__module__ == module.__name__:
                yield from _names_in(called)


def _gives(wall: Any, function: Any) -> bool:
    return function.dispatch(type(wall)).__module__ not in _OWN


def _named(function: Any) -> str:
    if function in (contract.push, contract.rise, contract.resolve):
        return "contract.hessian"
    name = f"contract.{function.__name__}"
    follows = function in (contract.first_hit, contract.falling_hit)
    return f"{name} (or contract.bend, from which it follows by safe steps)" if follows else name
