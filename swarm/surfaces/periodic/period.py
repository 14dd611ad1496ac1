"""A cell that repeats without end: when a flight leaves it, and the way back into it.

Every wall that reaches beyond a face, or close to one, is there a second time, shifted by the period: so the walls of a
particle in the cell, and a little outside of it, are all in the scene. A flight ends a little beyond the face at the
latest, so that no round-off decides whether it has left; where no wall that has images is in the way it goes on over
any number of cells, which are counted at its end.

Along an axis along which every wall is the same a face is no event. Else there are gaps: between two coordinates there
is no wall that has images, and what flies there, however far along the other axes, meets only walls that are the same
all along the period. And what flies along an axis and passes all walls of a cell passes those of every cell.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec
from ...state import Floats
from ..fields.many import Many
from ..surface import Surface
from ..time_of_impact.flights import Hit
from .axes import (
    Free,
    excess,
    fastest,
    image_of,
    inside,
    is_beyond_face,
    is_free,
    is_out,
    least,
    length_of,
    most,
    pulls,
    room_along,
    time_to_leave,
)  # fmt: skip
from .gaps import Beside, Gap, Gaps, longer, over_faces
from .images import Lengths, extent_of, is_same_along

# Halvings of the part of a step after which it leaves.
_HALVINGS = 60
# Of the period, the room that a gap leaves to the walls beside it, and the narrowest one that is worth a look; among
# the bodies of fields that is one over several layers of them, for there each look is paid at each cell of the grid.
_ROOM, _NARROWEST, _AMONG_FIELDS = 1e-3, 1e-2, 0.25


class Period(Record):
    """The cell: its length along each axis [m], None where it does not repeat.

    `fall` is the potential energy per mass of one image along each axis, None where gravity pulls along none of them;
    `gaps` are those in which flights go on over all faces, or None where walls are known in the cell alone.
    """

    x: Any
    y: Any
    z: Any
    fall: Any
    gaps: Any = None


class Return(Record):
    """A position in the cell, and by how many images along each axis it has come back."""

    r: Vec
    images: Vec


def into(period, r):
    """The `Return` of a position into the cell."""
    if period is None:
        return Return(r, ZERO)
    n = Vec(image_of(period.x, r.x), image_of(period.y, r.y), image_of(period.z, r.z))
    return Return(Vec(inside(period.x, r.x, n.x), inside(period.y, r.y, n.y), inside(period.z, r.z, n.z)), n)


def moved_into(period, r, other):
    """A position, moved by as many images as another one is into the cell."""
    n = into(period, other).images
    return r - Vec(n.x * length_of(period.x), n.y * length_of(period.y), n.z * length_of(period.z))


def has_left(period, r):
    """Whether a position is outside the cell."""
    if period is None:
        return False
    return is_out(period.x, r.x) | is_out(period.y, r.y) | is_out(period.z, r.z)


def keeps_walls(period, r):
    """Whether the walls at a position outside the cell are those of its place in the cell, not images of others."""
    x = is_free(period.x) | (not is_out(period.x, r.x))
    y = is_free(period.y) | (not is_out(period.y, r.y))
    z = is_free(period.z) | (not is_out(period.z, r.z))
    # The first is a constant, without which this would cost 13 ns a face.
    return (is_free(period.x) | is_free(period.y) | is_free(period.z)) & x & y & z


def is_beyond(period, r):
    """Whether a position is farther outside than walls are known."""
    if period is None:
        return False
    return is_beyond_face(period.x, r.x) | is_beyond_face(period.y, r.y) | is_beyond_face(period.z, r.z)


def cut(period, gravity, motion, remaining, hit):
    """The `Hit` of a flight (r, v), or that it leaves the cell before; `remaining` is the time until the frame ends."""
    if period is None:
        return hit
    (r, v), (gx, gy, gz) = motion, pulls(gravity)
    x, y = time_to_leave(period.x, r.x, v.x, gx), time_to_leave(period.y, r.y, v.y, gy)
    z = time_to_leave(period.z, r.z, v.z, gz)
    late = EPSILON * remaining
    first, hit = over_faces(period.gaps, period, gravity, motion, (least(x, y, z), hit, 2.0 * late))
    # What is left of the frame is rounded at each face, the same way each time: 0.1 m after 1e8 faces. So the flight
    # ends a little later, after a time that leaves exactly what it is rounded to.
    exact = remaining - (remaining - (first + late))
    room = least(room_along(period.x), room_along(period.y), room_along(period.z))
    short = _fastest(gravity, v, first) * late <= room
    time = select(short, exact, first)
    leaves = time < hit.time
    return Hit(select(leaves, time, hit.time), select(leaves, -1.0, hit.wall))


def _fastest(gravity, v, t):
    """The greatest speed along an axis, which is not exceeded within a time t."""
    gx, gy, gz = pulls(gravity)
    return most(fastest(gx, v.x, t), fastest(gy, v.y, t), fastest(gz, v.z, t))


def on_time(period, gravity, motion, remaining, time, room):
    """When a flight (r, v) among bodies ends that is free until `time`, and may go on by `room` along each axis.

    Where nothing repeats that is then.
    """
    if period is None:
        return time
    _r, v = motion
    # As in `cut`: cells of a grid are as many as faces.
    late = EPSILON * remaining
    exact = remaining - (remaining - (time + late))
    short = 2.0 * _fastest(gravity, v, time) * late <= least(room.x, room.y, room.z)
    return longer(period.gaps, period, gravity, motion, (select(short, exact, time), 2.0 * late))


def part_until(period, step):
    """The part of a step after which it leaves; `step` is the polynomial r0 + s (a + s (b + s c)) as (r0, a, b, c)."""
    return math.inf if period is None else _part_until(period, step)


@outlined
def _part_until(period, step):
    low, high = 0.0, 1.0
    for _k in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if _has_gone(period, step, middle):
            high = middle
        else:
            low = middle
    return high


def _has_gone(period, step, s):
    r0, a, b, c = step
    r = r0 + s * (a + s * (b + s * c))
    return (excess(period.x, r.x) > 0.0) | (excess(period.y, r.y) > 0.0) | (excess(period.z, r.z) > 0.0)


# --- From a description ----------------------------------------------------------------------------------


def cell_in(
    period: Lengths, surfaces: Sequence[Surface], fields: bool, fall: Vec | None, largest: float = 0.0
) -> Period:
    """The cell as kernels take it.

    Args:
        period: its lengths [m], None where it does not repeat.
        surfaces: all of the scene, without their images.
        fields: whether kernels take some of them as fields, which are known in the cell alone.
        fall: the potential energy per mass of one image along each axis, or None.
        largest: the largest radius of a ball [m], 0 of points.
    """
    # The places of openings are known in the cell alone.
    if any(piece.openings for one in surfaces for piece in one.surfaces()):
        return Period(*period, fall)
    free = [not fields and length is not None and _are_same(surfaces, [k], period) for k, length in enumerate(period)]
    x, y, z = (Free(length) if is_free and length else length for length, is_free in zip(period, free, strict=True))
    across = [k for k, length in enumerate(period) if length is not None and not free[k]]
    return Period(x, y, z, fall, _gaps(period, surfaces, across, fields, largest) if across else None)


def _are_same(surfaces: Sequence[Surface], axes: Sequence[int], period: Lengths) -> bool:
    """Whether surfaces are the same along axes, to the last digit: a flight may go on over 1e12 cells."""
    return all(not isinstance(one, Many) and is_same_along(one, k, period, least=0.0) for one in surfaces for k in axes)


def _gaps(
    period: Lengths, surfaces: Sequence[Surface], across: Sequence[int], fields: bool, largest: float
) -> Gaps | None:
    """The gaps along the axes `across`, along which not all walls are the same; None where walls with images move."""
    repeated = [one for one in surfaces if not _are_same([one], across, period)]
    if any(one.motion is not None for one in repeated):
        return None
    boxes = [_corners(one) for one in repeated]
    low, high = (np.concatenate(ends, axis=1) for ends in zip(*boxes, strict=True))
    low, high = low - largest, high + largest
    least = _AMONG_FIELDS if fields else _NARROWEST
    x, y, z = (
        _beside(low[k], high[k]) if length is None else _gap(low[k], high[k], length, least) if k in across else None
        for k, length in enumerate(period)
    )
    # Among bodies of fields a flight ends at each cell of a grid, and it is never known that it passes all of them.
    if fields and (x, y, z) == (None, None, None):
        return None
    return Gaps(x, y, z, 1.0 if len(repeated) < len(surfaces) else None)


def _corners(surface: Surface) -> tuple[Floats, Floats]:
    """The corners (3, n) of boxes around what a surface fills, or around each of its bodies."""
    if isinstance(surface, Many):
        return surface.corners()
    low, high = extent_of(surface)
    return np.array(low)[:, None], np.array(high)[:, None]


def _beside(low: Floats, high: Floats) -> Beside | None:
    """The places below and above intervals that do not repeat, or None."""
    first, last = float(low.min()), float(high.max())
    room = _ROOM * (last - first)
    return Beside(first - room, last + room) if math.isfinite(room) else None


def _gap(low: Floats, high: Floats, length: float, least: float) -> Gap | None:
    """The widest gap between intervals that repeat, or None where that is less than a part of the length."""
    if not (high - low < length).all():
        return None
    begin = low % length
    order = np.argsort(begin)
    begin, end = begin[order], (begin + (high - low))[order]
    # How far those before each of them reach, once around the period
    reached = np.maximum.accumulate(np.concatenate([[end.max() - length], end[:-1]]))
    k, room = int(np.argmax(begin - reached)), _ROOM * length
    first, last = float(reached[k]) + room, float(begin[k]) - room
    if not last - first > least * length:
        return None
    return Gap(first + length, last + length) if first < 0.0 else Gap(first, last)
