"""Counters of soft balls. They read the move of each centre in a step, and change no bit of it."""

from typing import Any, NamedTuple

from ..kernel.arrays import index
from ..kernel.jit import Array, outlined
from ..kernel.vector import vector_at
from ..lanes.watching.crossings import ParticleMoment
from ..surfaces.periodic.period import has_left, into
from . import grain_arrays as col
from .contacts import move_of


class Passing(NamedTuple):
    """The arrays that counters of soft balls read and write, in the order of the particles' numbers."""

    mass: Array  # (N,) [kg]
    crossed: Any  # `Crossed`
    period: Any  # `Period` of the cell, or None
    image: Any = None  # (3, N) the cells in which the balls were when the lists were made, or None


@outlined
def count_moves(matter, grains, followed):
    """Count the crossings of all centres in the step; `followed` is a `Followed` of `Passing`, its log ends there."""
    period, log, first = followed.state.period, followed.log, 0
    for k in range(grains.place.shape[0]):
        i = index(k)
        p, move = index(grains.number[i]), move_of(matter, grains, i)
        # Between two lists a centre may be a little outside the cell.
        here = into(period, vector_at(grains.place, i, col.X))
        r = here.r
        before = ParticleMoment(r, vector_at(grains.speed, i, col.BEFORE), matter.h)
        after = ParticleMoment(r + move, vector_at(grains.speed, i, col.AFTER), 0.0)
        if log is not None:
            first = index(log.filled[0])
        matter.counters.count_step(followed, p, before, after)
        if log is not None:
            log.shift(first, here.images)
        if has_left(period, after.r):
            again = into(period, after.r)
            if log is not None:
                first = index(log.filled[0])
            matter.counters.come_back(followed, p, before, after.r, after._replace(r=again.r))
            if log is not None:
                log.shift(first, here.images + again.images)
