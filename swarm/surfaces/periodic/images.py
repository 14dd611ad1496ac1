"""The images of a surface in a periodic cell: those that, shifted by the period, reach into the cell."""

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import checks
from ...errors import SceneError
from ...motion import Oscillation, Path, Rotation, Translation, parts_of, unit_axis
from ..facets.mesh import Mesh
from ..fields.many import Many, ManyBodies
from ..outlines.outlined import Outlined
from ..surface import Box, Surface

Lengths = tuple[float | None, float | None, float | None]
# A surface closer to a face than this part of the period counts as reaching over it: a step may end a little beyond.
_NEAR = 1e-3
# The number of points at which the slope of a surface along an axis is evaluated, and the fraction of a slope that
# counts as 0.
_POINTS, _NO_SLOPE = 256, 1e-14
# The part of the period by which a cavity may be outside the cell: round-off.
_ROUND_OFF = 1e-12
# For a surface with a mass in a periodic cell.
MASS_AND_PERIOD = (
    "mass and inertia must be None where the scene has a period, got {got}: an impact would move all of its images"
)
WITHOUT_PERIOD = "give it a motion instead of a mass, or leave the period out"


def images_of(surface: Surface, period: Lengths, name: str, largest: float = 0.0) -> list[Surface]:
    """Return the surface and its images that reach into the cell; itself alone if it is the same along the period.

    Args:
        surface: as it is given.
        period: lengths of the cell [m], None along an axis without a period.
        name: of the surface, for the error.
        largest: the largest radius of a ball [m], which a solid this near to a face meets across it; 0 for points.

    Raises:
        SceneError: the surface is neither bounded along the period nor the same all along it, it is longer than the
            period, a cavity that is not within the cell, or it moves along the period or turns over a face.
    """
    _require_place(surface, period, name)
    if isinstance(surface, Outlined):
        _require_within(surface, period, name, largest if surface.is_solid() else 0.0)
        return [surface]
    if isinstance(surface, ManyBodies):
        return [_many_images(surface, period, name, largest)]
    low, high = extent_of(surface)
    shifts: list[list[float]] = [[0.0], [0.0], [0.0]]
    turns = [one for one in parts_of(surface.motion) if isinstance(one, Rotation)]
    for k, length in enumerate(period):
        if length is None:
            continue
        if not is_same_along(surface, k, period):
            title = f"{name} ({type(surface).__name__})"
            shifts[k] = _shifts(surface, (low[k], high[k]), length, title, k, largest)
        elif any(abs(unit_axis(one)[k]) < 1.0 for one in turns):
            raise SceneError(
                f"{name}.motion must not turn a surface that goes on over the faces of the cell along {'xyz'[k]}, got "
                f"{surface.motion}; its velocity does not repeat: leave period[{k}] out"
            )
    every = itertools.product(*shifts)
    found = [surface.shifted(shift) if any(shift) else surface for shift in every]  # type: ignore[arg-type]
    if turns and len(found) > 1:
        raise SceneError(
            f"{name}.motion must not turn a surface that reaches over a face of the cell, got {surface.motion}; move "
            "the surface to where it is within the cell"
        )
    return found


def _require_within(surface: Outlined, period: Lengths, name: str, largest: float) -> None:
    """Raise a `SceneError` if an outline, or a ball that touches it, reaches over a face of the cell."""
    low, high = (corner[:, 0] for corner in surface.corners())
    low, high, near = low - largest, high + largest, f" with a ball of a radius of {largest:g} m" * (largest > 0.0)
    for k, length in enumerate(period):
        if length is not None and not (low[k] >= -_ROUND_OFF * length and high[k] <= (1.0 + _ROUND_OFF) * length):
            raise SceneError(
                f"{name} ({type(surface).__name__}) must be within the cell, from 0 to period[{k}] = {length:g} m, got "
                f"one{near} from {low[k]:.4g} to {high[k]:.4g} m; move it there"
            )


def _many_images(field: ManyBodies, period: Lengths, name: str, largest: float) -> ManyBodies:
    """Return a field with the images of its bodies that reach into the cell."""
    low, high = field.corners()
    shifts = [np.zeros((1, 3))]
    for k, length in enumerate(period):
        if length is None or np.isinf([low[k], high[k]]).all():
            continue
        bad = np.flatnonzero(~(high[k] - low[k] <= length))
        if bad.size:
            raise SceneError(
                f"period[{k}] must be as long as each solid at least, got {length:g}, shorter than body {bad[0]} of "
                f"{name} ({type(field).__name__}), which is {high[k, bad[0]] - low[k, bad[0]]:g} long"
            )
        first = math.floor(-(high[k].max() + largest) / length)
        last = math.ceil(1.0 - (low[k].min() - largest) / length)
        steps = np.zeros((last - first + 1, 3))
        steps[:, k] = length * np.arange(first, last + 1)
        shifts.append(steps)
    # Shifts along one axis after the other
    every = [np.sum(parts, axis=0) for parts in itertools.product(*shifts)]
    near = np.array([[math.inf if length is None else _NEAR * length + largest] for length in period])
    far = near + np.array([[0.0 if length is None else length] for length in period])
    found = []
    for shift in every:
        reaches = (high + shift[:, None] > -near) & (low + shift[:, None] < far)
        bodies = np.flatnonzero(reaches.all(axis=0))
        found.append((bodies, field.centers[bodies] + shift))
    which, centers = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return field.images(which, centers, corners_of(period))


def _shifts(
    surface: Surface, ends: tuple[float, float], length: float, name: str, k: int, largest: float
) -> list[float]:
    """Return the multiples of the period along one axis that bring a bounded surface into the cell."""
    low, high = ends
    if not (math.isfinite(low) and math.isfinite(high)):
        raise SceneError(
            f"{name} must be bounded along {'xyz'[k]}, or the same all along it, where period[{k}] is {length:g}, got "
            f"{surface}; leave that period out, or use another surface"
        )
    if not surface.is_solid():
        if low < -_ROUND_OFF * length or high > (1.0 + _ROUND_OFF) * length:
            raise SceneError(
                f"{name} must be within the cell, from 0 to {length:g} along {'xyz'[k]}, got a cavity from {low:g} to "
                f"{high:g}; move it, or give another period[{k}]"
            )
        return [0.0]
    if high - low > length:
        raise SceneError(
            f"period[{k}] must be as long as each solid at least, got {length:g}, shorter than {name}, which is "
            f"{high - low:g} long"
        )
    # From the image with the lowest upper end in the cell
    near = _NEAR * length + largest
    first, last = math.ceil((-near - high) / length), math.floor((length + near - low) / length)
    return [n * length for n in range(first, last + 1)]


def extent_of(surface: Surface) -> Box:
    """Return the box around a solid or a cavity."""
    if isinstance(surface, Mesh):
        return surface.enclosing_box()
    body = replace(surface, side="inside", motion=None) if surface.is_solid() else surface  # type: ignore[call-arg]
    return body.bounds()


def is_same_along(surface: Surface, k: int, period: Lengths, least: float = _NO_SLOPE) -> bool:
    """Whether a surface has no slope along an axis, at points all around; the fraction `least` counts as 0."""
    reach = 2.0 * surface.extent() or 1.0
    cells = np.array([[-reach, reach] if length is None else [0.0, length] for length in period])
    points = cells[:, :1] + (cells[:, 1:] - cells[:, :1]) * np.random.default_rng(0).random((3, _POINTS))
    slopes = surface.gradient(points)
    good = np.isfinite(slopes).all(axis=0)
    slopes = slopes[:, good]
    return bool(good.any() and (np.abs(slopes[k]) <= least * np.abs(slopes).max(axis=0)).all())


def _require_place(surface: Surface, period: Lengths, name: str) -> None:
    """Raise a `SceneError` if a surface changes its place along the period, or its shape."""
    if surface.reacts() and not _is_same_in_all(surface, period):
        raise SceneError(f"{name}.{MASS_AND_PERIOD.format(got=surface)}; {WITHOUT_PERIOD}")
    for one in parts_of(surface.motion):
        for k, length in enumerate(period):
            if length is not None and _moves_along(one, k, surface, period):
                raise SceneError(
                    f"{name}.motion must leave the surface where it is along {'xyz'[k]}, where period[{k}] is "
                    f"{length:g}, got {one}; move it across the period, or as it "
                    "stays what it is (a plane in itself)"
                )


def _is_same_in_all(surface: Surface, period: Lengths) -> bool:
    """Whether a wall with a mass is unchanged along the period, wherever it is moved: a lid."""
    ways = [k for k, length in enumerate(period) if length is not None]
    return surface.inertia is None and all(_slides(surface, k, period) for k in ways)


def _moves_along(motion: Any, k: int, surface: Surface, period: Lengths) -> bool:
    """Whether a part of a motion moves a surface along an axis, other than in itself."""
    return _goes_along(motion, k, surface) and (isinstance(motion, Rotation) or not _slides(surface, k, period))


def _slides(surface: Surface, k: int, period: Lengths) -> bool:
    """Whether a surface that moves along an axis is unchanged, as a belt is."""
    return not isinstance(surface, Many) and is_same_along(surface, k, period)


def _goes_along(motion: Any, k: int, surface: Surface) -> bool:
    """Whether a part of a motion moves the points of a surface along an axis."""
    if isinstance(motion, Rotation):
        x, y, z = unit_axis(motion).tolist()
        return not (abs((x, y, z)[k]) == 1.0 or surface.is_unturned_by((x, y, z), motion.center))
    if isinstance(motion, Translation):
        return motion.velocity[k] != 0.0
    if isinstance(motion, Oscillation):
        return motion.amplitude[k] != 0.0
    return not isinstance(motion, Path) or any(place[k] != motion.positions[0][k] for place in motion.positions)


# --- Positions -------------------------------------------------------------------------------------------


def lengths_of(period: Any) -> Lengths | None:
    """Return the argument `period`, checked; None if no axis has a period."""
    if period is None:
        return None
    given = checks.parts_of(period)
    if given is None:
        raise SceneError(f"period must be three lengths, or None, got {checks.shown(period)}")
    if len(given) != 3:
        raise SceneError(
            f"period must be three lengths (Lx, Ly, Lz), None for a direction that does not repeat, got {len(given)}: "
            f"{checks.shown(period)}"
        )
    x, y, z = (
        None if one is None or one is False else checks.length(f"period[{k}]", one) for k, one in enumerate(given)
    )
    return None if (x, y, z) == (None, None, None) else (x, y, z)


def into_cell(period: Lengths, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return points (3, N) in the cell, each coordinate in [0, L), and how many cells away they were, (3, N)."""
    inside = np.array(points).reshape(3, -1)
    image = np.zeros(inside.shape, np.int64)
    for k, length in enumerate(period):
        if length is None:
            continue
        row = inside[k]
        away = np.floor(row / length)
        row -= away * length
        # The quotient is rounded.
        for beyond, step in ((row < 0.0, -1.0), (row >= length, 1.0)):
            away[beyond] += step
            row[beyond] -= step * length
        tiny = row >= length
        away[tiny] += 1.0
        row[tiny] = 0.0
        image[k] = away
    return inside.reshape(points.shape), image.reshape(points.shape)


def cell_of(period: Lengths) -> Box:
    """Return two corners of the cell, infinite along an axis without a period."""
    x, y, z = (math.inf if length is None else length for length in period)
    low = [-math.inf if length is None else 0.0 for length in period]
    return (low[0], low[1], low[2]), (x, y, z)


def corners_of(period: Lengths) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return `cell_of` as arrays (3,)."""
    low, high = cell_of(period)
    return np.array(low), np.array(high)
