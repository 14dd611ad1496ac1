"""With whom a ball collides next, and when it meets a wall.

A ball has one collision of its own, the soonest. One that its partner would have after another does not count: then
the partner has another flight, or looks again. So of two balls at least one knows of their collision, or has another
one before it.
"""

import math
from typing import Any

from ..kernel.arrays import index
from ..kernel.jit import outlined
from ..kernel.record import Record
from ..kernel.vector import Vec, dot, square
from ..surfaces import flights
from .rows import CELL, DUE, FLOATS, MEETS, NEXT, NOBODY, PARTNER, SEEN, STAMP, WALL, WHOLES

# No wall is asked for in a cell that is far from all.
UNKNOWN = -2.0


class Alike(Record):
    """Balls of one radius and one mass."""

    radius: float
    mass: float
    reach2: float  # the square of a diameter

    def radius_of(self, i):
        """Its radius [m]."""
        return self.radius

    def mass_of(self, i):
        """Its mass [kg]."""
        return self.mass

    def share(self, i, j):
        """The part that ball j has of the mass of both."""
        return 0.5

    def touching2(self, i, j):
        """The square of the distance at which two touch."""
        return self.reach2


class Various(Record):
    """Balls of any radii and masses."""

    radius: Any  # (N,)
    mass: Any  # (N,)

    def radius_of(self, i):
        """Its radius [m]."""
        return self.radius[index(i)]

    def mass_of(self, i):
        """Its mass [kg]."""
        return self.mass[index(i)]

    def share(self, i, j):
        """The part that ball j has of the mass of both."""
        other = self.mass_of(j)
        return other / (self.mass_of(i) + other)

    def touching2(self, i, j):
        """The square of the distance at which two touch."""
        reach = self.radius_of(i) + self.radius_of(j)
        return reach * reach


def between(grid, r, other):
    """The way from one place to the nearest image of another one."""
    return Vec(*(axis.nearest(b - a) for axis, a, b in zip(grid.axes(), r, other, strict=True)))


def meeting(b, u, touching2):
    """How long two balls fly that are b apart and move apart by u before they touch, without cancellation."""
    closing, time = dot(b, u), math.inf
    if closing < 0.0:
        gap = square(b) - touching2
        discriminant = closing * closing - square(u) * gap
        if discriminant > 0.0:
            time = gap / (math.sqrt(discriminant) - closing)
            # Closer by round-off
            time = max(time, 0.0)
    return time


@outlined
def meeting_of_any(grid, r, other, u, touching2):
    """`meeting` of a ball with any image of another one, where these are few and far from one another."""
    soonest = math.inf
    for kx in range(3):
        for ky in range(3):
            for kz in range(3):
                shifts = tuple(
                    float(k - 1) * (0.0 if axis.period is None else axis.period)
                    for k, axis in zip((kx, ky, kz), grid.axes(), strict=True)
                )
                b = Vec(*(one - two + shift for one, two, shift in zip(other, r, shifts, strict=True)))
                soonest = min(meeting(b, u, touching2), soonest)
    return soonest


@outlined
def find_partner(box, flock, i, now):
    """Find the next collision of a ball: whether there is one."""
    grid, pull = box.grid, box.pull
    r, v = flock.at(pull, i, now)
    row = WHOLES * i + CELL
    cx, cy, cz = flock.tag[index(row)], flock.tag[index(row + 1)], flock.tag[index(row + 2)]
    first, mate = math.inf, NOBODY
    for kx in range(3):
        plane = grid.x.offset[index(cx + kx - 1)]
        for ky in range(3):
            line = grid.y.offset[index(cy + ky - 1)] + plane
            for kz in range(3):
                j = flock.head[index(grid.z.offset[index(cz + kz - 1)] + line)]
                while j >= 0:
                    if j != i:
                        other, w = flock.at(pull, j, now)
                        touching2 = box.kinds.touching2(i, j)
                        if grid.few is None:
                            time = now + meeting(between(grid, r, other), w - v, touching2)
                        else:
                            time = now + meeting_of_any(grid, r, other, w - v, touching2)
                        sooner = (time < first) | ((time == first) & (j < mate))
                        if sooner and time <= flock.event[index(FLOATS * j + MEETS)] and time < math.inf:
                            first, mate = time, j
                    j = flock.link[index(WHOLES * j + NEXT)]
    flock.event[index(FLOATS * i + MEETS)], flock.tag[index(WHOLES * i + PARTNER)] = first, mate
    if mate >= 0:
        flock.tag[index(WHOLES * i + SEEN)] = flock.tag[index(WHOLES * mate + STAMP)]
    return mate >= 0


def tell_partner(flock, i):
    """Let the partner of a ball know of their collision, if it is its soonest too: that ball, or nobody."""
    mate, time = flock.tag[index(WHOLES * i + PARTNER)], flock.event[index(FLOATS * i + MEETS)]
    told = NOBODY
    if mate >= 0 and time < flock.event[index(FLOATS * mate + MEETS)]:
        flock.event[index(FLOATS * mate + MEETS)] = time
        flock.tag[index(WHOLES * mate + PARTNER)] = i
        flock.tag[index(WHOLES * mate + SEEN)] = flock.tag[index(WHOLES * i + STAMP)]
        told = mate
    return told


def forget_wall(box, flock, i):
    """The next wall of a ball is not known any more."""
    flock.event[index(FLOATS * i + DUE)], flock.event[index(FLOATS * i + WALL)] = math.inf, UNKNOWN


@outlined
def find_wall(box, flock, i, now):
    """Find when a ball meets a wall, if its cell is near one and that is not known."""
    row = FLOATS * i
    if box.grid.near[index(box.grid.number(i, flock))] and flock.event[index(row + WALL)] == UNKNOWN:
        r, v = flock.at(box.pull, i, now)
        hit = flights.first_hit(box.walls.grown(box.kinds.radius_of(i)), box.pull, r, v)
        flock.event[index(row + DUE)], flock.event[index(row + WALL)] = now + hit.time, hit.wall
