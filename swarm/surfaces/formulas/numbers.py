"""A surface by functions as kernels take it: its flights by safe steps. Its subclasses give phi and gradient."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.record import Record
from ...kernel.vector import Symmetric, Vec, absolute, dot, largest, square, total
from .. import contract
from ..time_of_impact.course import positive, rise_time
from ..time_of_impact.march import LOOKS

# Points this close, relative to the size, are joined by Gauss's rule, with an error of the 7th power; its outer node.
_SHORT = 1e-2
_NODE = 0.5 * math.sqrt(0.6)


class Bend(NamedTuple):
    """Bounds of side H, H = grad grad phi/2: of its eigenvalues, and of its entries."""

    least: float
    most: float
    low: Symmetric
    high: Symmetric

    @classmethod
    def of_magnitude(cls, curvature: float) -> "Bend":
        """|w.H w| <= curvature/2 for every unit vector w."""
        k = 0.5 * curvature
        return cls(-k, k, Symmetric(-k, -k, -k, 0.0, 0.0, 0.0), Symmetric(k, k, k, 0.0, 0.0, 0.0))

    @classmethod
    def of_entries(cls, low: Any, high: Any) -> "Bend":
        """From bounds of the entries in each of many cells, (6, cells)."""
        matrix = [0, 3, 5, 3, 1, 4, 5, 4, 2]
        middle, radius = (part[matrix].T.reshape(-1, 3, 3) for part in (0.5 * (low + high), 0.5 * (high - low)))
        # |lambda(A + E) - lambda(A)| <= |E|, the largest sum of a row; and the round-off of lambda(A)
        values = np.linalg.eigvalsh(middle)
        room = radius.sum(axis=2).max(axis=1) + 64.0 * EPSILON * np.abs(values).max(axis=1)
        least, most = float((values[:, 0] - room).min()), float((values[:, 2] + room).max())
        return cls(least, most, Symmetric(*low.min(axis=1).tolist()), Symmetric(*high.max(axis=1).tolist()))


def _quadratic(v, high, low):
    """The upper bound of v.H v for entries of H from `low` to `high`; the lower bound with the two exchanged."""
    xy, yz, zx = 2.0 * v.x * v.y, 2.0 * v.y * v.z, 2.0 * v.z * v.x
    sum = high.xx * v.x * v.x + high.yy * v.y * v.y + high.zz * v.z * v.z
    sum += select(xy > 0.0, high.xy, low.xy) * xy
    return sum + select(yz > 0.0, high.yz, low.yz) * yz + select(zx > 0.0, high.zx, low.zx) * zx


def _larger(a, b):
    return select(a > b, a, b)


def _between(low, high, x, v):
    """When a flight is between two planes: (from, until)."""
    still, within = v == 0.0, (low <= x) & (x <= high)
    speed = select(still, 1.0, v)
    a, b = (low - x) / speed, (high - x) / speed
    before, after = select(a < b, a, b), select(a < b, b, a)
    always = select(within, math.inf, -math.inf)
    return select(still, -always, before), select(still, always, after)


class OwnNumbers(contract.Smooth):
    """The numbers of a surface by functions. The box is relative to the center."""

    # Functions of users may: their last bit may differ between plain Python and compiled kernels.
    calls_library = True

    center: Vec
    side: float
    step: float  # of the differences that replace second derivatives
    size: float
    bends: Bend
    low: Vec
    high: Vec
    # 1 if there is surely no wall outside the box, and how far outside of it the bend is known
    closed: float
    margin: float
    parameters: Any

    def hessian(self, r):
        h = self.step
        a = self.gradient(Vec(r.x + h, r.y, r.z))
        b = self.gradient(Vec(r.x - h, r.y, r.z))
        c = self.gradient(Vec(r.x, r.y + h, r.z))
        d = self.gradient(Vec(r.x, r.y - h, r.z))
        e = self.gradient(Vec(r.x, r.y, r.z + h))
        f = self.gradient(Vec(r.x, r.y, r.z - h))
        # Made symmetric
        k = 0.25 / h
        xy, yz, zx = a.y - b.y + c.x - d.x, c.z - d.z + e.y - f.y, e.x - f.x + a.z - b.z
        return Symmetric(k * (a.x - b.x), k * (c.y - d.y), k * (e.z - f.z), 0.5 * k * xy, 0.5 * k * yz, 0.5 * k * zx)

    def difference(self, r0, r1):
        d = r1 - r0
        if largest(d) > _SHORT * self.size:
            return self.phi(r1) - self.phi(r0)
        # Of close points the difference of phi has few digits: the integral of grad phi.d, by Gauss's rule of three
        # points
        m, e = 0.5 * (r0 + r1), _NODE * d
        outer = self.gradient(m - e) + self.gradient(m + e)
        return dot(5.0 * outer + 8.0 * self.gradient(m), d) / 18.0

    def farthest_push(self):
        # 1 + kappa H has its first pole at the least eigenvalue of side H.
        least = self.bends.least
        return self.side * (-1.0 / least if least < 0.0 else math.inf)

    def hessian_bounds(self, r):
        # Around a solid the bend is known up to the margin; half way there `clearance` takes over.
        most, magnitude = self.bends.most, max(abs(self.bends.least), abs(self.bends.most))
        if self.closed == 0.0:
            return most, magnitude, self.size
        out = self._outside(r)
        return most, magnitude, select(out > 0.5 * self.margin, out, min(self.margin - out, self.size))

    def clearance(self, r):
        return select(self.closed > 0.0, max(self._outside(r), 0.0), 0.0)

    def _outside(self, r):
        """The distance outside the box, by its largest component; below 0 inside."""
        d = r - self.center
        across = max(self.low.x - d.x, d.x - self.high.x)
        across = max(across, self.low.y - d.y, d.y - self.high.y)
        return max(across, self.low.z - d.z, d.z - self.high.z)

    @outlined
    def first_hit(self, r, v):
        t, end = 0.0, math.inf
        speed2 = square(v)
        if speed2 == 0.0:
            return math.inf, True
        if self.closed > 0.0:
            t, end = self._in_box(r, v)
            if not t <= end:
                return math.inf, True
        bend = self.bends
        # least <= v.side H v <= most
        most = min(_quadratic(v, bend.high, bend.low), bend.most * speed2)
        least = max(_quadratic(v, bend.low, bend.high), bend.least * speed2)
        flight = Straight(self, r, v, t, end, least, most, math.sqrt(speed2))
        known = flight.first()
        for _look in range(LOOKS):
            if not known.goes_on:
                break
            known = flight.look(known)
        return known.free, not known.goes_on

    def _in_box(self, r, v):
        """When a straight flight is in the box of a solid: (from, until), the first after the second if never."""
        d, low, high = r - self.center, self.low, self.high
        from_x, until_x = _between(low.x, high.x, d.x, v.x)
        from_y, until_y = _between(low.y, high.y, d.y, v.y)
        from_z, until_z = _between(low.z, high.z, d.z, v.z)
        start = positive(_larger(from_x, _larger(from_y, from_z)))
        return start, -_larger(-until_x, _larger(-until_y, -until_z))


class Looked(Record):
    """What looks at a flight have found of its first hit so far."""

    free: Any  # a time until which it surely meets nothing; that of the hit once there are no more looks
    at: Any  # the time of the next look
    goes_on: Any  # whether there is a next look
    # The time of the last look, that of the next one before the first, and what it has found
    before: Any
    level: Any
    half: Any


class Straight(Record):
    """A straight flight from its `start` to its end: its level's second derivative has the same bounds everywhere.

    A safe step ends where the highest parabola that the bounds allow rises through 0. Where even the lowest one does,
    the level rises all the way from the first root to there: it has no other root, and nothing is left to be proven.
    Looks then go to the root from both sides, by the cubic through the last two of them.
    """

    surface: "OwnNumbers"
    r: Vec
    v: Vec
    start: Any
    end: Any
    least: Any
    most: Any
    speed: Any

    def first(self):
        goes_on = self.start <= self.end
        return Looked(select(goes_on, self.start, math.inf), self.start, goes_on, self.start, 0.0, 0.0)

    def look(self, known):
        """What is known after one look more."""
        surface, t, is_first = self.surface, known.at, known.at == known.before
        p = self.r + t * self.v
        level = surface.side * surface.phi(p)
        half = 0.5 * surface.side * dot(surface.gradient(p), self.v)
        # Past the root, or past the wall by round-off or because the surface bends more than was said
        past = (level > 0.0) & (half > 0.0) & (not is_first)
        one_root = rise_time(level, half, self.least)
        one_root = (one_root < math.inf) & (t + one_root <= self.end)
        bend = select(one_root | past, self._bend(known, level, half, is_first), self.most)
        bottom = half + math.sqrt(positive(half * half - bend * level))
        step = select(past, level / select(past, bottom, 1.0), rise_time(level, half, bend))
        is_free = (not past) & (not t + step <= self.end)
        # What is left of the level after the step is at most (most - least) step^2, the rise there at least this.
        way = select(is_free, 0.0, step)
        rising = half + way * select(past, -self.most, self.least)
        shortest = 2.0 * EPSILON / self.speed * (total(absolute(p)) + self.speed * way)
        arrives = (not is_first) | (rising > 0.0) | (way == 0.0)
        arrives &= (way <= shortest) | ((self.most - self.least) * way * way <= 2.0 * shortest * rising)
        free, after = select(past, known.free, t), select(past, t - way, t + way)
        # A level that bends more than was said has its root anywhere between.
        after = select(past & (not after > free), 0.5 * (free + t), after)
        arrives |= past & (not after > free)
        goes_on = (not is_free) & (not arrives)
        found = select(is_free, math.inf, select(arrives, after, free))
        return Looked(found, after, goes_on, t, level, half)

    def _bend(self, known, level, half, is_first):
        """Half the second derivative, by the cubic through the last look and this one; at the first the middle."""
        since = select(is_first, 1.0, known.at - known.before)
        bend = (3.0 * (known.level - level) / since + 2.0 * known.half + 4.0 * half) / since
        bend = select(is_first, 0.5 * (self.least + self.most), bend)
        return select(bend > self.least, select(bend < self.most, bend, self.most), self.least)
