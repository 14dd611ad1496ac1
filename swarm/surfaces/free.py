"""Where nothing is in the way of flights through a cell that repeats: they go on over its faces.

Along an axis along which every wall is the same a face is no event. Else there are gaps: between two coordinates there
is no wall that has images, and what flies there, however far along the other axes, meets only walls that are the same
all along the period. And what flies along an axis and passes all walls of a cell passes those of every cell.
"""

import math
from collections.abc import Sequence

from ..kernel.vector import Vec
from .fields.many import Many
from .images import Lengths, body_of, is_same_along
from .period import Beside, Free, Gap, Gaps, Period
from .surface import Surface

# Of the period, the room that a gap leaves to the walls beside it, and the narrowest one that is worth a look.
_ROOM, _NARROWEST = 1e-3, 1e-2


def cell_in(period: Lengths, surfaces: Sequence[Surface], known: bool, fall: Vec | None) -> Period:
    """The cell as kernels take it.

    Args:
        period: its lengths [m], None where it does not repeat.
        surfaces: all of the scene, without their images.
        known: whether kernels know all walls at any place: those of fields they know in the cell alone.
        fall: the potential energy per mass of one image along each axis, or None.
    """
    # The places of openings, too, are known in the cell alone.
    known = known and not any(isinstance(one, Many) or one.openings for one in surfaces)
    free = [known and length is not None and _are_same_along(surfaces, k, period) for k, length in enumerate(period)]
    x, y, z = (Free(length) if is_free and length else length for length, is_free in zip(period, free, strict=True))
    across = [k for k, length in enumerate(period) if length is not None and not free[k]]
    return Period(x, y, z, fall, _gaps(period, surfaces, across) if known and across else None)


def _are_same_along(surfaces: Sequence[Surface], k: int, period: Lengths) -> bool:
    """Whether every surface is the same along an axis, to the last digit: a flight may go on over 1e12 cells."""
    return all(is_same_along(surface, k, period, least=0.0) for surface in surfaces)


def _gaps(period: Lengths, surfaces: Sequence[Surface], across: Sequence[int]) -> Gaps | None:
    """The gaps along the axes `across`, along which not all walls are the same; None where walls with images move."""
    repeated = [one for one in surfaces if not all(is_same_along(one, k, period, least=0.0) for k in across)]
    if any(one.motion is not None for one in repeated):
        return None
    boxes = [(body_of(one) if one.is_solid() else one).bounds() for one in repeated]
    ends = [[(low[k], high[k]) for low, high in boxes] for k in range(3)]
    x, y, z = (
        _beside(ends[k]) if length is None else _gap(ends[k], length) if k in across else None
        for k, length in enumerate(period)
    )
    return Gaps(x, y, z, 1.0 if len(repeated) < len(surfaces) else None)


def _beside(ends: Sequence[tuple[float, float]]) -> Beside | None:
    """The places below and above intervals that do not repeat, or None."""
    low, high = min(low for low, _high in ends), max(high for _low, high in ends)
    room = _ROOM * (high - low)
    return Beside(low - room, high + room) if math.isfinite(room) else None


def _gap(ends: Sequence[tuple[float, float]], length: float) -> Gap | None:
    """The widest gap between intervals that repeat, or None."""
    if any(not high - low < length for low, high in ends):
        return None
    begins = sorted((low % length, low % length + high - low) for low, high in ends)
    # Once around the period, from the end of those before
    widest, reached = Gap(0.0, 0.0), max(end for _begin, end in begins) - length
    for begin, end in begins:
        if begin - reached > widest.high - widest.low:
            widest = Gap(reached, begin)
        reached = max(reached, end)
    room = _ROOM * length
    low, high = widest.low + room, widest.high - room
    if not high - low > _NARROWEST * length:
        return None
    return Gap(low + length, high + length) if low < 0.0 else Gap(low, high)
