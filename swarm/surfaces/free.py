"""Where nothing is in the way of flights through a cell that repeats: they go on over its faces.

Along an axis along which every wall is the same a face is no event. Else there are gaps: between two coordinates there
is no wall that has images, and what flies there, however far along the other axes, meets only walls that are the same
all along the period. And what flies along an axis and passes all walls of a cell passes those of every cell.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernel.vector import Vec
from .axes import Free
from .fields.many import Many
from .gaps import Beside, Gap, Gaps
from .images import Lengths, body_of, is_same_along
from .period import Period
from .surface import Surface

Floats = NDArray[np.float64]

# Of the period, the room that a gap leaves to the walls beside it, and the narrowest one that is worth a look; among
# the bodies of fields that is one over several layers of them, for there each look is paid at each cell of the grid.
_ROOM, _NARROWEST, _AMONG_FIELDS = 1e-3, 1e-2, 0.25


def cell_in(period: Lengths, surfaces: Sequence[Surface], fields: bool, fall: Vec | None) -> Period:
    """The cell as kernels take it.

    Args:
        period: its lengths [m], None where it does not repeat.
        surfaces: all of the scene, without their images.
        fields: whether kernels take some of them as fields, which are known in the cell alone.
        fall: the potential energy per mass of one image along each axis, or None.
    """
    # The places of openings are known in the cell alone.
    if any(one.openings for one in surfaces):
        return Period(*period, fall)
    free = [not fields and length is not None and _are_same(surfaces, [k], period) for k, length in enumerate(period)]
    x, y, z = (Free(length) if is_free and length else length for length, is_free in zip(period, free, strict=True))
    across = [k for k, length in enumerate(period) if length is not None and not free[k]]
    return Period(x, y, z, fall, _gaps(period, surfaces, across, fields) if across else None)


def _are_same(surfaces: Sequence[Surface], axes: Sequence[int], period: Lengths) -> bool:
    """Whether surfaces are the same along axes, to the last digit: a flight may go on over 1e12 cells."""
    return all(not isinstance(one, Many) and is_same_along(one, k, period, least=0.0) for one in surfaces for k in axes)


def _gaps(period: Lengths, surfaces: Sequence[Surface], across: Sequence[int], fields: bool) -> Gaps | None:
    """The gaps along the axes `across`, along which not all walls are the same; None where walls with images move."""
    repeated = [one for one in surfaces if not _are_same([one], across, period)]
    if any(one.motion is not None for one in repeated):
        return None
    boxes = [_corners(one) for one in repeated]
    low, high = (np.concatenate(ends, axis=1) for ends in zip(*boxes, strict=True))
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
    low, high = (body_of(surface) if surface.is_solid() else surface).bounds()
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
