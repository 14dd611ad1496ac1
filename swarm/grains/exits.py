"""Openings of walls for soft balls, and balls that have left through an opening.

As for balls with `Impact`, an opening has no rim: the foot of a ball on a wall at the start of each step decides
whether the wall is open to it. A ball that then reaches into the wall has escaped, and stays where it is. The energy
that its contacts store is lost: with the wall, if the ball has pressed on it, and with other balls.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.vector import norm, vector_at
from ..lanes.watching.log import Struck
from ..surfaces.periodic.period import into
from ..surfaces.presence.openings import is_open
from . import grain_arrays as col
from .contacts import apart, move_of
from .heavy_walls import place_on
from .vessel import met, met_member


@outlined
def open_wall(matter, wall, numbers, grains, near):
    """Find the balls near a wall to which it is open in the step; `numbers` are those of the wall and its first row."""
    place, (number, first) = grains.place, numbers
    for k in range(near.wall_first[number], near.wall_first[number + 1]):
        c = index(k)
        i = index(near.slot[c])
        r, radius = vector_at(place, i, col.X), place[i, col.RADIUS]
        own = met(wall, near.listed, near.spans, c, radius)
        # The length of the normal is 1 only on the wall.
        n = own.unit_normal(r)
        foot = r + ((radius - own.distance(r)) / norm(n)) * n
        near.wall_is_open[c] = is_open(matter.openings, first, place_on(own, foot), 0.0)


@outlined
def let_out(matter, wall, world, given):
    """Let balls that reach into an open wall at the end of the step escape; return their number.

    `given` is the number of the wall, and the time of the end of the step [s].
    """
    grains, near, books, noting, (number, time) = world.grains, world.near, world.books, world.noting, given
    place, found = grains.place, 0
    for k in range(near.wall_first[number], near.wall_first[number + 1]):
        c = index(k)
        if near.wall_is_open[c]:
            i = index(near.slot[c])
            one, r = index(grains.number[i]), vector_at(place, i, col.X)
            own = met(wall, near.listed, near.spans, c, place[i, col.RADIUS])
            books.dissipated[one] += matter.law.stored_energy(own.gap_of(own.inner(r)))
            end = r + move_of(matter, grains, i)
            reaches = own.level_of(own.end_inner(end)) > 0.0
            if reaches and math.isnan(books.escape_time[one]):
                books.escape_time[one] = time
                if noting is not None:
                    m = met_member(wall, near.listed, near.spans, c, place[i, col.RADIUS], end)
                    member = world.places[number][index(m)]
                    back, v = into(noting.period, end), vector_at(grains.speed, i, col.AFTER)
                    struck = Struck(grains.number[i], float(member), time, back.r, v, v, 0.0)
                    noting.log.ended(noting.image, struck, back.images)
                found += 1
    return found


def stored_with_others(matter: Any, world: Any, gone: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The energy [J] that contacts with other balls store of each ball in `gone`, half each if both are in it."""
    near, place, found = world.near, world.grains.place, np.zeros(len(gone))
    first = near.first[: len(gone) + 1]
    one, other = np.repeat(np.arange(len(gone)), np.diff(first)), near.mate[: int(first[-1])]
    for k in np.flatnonzero(gone[one] | gone[other]):
        i, j = int(one[k]), int(other[k])
        gap = place[i, col.RADIUS] + place[j, col.RADIUS] - norm(apart(matter, place, i, j))
        ends = [end for end in (i, j) if gone[end]]
        found[ends] += matter.law.stored_energy(gap) / len(ends)
    return found
