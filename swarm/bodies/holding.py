"""Checks of anchors, guides, and the cavities that points of a body carry."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..common import checks
from ..errors import SceneError
from ..motion import Motion
from ..state import Floats
from ..surfaces.instant import distances, side_of
from ..surfaces.surface import Surface
from .checked import each, point

# The largest distance of a guided point from its surface at the start, relative to the size of the surface.
_ON_SURFACE = 1e-9


def anchors(value: Mapping[int, Any] | None, count: int) -> dict[int, Motion | None]:
    """Return `value` as the motions of points."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise SceneError(f"anchors must be a mapping of points to None or a motion, got {type(value).__name__}")
    for key, motion in value.items():
        point("a key of anchors", key, count)
        if motion is not None and not isinstance(motion, Motion):
            raise SceneError(
                f"anchors[{key}] must be None, for a point that is fixed, or a Translation, Oscillation or Rotation, "
                f"got {checks.shown(motion)}"
            )
    if len(value) == count:
        raise SceneError(f"anchors must leave a point that can move, got all {count} points of the body")
    return {int(key): motion for key, motion in value.items()}


def uncoupled(led: Mapping[int, Motion | None], matrix: Floats) -> None:
    """Raise a `SceneError` if a led point has a mass coupling with a point that can move, which it would push."""
    for number, motion in led.items():
        coupled = np.flatnonzero(matrix[number])
        if motion is not None and not set(coupled.tolist()) <= set(led):
            raise SceneError(
                f"anchors[{number}] must be None, fixed in space, or its point have no mass coupling with points that "
                f"can move, got {motion} and a mass_matrix with couplings of point {number} to points "
                f"{coupled.tolist()}"
            )


def guides(rows: Iterable[Any], places: Floats, anchored: Iterable[int]) -> tuple[tuple[int, Surface], ...]:
    """Return `rows` as guides (point, surface), each point on its surface."""
    held = set(anchored)
    result = []
    for row, given in each("guides", rows, 2, "(point, surface)"):
        number, surface = point(f"{row}[0]", given[0], len(places)), _smooth(f"{row}[1]", given[1])
        if surface.friction > 0.0:
            raise SceneError(f"{row}.friction must be 0, a guide has none, got {surface.friction:g}")
        if number in held:
            raise SceneError(f"{row} must hold a point that can move, got {number}, which is anchored")
        on_surface(f"{row}: point {number}", surface, places[number, :, None])
        result.append((number, surface))
    return tuple(result)


def on_surface(name: str, surface: Surface, places: Floats) -> None:
    """Raise a `SceneError` unless places (3, N) are on the surface."""
    values, off = surface.phi(places), np.abs(distances(surface, places))
    room = np.minimum(surface.size(), np.maximum(surface.extent(), np.abs(places).max(axis=0)))
    for i in np.flatnonzero(~(off <= _ON_SURFACE * room)):
        which = f" of copy {i}" if places.shape[1] > 1 else ""
        raise SceneError(
            f"{name}{which} must start on its surface, within {_ON_SURFACE:g} of its size, got "
            f"{places[:, i].tolist()}, where phi of {surface!r} is {values[i]:.3g}"
        )


def cavities(rows: Iterable[Any], places: Floats) -> tuple[tuple[Surface, int, int], ...]:
    """Return `rows` as cavities (surface, carrier, point), each point on the admissible side."""
    result = []
    for row, given in each("cavities", rows, 3, "(surface, carrier, point)"):
        surface = _smooth(f"{row}[0]", given[0])
        carrier, held = (point(f"{row}[{n}]", given[n], len(places)) for n in (1, 2))
        if carrier == held:
            raise SceneError(f"{row} must name a carrier and another point, got {carrier} for both")
        gap = side_of(surface) * surface.phi((places[held] - places[carrier])[:, None])[0]
        if not gap <= 0.0:
            raise SceneError(
                f"{row}: point {held} must start on the admissible side of its surface, got a gap of "
                f"{gap:.3g}; the surface's origin is point {carrier}"
            )
        result.append((surface, carrier, held))
    return tuple(result)


def _smooth(name: str, surface: Any) -> Surface:
    if not isinstance(surface, Surface):
        raise SceneError(f"{name} must be a surface such as swarm.Sphere, got {checks.shown(surface)}")
    if surface.is_field:
        raise SceneError(
            f"{name} must be one surface, got a field of {len(surface.numbers())}; give one of them by itself"
        )
    walls = len(surface.walls())
    if walls > 1:
        raise SceneError(
            f"{name} must be a surface without edges, got {surface!r} of {walls} walls; give one for each wall"
        )
    if surface.temperature is not None:
        raise SceneError(f"{name}.temperature must be None with bodies, got {surface.temperature:g}")
    if surface.laws:
        raise SceneError(f"{name}.laws must be left out with bodies, got {surface.laws}")
    if surface.motion is not None or surface.reacts() or surface.openings or surface.present is not None:
        raise SceneError(
            f"{name} must have no motion, mass, inertia or openings, and always be present, got {surface!r}; a "
            "cavity moves with its carrier, and anchors lead points"
        )
    return surface
