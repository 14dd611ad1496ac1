"""Checks before compilation that a surface has the methods, and the box in which it is known, for its use."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .contract import Smooth
from .fields.members import Members
from .instant import box_of
from .rotation import Rotated
from .shapes.solid import SolidNumbers
from .surface import Surface, named, shown

# The methods that the definitions of contract.py call. Methods without a definition, such as `hessian`, must be given.
_MADE_OF = {
    "inner": ("phi",),
    "inner_gradient": ("gradient",),
    "gap_of": ("side",),
    "level_of": ("gap_of",),
    "gap_slope": ("side",),
    "distance": ("inner", "gap_of", "gradient"),
    "gap_scale": ("gradient",),
    "unit_normal": ("gradient", "side"),
    "project": ("phi", "gradient"),
    **dict.fromkeys(("first_hit", "falling_hit"), ("inner", "level_of", "inner_gradient", "side")),
    "safe_time": (),
    "outward_acceleration": ("inner_gradient", "hessian", "side"),
    "discrete_gradient": ("inner_gradient", "inner"),
    "step_normal": ("discrete_gradient", "side"),
    **dict.fromkeys(("push", "rise", "turned_push", "resolve"), ("discrete_gradient", "hessian")),
    "chord_guess": ("chord_improve",),
    "chord_improve": ("rise",),
    "chord_normal": ("push", "side"),
}
# These definitions hold for the inner function q = phi only: a surface with another q overrides them too.
_OF_PHI = ("gap_of", "gap_slope", "inner_gradient")
# The methods that a solid of several parts calls on each.
_OF_PARTS = ("phi", "gradient", "distance", "gap_scale", "unit_normal", "first_hit")
_DESCRIPTION = ("size", "bounds", "extent")
# Particles may leave the box in which a surface is known by this part of its width: round-off.
_ROUND_OFF = 1e-9


def require(surfaces: Sequence[Surface], purpose: str, asked: Iterable[str], name: str | None = None) -> None:
    """Raise a `SceneError` if a surface lacks methods on which the methods `asked` of its walls depend.

    `name` is the name of a single surface that is not in the list of a scene.
    """
    asked = tuple(asked)
    for i, surface in enumerate(surfaces):
        for wall in surface.walls():
            for part, methods in _asked_of(wall, asked):
                lacking = sorted(dict.fromkeys(name for method in methods for name in _lacking(part, method)))
                if lacking:
                    raise SceneError(
                        f"{name or f'surfaces[{i}]'} ({type(surface).__name__}) must give what {purpose} needs, got "
                        f"{type(part).__name__} without {' and '.join(lacking)}; derive it from "
                        "contract.Smooth and give it what is missing as the files in swarm/surfaces/shapes do"
                    )


def require_description(surfaces: Sequence[Surface], name: str | None = None) -> None:
    """Raise a `SceneError` if the class of a surface lacks a method, or its walls phi and gradient."""
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
    """Yield records and the methods that each needs: the body of a turned wall, and the parts of a solid, too."""
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
    """Yield the methods that a method of a wall needs and that the wall lacks."""
    if not isinstance(wall, Smooth):
        yield "the base class swarm.surfaces.contract.Smooth"
    elif name == "side":
        yield from () if hasattr(wall, "side") else ("the field `side`",)
    elif name == "falling_hit" and wall.is_quartic:
        yield from () if wall.gives("course") else ("course()",)
    elif wall.gives(name) or (name == "turned_push" and wall.flat_normal() is not None):
        # The push of a flat wall that turns is that of one at rest.
        return
    elif name in _OF_PHI and wall.gives("inner"):
        yield f"{name}() for its `inner`"
    elif name in ("first_hit", "falling_hit") and not any(map(wall.gives, ("near", "steps", "hessian_bounds"))):
        yield f"{name}() (or hessian_bounds(), from which it follows by safe steps)"
    elif name not in _MADE_OF:
        yield f"{name}()"
    else:
        for used in _MADE_OF[name]:
            yield from _lacking(wall, used)


def require_known(
    surfaces: Sequence[Surface], bounds: Callable[[list[Surface]], tuple[NDArray[np.float64], NDArray[np.float64]]]
) -> None:
    """Raise a `SceneError` if particles may leave the box in which a surface is known.

    Args:
        surfaces: the surfaces of a scene.
        bounds: function that returns the corners of a box around the volume that given surfaces leave.
    """
    for i, surface in enumerate(surfaces):
        known = surface.known_in()
        if known is None:
            continue
        first, last = (np.array(corner) for corner in known)
        low, high = bounds([one for one in surfaces if one.motion is None and not one.reacts()])
        room = _ROUND_OFF * (last - first).max()
        if surface.motion is not None or not ((low >= first - room).all() and (high <= last + room).all()):
            raise SceneError(
                f"surfaces[{i}] must be known wherever particles go, got {surface}, which reaches the border of its "
                f"grid, from {shown(first)} to {shown(last)}, while the surfaces that do not move keep particles "
                f"from {shown(low)} to {shown(high)}; sample it in a larger box, check that phi is below 0 inside, "
                "or add surfaces that keep particles in the grid"
            )


def apart_of(surfaces: Sequence[Surface]) -> str | None:
    """Which two surfaces that hold their particles have no point in common, in words; None: no such two."""
    boxes = [(i, one, np.array(box_of(one, 0.0))) for i, one in enumerate(surfaces) if one.is_there(0.0)]
    for (i, one, box), (j, other, its) in itertools.combinations(boxes, 2):
        if (np.maximum(box[0], its[0]) > np.minimum(box[1], its[1])).any():
            return (
                f"{named(i, one)} and {named(j, other)} are apart: particles "
                "live in what all surfaces have in common; a vessel of several rooms is one surface, "
                'swarm.Union([...]), in a scene file kind = "union"'
            )
    return None
