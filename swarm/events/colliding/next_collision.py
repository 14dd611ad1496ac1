"""The next collision of a ball with another one, and the time at which it meets a wall.

A ball has one collision of its own, the soonest. One that its partner would have after another does not count: then
the partner has another flight, or looks again. So of two balls at least one knows of their collision, or has another
one before it.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ...kernel.arrays import fetch, index, unwritten
from ...kernel.gravity import accelerated, as_vector, displacement
from ...kernel.jit import Array, outlined, select
from ...kernel.record import Record
from ...kernel.vector import ZERO, Vec, dot, either, square
from ...surfaces.shapes.sphere import ball
from ...surfaces.time_of_impact.flights import Hit
from .heavy import meet_heavy
from .rows import DUE, FLOATS, MEETS, NO_PARTNER, PARTNER, SEEN, STAMP, WHOLES
from .window import OUT, UNKNOWN, next_hit

# Cells around a ball, its own included, and how many balls of them are looked at at once.
_CELLS, _MOST = 27, 128
# The mass of a ball that a wall holds [kg]: that of two is then the other one's, to the last bit.
FIXED = 2.0**200
# So many parts a fall beside a ball that is held has at most, in each of which it surely meets it or not.
_PARTS = 100
# Of the cells around a ball: those beyond no face alone.
_ANY = 6


class NextCollision(NamedTuple):
    """A collision of a ball: its time [s since the epoch], and the other ball."""

    time: Any
    mate: Any


class Alike(Record):
    """Balls of one radius and one mass."""

    radius: float
    mass: float
    reach2: float  # the square of a diameter

    def is_held(self, i):
        """Whether a wall holds it."""
        return False

    def radius_of(self, i):
        """Its radius [m]."""
        return self.radius

    def mass_of(self, i):
        """Its mass [kg]."""
        return self.mass

    def ask(self, i):
        """Ask for what is needed of a ball soon."""

    def share(self, i, j):
        """The part that ball j has of the mass of both."""
        return 0.5

    def touching2(self, i, j):
        """The square of the distance at which two touch."""
        return self.reach2


class Various(Record):
    """Balls of any radii and masses, each in one line of the cache (measured apart: a collision takes 1.3 times)."""

    size: Array  # (2 N): of each ball its radius [m] and its mass [kg]

    def is_held(self, i):
        """Whether a wall holds it."""
        return False

    def radius_of(self, i):
        """Its radius [m]."""
        return self.size[index(2 * i)]

    def mass_of(self, i):
        """Its mass [kg]."""
        return self.size[index(2 * i + 1)]

    def ask(self, i):
        """Ask for what is needed of a ball soon."""
        fetch(self.size, 2 * i)

    def share(self, i, j):
        """The part that ball j has of the mass of both."""
        other = self.mass_of(j)
        return other / (self.mass_of(i) + other)

    def touching2(self, i, j):
        """The square of the distance at which two touch."""
        reach = self.radius_of(i) + self.radius_of(j)
        return reach * reach


class Holdable(Various):
    """Balls that walls may hold: meanwhile they are obstacles at rest for others."""

    def masses(self):
        """(N,) the masses, or `FIXED` [kg]."""
        return self.size[1::2]

    def hold(self, i):
        """A wall holds it from now on."""
        self.size[index(2 * i + 1)] = FIXED

    def let_go(self, i, mass):
        """Nothing holds it any more."""
        self.size[index(2 * i + 1)] = mass

    def is_held(self, i):
        """Whether a wall holds it."""
        return self.mass_of(i) == FIXED


def between(grid, r, other):
    """The way from one place to the nearest image of another one."""
    return Vec(*(axis.nearest(b - a) for axis, a, b in zip(grid.axes(), r, other, strict=True)))


def meeting(closing, gap, discriminant):
    """How long two balls fly before they touch, without cancellation; where they are too near by round-off, 0."""
    time = gap / (math.sqrt(discriminant) - closing)
    return select(time > 0.0, time, 0.0)


class Sight(NamedTuple):
    """Two balls, as one sees the other: b.u, b^2 less what it is where they touch, and a fourth of a discriminant."""

    closing: Any
    gap: Any
    discriminant: Any

    def meets(self):
        """Whether they will touch."""
        return (self.closing < 0.0) & (self.discriminant > 0.0)


def sight(b, u, touching2):
    """The `Sight` of a ball that is b away and moves by u."""
    closing, gap = dot(b, u), square(b) - touching2
    return Sight(closing, gap, closing * closing - square(u) * gap)


def _sight_in(box, b, u, touching2, now):
    """The `Sight` of balls that may grow."""
    return sight(b, u, touching2) if box.growth is None else box.growth.sight(b, u, touching2, now)


@outlined
def _fall_time(b, u, pull, touching2):
    """How long a ball that is b away falls, with the velocity u, before it touches another one at rest."""
    solid, time = ball(ZERO, math.sqrt(touching2)), 0.0
    for _part in range(_PARTS):
        free, found = solid.falling_hit(b, u, pull)
        time += free
        if found or time == math.inf:
            return time
        b, u = b + displacement(pull, u, free), accelerated(pull, u, free)
    return math.inf


def _touch_time(box, flock, pair, b, u, now):
    """How long a pair flies before it touches, the second b away from the first and with u relative to it."""
    i, j = pair
    touching2 = box.kinds.touching2(i, j)
    if flock.holds is not None and box.pull is not None and flock.is_held(i, now) != flock.is_held(j, now):
        # One falls, the other one is a solid ball at rest.
        pull = as_vector(box.pull)
        return _fall_time(b, u, either(flock.is_held(i, now), pull, -1.0 * pull), touching2)
    seen = _sight_in(box, b, u, touching2, now)
    return meeting(*seen) if seen.meets() else math.inf


@outlined
def _meeting_of_any(box, flock, pair, way, u, now):
    """When a ball meets any image of another one, where these are few and far from one another."""
    soonest, grid = math.inf, box.grid
    for kx in range(3):
        for ky in range(3):
            for kz in range(3):
                shifts = tuple(
                    float(k - 1) * (0.0 if axis.period is None else axis.period)
                    for k, axis in zip((kx, ky, kz), grid.axes(), strict=True)
                )
                b = Vec(*(one + shift for one, shift in zip(way, shifts, strict=True)))
                soonest = min(_touch_time(box, flock, pair, b, u, now), soonest)
    return soonest


@outlined
def _soonest(box, flock, i, now, near, count, known):
    """The soonest collision of ball i: that which is `known`, or one with the first `count` balls `near` it.

    First come those that fly to one another, without a branch, then the roots of these few.
    """
    grid, pull, found = box.grid, box.pull, 0
    r, v = flock.at(pull, i, now)
    some, seen = unwritten(_MOST, np.int32), unwritten((3, _MOST), np.float64)
    for k in range(count):
        j = near[index(k)]
        other, w = flock.at(pull, j, now)
        one = _sight_in(box, between(grid, r, other), w - v, box.kinds.touching2(i, j), now)
        some[index(found)] = j
        for row, value in enumerate(one):
            seen[row, index(found)] = value
        found += select(one.meets(), 1, 0)
    first, mate = known
    for k in range(found):
        j = some[index(k)]
        time = now + meeting(seen[0, index(k)], seen[1, index(k)], seen[2, index(k)])
        sooner = (time < first) | ((time == first) & (j < mate))
        if sooner and time <= flock.event[index(FLOATS * j + MEETS)]:
            first, mate = time, j
    return NextCollision(first, mate)


@outlined
def _soonest_one_by_one(box, flock, i, now, near, count, known):
    """`_soonest` where a ball may meet several images of another one, or falls beside those that walls hold."""
    r, v = flock.at(box.pull, i, now)
    first, mate = known
    for k in range(count):
        j = near[index(k)]
        other, w = flock.at(box.pull, j, now)
        if box.grid.few is None:
            time = now + _touch_time(box, flock, (i, j), between(box.grid, r, other), w - v, now)
        else:
            time = now + _meeting_of_any(box, flock, (i, j), other - r, w - v, now)
        sooner = (time < first) | ((time == first) & (j < mate))
        if sooner and time < math.inf and time <= flock.event[index(FLOATS * j + MEETS)]:
            first, mate = time, j
    return NextCollision(first, mate)


def _looked_at(box, flock, i, now, near, count, known):
    falls = flock.holds is not None and box.pull is not None
    ask = _soonest_one_by_one if falls or box.grid.few is not None else _soonest
    return ask(box, flock, i, now, near, count, known)


def _around(box, flock, i, now, face, known):
    """The `NextCollision` of ball i with all balls in the cells around its own, or only in those beyond a face.

    First come those that are the first ones of their cells, then those after them in the order in which they were
    found: so the processor has no branch to predict from how many balls are in a cell.
    """
    grid, found, done = box.grid, 0, 0
    near = unwritten(_MOST, np.int32)
    step = 2 * (face & 1) - 1
    lows = tuple(select((face >> 1) == k, step, -1) for k in range(3))
    highs = tuple(select((face >> 1) == k, step + 1, 2) for k in range(3))
    cx, cy, cz = flock.cell(i)
    for kx in range(cx + lows[0], cx + highs[0]):
        plane = grid.x.offset[index(kx)]
        for ky in range(cy + lows[1], cy + highs[1]):
            line = grid.y.offset[index(ky)] + plane
            for kz in range(cz + lows[2], cz + highs[2]):
                found += _found(box, flock, flock.head[index(grid.z.offset[index(kz)] + line)], near, found)
    while done < found:
        found += _found(box, flock, flock.after(near[index(done)]), near, found)
        done += 1
        # Of each chain one ball may still be to come, and `_found` writes one more.
        if done == _MOST - _CELLS - 1:
            known = _looked_at(box, flock, i, now, near, done, known)
            found -= done
            for k in range(found):
                near[index(k)] = near[index(done + k)]
            done = 0
    return _looked_at(box, flock, i, now, near, found, known)


def _found(box, flock, j, near, count):
    """Write a ball behind the first `count`, and ask for its flight: 1, or 0 for `NO_PARTNER`."""
    near[index(count)] = j
    fetch(flock.flight, FLOATS * j)
    box.kinds.ask(j)
    return select(j >= 0, 1, 0)


def _keep(flock, i, known):
    flock.event[index(FLOATS * i + MEETS)], flock.tag[index(WHOLES * i + PARTNER)] = known.time, known.mate
    if known.mate >= 0:
        flock.tag[index(WHOLES * i + SEEN)] = flock.tag[index(WHOLES * known.mate + STAMP)]


@outlined
def find_partner(box, flock, i, now):
    """Find the next collision of a ball."""
    _keep(flock, i, _around(box, flock, i, now, _ANY, NextCollision(math.inf, NO_PARTNER)))


@outlined
def look_ahead(box, flock, i, now):
    """Look whether a ball that has come into a cell collides sooner with those that are near now: whether it does."""
    row = FLOATS * i + MEETS
    if box.grid.few is None:
        before = NextCollision(flock.event[index(row)], flock.tag[index(WHOLES * i + PARTNER)])
        known = _around(box, flock, i, now, flock.face(i), before)
        sooner = (known.time < before.time) | (known.mate != before.mate)
        if sooner:
            _keep(flock, i, known)
        return sooner
    find_partner(box, flock, i, now)
    return True


def tell_partner(flock, i):
    """Give the collision of a ball to its partner too, if it is its soonest too. Return the partner or `NO_PARTNER`."""
    mate, time = flock.tag[index(WHOLES * i + PARTNER)], flock.event[index(FLOATS * i + MEETS)]
    partner = NO_PARTNER
    if mate >= 0 and time < flock.event[index(FLOATS * mate + MEETS)]:
        flock.event[index(FLOATS * mate + MEETS)] = time
        flock.tag[index(WHOLES * mate + PARTNER)] = i
        flock.tag[index(WHOLES * mate + SEEN)] = flock.tag[index(WHOLES * i + STAMP)]
        partner = mate
    return partner


def forget_wall(flock, i):
    """The next wall of a ball is not known any more."""
    flock.event[index(FLOATS * i + DUE)] = math.inf
    flock.aim_at(i, UNKNOWN)


def _given_hit(box, flock, i, now):
    """The next `Hit` on a wall without a mass, if the cell is near one."""
    time, wall = math.inf, UNKNOWN
    # Without walls `next_hit` is not compiled.
    if len(box.walls.each) > 0 and box.grid.near[index(box.grid.number(i, flock))]:
        time, wall = next_hit(box, flock, i, now)
    return Hit(time, wall)


@outlined
def find_wall(box, flock, i, now):
    """Find when a ball meets a wall, if its cell is near one and that is not known."""
    if box.heavy is not None:
        # A lease ends for all balls, also for those that are not there, or held.
        if flock.wall(i) <= OUT:
            return
        meet_heavy(box, flock, i, now, _given_hit(box, flock, i, now))
    elif box.grid.near[index(box.grid.number(i, flock))] and flock.wall(i) == UNKNOWN:
        hit = next_hit(box, flock, i, now)
        flock.event[index(FLOATS * i + DUE)] = now + hit.time
        flock.aim_at(i, hit.wall)
