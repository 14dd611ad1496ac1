"""A periodic cell: when a flight leaves it, and the way back into it.

Every wall that reaches beyond a face, or close to one, has an image, shifted by the period: so the walls of a
particle in the cell, and a little outside it, are all in the scene. A flight ends a little beyond the face at the
latest, so that no round-off decides whether it has left; if no wall with images is in the way it continues over
any number of cells, which are counted at its end.

Along an axis along which every wall is the same a face is no event. Else there are gaps: between two coordinates there
is no wall with images, and a flight there, however far along the other axes, meets only walls that are the same
all along the period. And a flight along an axis that passes all walls of a cell passes those of every cell.
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
# As parts of the period: the distance of a gap from the walls beside it, and the narrowest gap that is used; among
# the bodies of fields it spans several layers of them, for it is tested at each cell of the grid there.
_ROOM, _NARROWEST, _AMONG_FIELDS = 1e-3, 1e-2, 0.25


class Period(Record):
    """The cell: its length along each axis [m], None along an axis without a period.

    `fall` is the potential energy per mass of one image along each axis, None if gravity pulls along none of them;
    `gaps` are those in which flights cross all faces, or None if walls are known in the cell alone.
    """

    x: Any
    y: Any
    z: Any
    fall: Any
    gaps: Any = None


class Return(Record):
    """A position in the cell, and the number of images along each axis by which it was moved."""

    r: Vec
    images: Vec


def into(period, r):
    """Return the `Return` of a position into the cell."""
    if period is None:
        return Return(r, ZERO)
    n = Vec(image_of(period.x, r.x), image_of(period.y, r.y), image_of(period.z, r.z))
    return Return(Vec(inside(period.x, r.x, n.x), inside(period.y, r.y, n.y), inside(period.z, r.z, n.z)), n)


def moved_into(period, r, other):
    """Return a position, moved by the number of images by which another one is moved into the cell."""
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
    """Whether a position is farther outside the cell than walls are known."""
    if period is None:
        return False
    return is_beyond_face(period.x, r.x) | is_beyond_face(period.y, r.y) | is_beyond_face(period.z, r.z)


def cut(period, gravity, motion, remaining, hit):
    """Return the `Hit` of a flight (r, v), or when it leaves the cell before; `remaining` is left of the frame."""
    if period is None:
        return hit
    (r, v), (gx, gy, gz) = motion, pulls(gravity)
    x, y = time_to_leave(period.x, r.x, v.x, gx), time_to_leave(period.y, r.y, v.y, gy)
    z = time_to_leave(period.z, r.z, v.z, gz)
    late = EPSILON * remaining
    first, hit = over_faces(period.gaps, period, gravity, motion, (least(x, y, z), hit, 2.0 * late))
    # The rest of the frame is rounded at each face, the same way each time: 0.1 m after 1e8 faces. So the flight
    # ends a little later, after a time with an exact rest.
    exact = remaining - (remaining - (first + late))
    room = least(room_along(period.x), room_along(period.y), room_along(period.z))
    short = _fastest(gravity, v, first) * late <= room
    time = select(short, exact, first)
    leaves = time < hit.time
    return Hit(select(leaves, time, hit.time), select(leaves, -1.0, hit.wall))


def _fastest(gravity, v, t):
    """Return the greatest speed along an axis, which is not exceeded within a time t."""
    gx, gy, gz = pulls(gravity)
    return most(fastest(gx, v.x, t), fastest(gy, v.y, t), fastest(gz, v.z, t))


def on_time(period, gravity, motion, remaining, time, room):
    """Return when a flight (r, v) among bodies ends that is free until `time`, and may end later by `room` along axes.

    Without a period it ends at `time`.
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
    """Return the part of a step after which it leaves; the step is r0 + s (a + s (b + s c)), given as (r0, a, b, c)."""
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
    """Return the cell as a record for kernels.

    Args:
        period: its lengths [m], None along an axis without a period.
        surfaces: all surfaces of the scene, without their images.
        fields: whether kernels take some of them as fields, which are known in the cell alone.
        fall: the potential energy per mass of one image along each axis, or None.
        largest: the largest radius of a ball [m], 0 for points.
    """
    # The places of openings are known in the cell alone.
    if any(piece.openings for one in surfaces for piece in one.surfaces()):
        return Period(*period, fall)
    free = [not fields and length is not None and _are_same(surfaces, [k], period) for k, length in enumerate(period)]
    x, y, z = (Free(length) if is_free and length else length for length, is_free in zip(period, free, strict=True))
    across = [k for k, length in enumerate(period) if length is not None and not free[k]]
    return Period(x, y, z, fall, _gaps(period, surfaces, across, fields, largest) if across else None)


def _are_same(surfaces: Sequence[Surface], axes: Sequence[int], period: Lengths) -> bool:
    """Whether surfaces are the same along axes, to the last digit: a flight may cross 1e12 cells."""
    return all(not isinstance(one, Many) and is_same_along(one, k, period, least=0.0) for one in surfaces for k in axes)


def _gaps(
    period: Lengths, surfaces: Sequence[Surface], across: Sequence[int], fields: bool, largest: float
) -> Gaps | None:
    """Return the gaps along the axes `across`, along which not all walls are alike; None if walls with images move."""
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
    """Return the corners (3, n) of boxes around the volume of a surface, or around each of its bodies."""
    if isinstance(surface, Many):
        return surface.corners()
    low, high = extent_of(surface)
    return np.array(low)[:, None], np.array(high)[:, None]


def _beside(low: Floats, high: Floats) -> Beside | None:
    """Return the places below and above intervals along an axis without a period, or None."""
    first, last = float(low.min()), float(high.max())
    room = _ROOM * (last - first)
    return Beside(first - room, last + room) if math.isfinite(room) else None


def _gap(low: Floats, high: Floats, length: float, least: float) -> Gap | None:
    """Return the widest gap between periodic intervals, or None if it is less than a part of the length."""
    if not (high - low < length).all():
        return None
    begin = low % length
    order = np.argsort(begin)
    begin, end = begin[order], (begin + (high - low))[order]
    # How far the intervals before each reach, once around the period
    reached = np.maximum.accumulate(np.concatenate([[end.max() - length], end[:-1]]))
    k, room = int(np.argmax(begin - reached)), _ROOM * length
    first, last = float(reached[k]) + room, float(begin[k]) - room
    if not last - first > least * length:
        return None
    return Gap(first + length, last + length) if first < 0.0 else Gap(first, last)
