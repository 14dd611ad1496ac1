"""What a surface must give for what is done with it: asked before anything is compiled, and said in one sentence.

A function of a wall that its file does not give has a definition in base.py or smooth.py, which is made of others. One
that has none there, such as `hessian`, must be given where it is asked for, or something that is made of it is.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from ..errors import SceneError
from . import base, smooth
from .chain import Chain
from .rotation import Rotated
from .shapes.solid import SolidNumbers

_MARCH = (smooth.bend, smooth.slope, base.inner, base.level_of)
# What the definitions in base.py and smooth.py are made of.
_MADE_OF = {
    **{generic.dispatch(object): made_of for generic, made_of in (
        (base.safe_time, ()),
        (base.inner, (base.phi,)),
        (base.gap_of, ()),
        (base.level_of, ()),
        (base.gap_slope, ()),
        (base.unit_normal, (base.gradient,)),
        (base.distance, (base.gradient, base.gap_of, base.inner)),
        (base.gap_scale, (base.gradient,)),
        (base.settle, (base.gradient, base.phi)),
        (base.inner_gradient, (smooth.slope, smooth.difference)),
        (base.push, (smooth.hessian, base.inner_gradient)),
        (base.resolve, (smooth.hessian, smooth.slope)),
        (base.rise, (smooth.hessian, smooth.slope, base.inner_gradient)),
        (base.chord_guess, (base.chord_improve,)),
        (base.chord_improve, (base.rise,)),
        (base.chord_normal, (base.push, base.inner_gradient)),
        (smooth.slope, (base.gradient,)),
        (smooth.difference, (base.inner,)),
    )},
    **dict.fromkeys(smooth.MARCHES, _MARCH),
}  # fmt: skip
# Their definitions hold for the inner function q = phi only: who gives another q gives these too.
_OF_PHI = (base.gap_of, base.level_of, base.gap_slope, smooth.slope)
# Their definitions take the sign from the field `side`.
_SIDED = (base.gap_of, base.level_of, base.gap_slope, base.unit_normal, base.chord_normal)
# What a solid of several parts asks of each.
_OF_PARTS = (base.phi, base.gradient, base.distance, base.gap_scale, base.unit_normal, base.first_hit)
_DESCRIPTION = ("size", "bounds", "extent")


def require(surfaces: Sequence[base.Surface], purpose: str, asked: Iterable[Any]) -> None:
    """Raise a `SceneError` where a surface does not give what the functions `asked` of its walls are made of."""
    asked = tuple(asked)
    for i, surface in enumerate(surfaces):
        for wall in surface.walls():
            for part, functions in _asked_of(wall, asked):
                lacking = sorted({name for function in functions for name in _lacking(part, function)})
                if lacking:
                    raise SceneError(
                        f"surfaces[{i}] ({type(surface).__name__}) must give what {purpose} needs, got "
                        f"{type(part).__name__} without {' and '.join(lacking)}; register what is missing as the files "
                        "in swarm/surfaces do"
                    )


def require_description(surfaces: Sequence[base.Surface]) -> None:
    """Raise a `SceneError` where the class of a surface lacks a method, or its walls phi and gradient."""
    for i, surface in enumerate(surfaces):
        kind = type(surface)
        lacking = [name for name in _DESCRIPTION if getattr(kind, name) is getattr(base.Surface, name)]
        if kind.numbers is base.Surface.numbers and kind.walls is base.Surface.walls:
            lacking.append("numbers")
        if lacking:
            names = " and ".join(f"{name}()" for name in lacking)
            raise SceneError(f"surfaces[{i}] must have every method of a surface, got {kind.__name__} without {names}")
    require(surfaces, "a scene", (base.phi, base.gradient))


def _asked_of(wall: Any, asked: tuple[Any, ...]) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """Whose numbers the functions of a wall are asked of, and which: those of a turned body, and of a solid's parts."""
    if isinstance(wall, Rotated):
        yield from _asked_of(wall.body, asked)
        return
    yield wall, asked
    if isinstance(wall, SolidNumbers):
        falls = tuple(one for one in asked if one in (base.falling_hit, base.safe_time))
        parts = wall.parts
        while isinstance(parts, Chain):
            yield from _asked_of(parts.first, (*_OF_PARTS, *falls))
            parts = parts.rest


def _lacking(wall: Any, function: Any) -> Iterator[str]:
    """What must be registered before a function of a wall's numbers works."""
    definition, default = function.dispatch(type(wall)), function.dispatch(object)
    if function is base.falling_hit and base.is_quartic(wall) and not _gives(wall, base.course):
        yield _named(base.course)
    if definition not in _MADE_OF:
        if definition is default:
            yield _named(function)
        return
    if function in _OF_PHI and _gives(wall, base.inner):
        yield f"{_named(function)} for its `inner`"
        return
    if function in _SIDED and not hasattr(wall, "side"):
        yield "the field `side`"
    for part in _MADE_OF[definition]:
        yield from _lacking(wall, part)


def _gives(wall: Any, function: Any) -> bool:
    return function.dispatch(type(wall)) is not function.dispatch(object)


def _named(function: Any) -> str:
    name = f"{function.__module__.removeprefix('swarm.surfaces.')}.{function.__name__}"
    follows = function in (base.first_hit, base.falling_hit)
    return f"{name} (or smooth.bend, which finds it by safe steps)" if follows else name
