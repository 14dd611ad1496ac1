"""The next collision of a ball with another ball, and its next hit on a wall.

A ball has one next collision, the soonest. A collision that the partner would have after another one does not count:
by then the partner has another flight, or looks again. So at least one of two balls that collide stores their
collision, or has another collision before it.
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

# The cells around a ball, its own included, and the most balls in them that are looked at together.
_CELLS, _MOST = 27, 128
# The mass of a held ball [kg]: the reduced mass of a collision is then the mass of the other ball, to the last bit.
FIXED = 2.0**200
# The most parts of a fall beside a held ball; in each part a hit is certain or excluded.
_PARTS = 100
# This stands for all cells around a ball, in place of a face.
_ANY = 6


class NextCollision(NamedTuple):
    """A collision of a ball: its time [s of the epoch], and the other ball."""

    time: Any
    mate: Any


class Alike(Record):
    """Balls of one radius and one mass."""

    radius: float
    mass: float
    reach2: float  # the square of a diameter

    def is_held(self, i):
        """Whether a wall holds a ball."""
        return False

    def radius_of(self, i):
        """The radius of a ball [m]."""
        return self.radius

    def mass_of(self, i):
        """The mass of a ball [kg]."""
        return self.mass

    def ask(self, i):
        """Fetch the numbers of a ball that are needed soon."""

    def share(self, i, j):
        """The mass of ball j as a part of the mass of both balls."""
        return 0.5

    def touching2(self, i, j):
        """The square of the distance at which two balls touch [m^2]."""
        return self.reach2


class Various(Record):
    """Balls of any radii and masses, each in one line of the cache (in two arrays, a collision takes 1.3 times)."""

    size: Array  # (2 N): the radius [m] and the mass [kg] of each ball

    def is_held(self, i):
        """Whether a wall holds a ball."""
        return False

    def radius_of(self, i):
        """The radius of a ball [m]."""
        return self.size[index(2 * i)]

    def mass_of(self, i):
        """The mass of a ball [kg]."""
        return self.size[index(2 * i + 1)]

    def ask(self, i):
        """Fetch the numbers of a ball that are needed soon."""
        fetch(self.size, 2 * i)

    def share(self, i, j):
        """The mass of ball j as a part of the mass of both balls."""
        other = self.mass_of(j)
        return other / (self.mass_of(i) + other)

    def touching2(self, i, j):
        """The square of the distance at which two balls touch [m^2]."""
        reach = self.radius_of(i) + self.radius_of(j)
        return reach * reach


class Holdable(Various):
    """Balls that walls may hold; a held ball is an obstacle at rest for others."""

    def masses(self):
        """The masses (N,) [kg], `FIXED` of held balls."""
        return self.size[1::2]

    def hold(self, i):
        """Mark a ball as held by a wall."""
        self.size[index(2 * i + 1)] = FIXED

    def let_go(self, i, mass):
        """Mark a ball as free, with its mass [kg]."""
        self.size[index(2 * i + 1)] = mass

    def is_held(self, i):
        """Whether a wall holds a ball."""
        return self.mass_of(i) == FIXED


def between(grid, r, other):
    """The vector from a place to the nearest image of another place."""
    return Vec(*(axis.nearest(b - a) for axis, a, b in zip(grid.axes(), r, other, strict=True)))


def meeting(closing, gap, discriminant):
    """The time until two balls touch, computed without cancellation; 0 if they overlap by round-off."""
    time = gap / (math.sqrt(discriminant) - closing)
    return select(time > 0.0, time, 0.0)


class Sight(NamedTuple):
    """The relative motion of two balls: b.u, b^2 minus its value at contact, and a fourth of the discriminant."""

    closing: Any
    gap: Any
    discriminant: Any

    def meets(self):
        """Whether the balls will touch."""
        return (self.closing < 0.0) & (self.discriminant > 0.0)


def sight(b, u, touching2):
    """Return the `Sight` of a ball at the distance vector b with the relative velocity u."""
    closing, gap = dot(b, u), square(b) - touching2
    return Sight(closing, gap, closing * closing - square(u) * gap)


def _sight_in(box, b, u, touching2, now):
    """Return the `Sight` of balls that may grow."""
    return sight(b, u, touching2) if box.growth is None else box.growth.sight(b, u, touching2, now)


@outlined
def _fall_time(b, u, pull, touching2):
    """The time in which a ball, at b with the velocity u, falls until it touches a ball at rest."""
    solid, time = ball(ZERO, math.sqrt(touching2)), 0.0
    for _part in range(_PARTS):
        free, found = solid.falling_hit(b, u, pull)
        time += free
        if found or time == math.inf:
            return time
        b, u = b + displacement(pull, u, free), accelerated(pull, u, free)
    return math.inf


def _touch_time(box, flock, pair, b, u, now):
    """The time until a pair touches; the second ball is at b from the first, with the relative velocity u."""
    i, j = pair
    touching2 = box.kinds.touching2(i, j)
    if flock.holds is not None and box.pull is not None and flock.is_held(i, now) != flock.is_held(j, now):
        # One ball falls, and the other one is an obstacle at rest.
        pull = as_vector(box.pull)
        return _fall_time(b, u, either(flock.is_held(i, now), pull, -1.0 * pull), touching2)
    seen = _sight_in(box, b, u, touching2, now)
    return meeting(*seen) if seen.meets() else math.inf


@outlined
def _meeting_of_any(box, flock, pair, way, u, now):
    """The time until a ball meets any image of another ball, where cells are few."""
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
    """Return the soonest collision of ball i: the `known` one, or one with the first `count` balls in `near`.

    A first loop, without a branch, selects the few balls that will touch it; a second one computes the roots of these.
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
    """Return the result of `_soonest` where a ball may meet several images of another one, or fall onto held balls."""
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
    """Return the `NextCollision` of ball i with the balls in the cells around its own, or only beyond a face.

    The first balls of all cells come first, then the balls linked to them in the order found: so the processor has no
    branch to predict that depends on the number of balls in a cell.
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
        # Each chain may add one more ball, and `_found` writes one more entry.
        if done == _MOST - _CELLS - 1:
            known = _looked_at(box, flock, i, now, near, done, known)
            found -= done
            for k in range(found):
                near[index(k)] = near[index(done + k)]
            done = 0
    return _looked_at(box, flock, i, now, near, found, known)


def _found(box, flock, j, near, count):
    """Write a ball behind the first `count`, and fetch its flight; return 1, or 0 for `NO_PARTNER`."""
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
    """Look for a sooner collision of a ball that has come into a cell; return whether the ball has one."""
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
    """Store the collision of a ball for its partner if it is the partner's soonest; return the partner, or none."""
    mate, time = flock.tag[index(WHOLES * i + PARTNER)], flock.event[index(FLOATS * i + MEETS)]
    partner = NO_PARTNER
    if mate >= 0 and time < flock.event[index(FLOATS * mate + MEETS)]:
        flock.event[index(FLOATS * mate + MEETS)] = time
        flock.tag[index(WHOLES * mate + PARTNER)] = i
        flock.tag[index(WHOLES * mate + SEEN)] = flock.tag[index(WHOLES * i + STAMP)]
        partner = mate
    return partner


def forget_wall(flock, i):
    """Forget the next wall of a ball."""
    flock.event[index(FLOATS * i + DUE)] = math.inf
    flock.aim_at(i, UNKNOWN)


def _given_hit(box, flock, i, now):
    """Return the next `Hit` of a ball on a wall without a mass, if its cell is near one."""
    time, wall = math.inf, UNKNOWN
    # Without walls `next_hit` is not compiled.
    if len(box.walls.each) > 0 and box.grid.near[index(box.grid.number(i, flock))]:
        time, wall = next_hit(box, flock, i, now)
    return Hit(time, wall)


@outlined
def find_wall(box, flock, i, now):
    """Find when a ball meets a wall, if its cell is near a wall and its next wall is not known."""
    if box.heavy is not None:
        # When a lease ends, this is called for all balls, also for held balls and balls outside the scene.
        if flock.wall(i) <= OUT:
            return
        meet_heavy(box, flock, i, now, _given_hit(box, flock, i, now))
    elif box.grid.near[index(box.grid.number(i, flock))] and flock.wall(i) == UNKNOWN:
        hit = next_hit(box, flock, i, now)
        flock.event[index(FLOATS * i + DUE)] = now + hit.time
        flock.aim_at(i, hit.wall)
