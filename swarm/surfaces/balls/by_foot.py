"""Walls of a smooth phi that balls meet: phi is how far a ball reaches beyond its wall, by the foot of the normal.

With f = side phi, below 0 on the admissible side, let f'' be at most 2 m in any direction. A place p then gives
f(p + s) <= f(p) + grad f.s + m |s|^2, so that a ball around any centre y has no wall in it up to the root of
    f + grad f.(y - p) + m |y - p|^2 + |grad f + 2 m (y - p)| d + m d^2.
At the foot z of y, y = z - k grad f(z) and f(z) = 0. It proves that the wall is at the distance |y - z|, and that no
part of it is nearer, where 2 m k <= 1: up to |grad f|/(2 m), which is at most the radius of curvature there, and for
a quadric the smallest one. Deeper, or before a foot is found, places on the way to it give a lower bound, with k up
to 1/(2 m), as large as the least such radius. So no foot needs to be searched for: the foot that is found is nearest,
or the wall is farther than the radius of any ball.

Where the bound of f'' holds within a distance from the wall only, no place gives more than half of this distance: the
lines from places within it to the nearest point of the wall stay where the bound holds.
"""

import math
from typing import Any, NamedTuple

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON, TINY
from ...kernel.vector import ZERO, Symmetric, Vec, dot, norm, square, total
from .. import contract
from ..curvature import applied, inverse
from ..time_of_impact.course import rise_time
from .at_radius import AtRadius
from .foot_hit import first_impact, matrix

# Newton's steps to a foot; near it each one doubles the digits. The last one is shorter than this part of the distance.
_SWEEPS, _LAST = 24, 1e-8
# A step this short, as a part of the place, is round-off.
_STILL = 8.0 * EPSILON
# The part of the largest k for which the foot is known to be nearest: the matrix of a step has an inverse up to it.
_MOST = 1.0 - 1e-6
# From this number of radii on, the bound by a place is used as the distance of the wall.
_FAR = 2.0
# The bound of H holds up to this part of the distance that is left to the smallest radius of curvature.
_PART = 0.5


class Foot(NamedTuple):
    """The foot of a place: its distance, a lower bound if it is not `sure`, and the unit normal there, outwards."""

    away: Any
    normal: Vec
    place: Vec
    share: Any  # k
    sure: Any


class ByFoot(AtRadius):
    """The places at the distance `radius` within the admissible side of a wall `body`."""

    body: Any
    radius: float  # of the ball
    most: float  # m
    bend: float  # the smallest radius of curvature that is certain
    low: Vec  # corners of a box around the wall
    high: Vec
    known: float  # m is certain up to twice this distance from the wall

    side = 1.0

    @outlined
    def foot(self, r):
        """Return the `Foot` of a place, by Newton's method for r = z - k grad f(z), f(z) = 0; k is at most 1/(2 m)."""
        body, side = self.body, self.side_of_body()
        p = self.within(r)
        f, n = side * body.phi(p), side * body.gradient(p)
        beside = norm(r - p)
        away, size, first = max(_free(self, r, p, f, n), beside), norm(n), f
        # From there this way along the normal
        ahead = rise_time(f, 0.5 * size, self.most)
        ahead = select((ahead < math.inf) & (f < 0.0), ahead, -f / select(size > TINY, size, 1.0))
        z = self.within(p + (ahead / select(size > TINY, size, 1.0)) * n)
        largest = select(self.most > 0.0, 0.5 * _MOST / select(self.most > 0.0, self.most, 1.0), math.inf)
        share, sure = 0.0, False
        for sweep in range(_SWEEPS):
            f, n = side * body.phi(z), side * body.gradient(z)
            d, n2 = z - r, square(n)
            if norm(d) <= self.known:
                away = max(away, _free(self, r, z, f, n))
            if sweep == 0:
                share = min(dot(d, n) / select(n2 > TINY, n2, 1.0), largest)
            back = inverse(matrix(self, z, share))
            u, w = applied(back, d - share * n), applied(back, n)
            bottom = dot(n, w)
            after = min(share + (dot(n, u) - f) / select(abs(bottom) > TINY, bottom, 1.0), largest)
            step = (after - share) * w - u
            share = after
            to = z + step
            z = self.within(to)
            left = abs(z.x - to.x) + abs(z.y - to.y) + abs(z.z - to.z)
            short = _LAST * norm(d) + _STILL * total(Vec(abs(z.x) + abs(r.x), abs(z.y) + abs(r.y), abs(z.z) + abs(r.z)))
            if norm(step) <= short:
                sure = (left == 0.0) & (share < largest)
                break
        f, n = side * body.phi(z), side * body.gradient(z)
        size = norm(n)
        size = select(size > TINY, size, 1.0)
        here = (dot(z - r, n) - f) / size
        sure = sure & (here <= self.known)
        return Foot(select(sure, here, max(_certain(self, r, first, away), beside)), n * (1.0 / size), z, share, sure)

    def phi(self, r):
        return self.radius - self.foot(r).away

    def gradient(self, r):
        return self.foot(r).normal

    def project(self, r):
        found = self.foot(r)
        return r - (self.radius - found.away) * found.normal

    def gap_scale(self, r):
        return total(Vec(abs(r.x), abs(r.y), abs(r.z)))

    def clearance(self, r):
        near, _n = self.at_least(r)
        return select(near > _FAR * self.radius, near, self.foot(r).away) - self.radius

    def farthest_push(self):
        # Where its curvature is at most that of the ball
        return 2.0 * self.radius

    def hessian(self, r):
        # With M = I - k grad grad f a foot moves by T = M^-1 - M^-1 n n^T M^-1/(n.M^-1 n) times the move of its place.
        found = self.foot(r)
        n = found.normal
        c = inverse(matrix(self, found.place, found.share))
        w = applied(c, n)
        f, half = 1.0 / dot(n, w), 0.5 / select(found.away > 0.0, found.away, 1.0)
        return Symmetric(
            half * (c.xx - f * w.x * w.x + n.x * n.x - 1.0),
            half * (c.yy - f * w.y * w.y + n.y * n.y - 1.0),
            half * (c.zz - f * w.z * w.z + n.z * n.z - 1.0),
            half * (c.xy - f * w.x * w.y + n.x * n.y),
            half * (c.yz - f * w.y * w.z + n.y * n.z),
            half * (c.zx - f * w.z * w.x + n.z * n.x),
        )

    def hessian_bounds(self, r):
        return self._bounds(self.foot(r).away)

    def bent(self, r):
        near, n = self.at_least(r)
        if near > _FAR * self.radius:
            return contract.Bent(n, self.radius - near, 0.0, 0.0, 0.0, near - self.radius)
        found = self.foot(r)
        most, magnitude, reach = self._bounds(found.away)
        reach = select(found.sure, reach, 0.0)
        clear = found.away - self.radius
        return contract.Bent(found.normal, -clear, most, magnitude, reach, select(clear > 0.0, clear, 0.0))

    def _bounds(self, away):
        # 1/(2 (R - d)) at most, where R is the radius of curvature; where the wall bends away, -1/(2 d) at least
        room = self.bend - away
        reach = _PART * min(select(room > 0.0, room, 0.0), select(away > 0.0, away, 0.0))
        left = room - reach
        most = select(self.most > 0.0, 0.5 / select(left > 0.0, left, 1.0), 0.0)
        short = away - reach
        return most, max(most, 0.5 / select(short > 0.0, short, 1.0)), reach

    def at_least(self, r):
        """Return the bound by a place: the least distance of the wall, and the unit vector to where it may be."""
        p = self.within(r)
        side = self.side_of_body()
        f, n = side * self.body.phi(p), side * self.body.gradient(p)
        size = norm(n)
        # The nearest of all places of the box.
        near = max(_certain(self, r, f, _free(self, r, p, f, n)), norm(r - p))
        return near, n * (1.0 / select(size > TINY, size, 1.0))

    def first_hit(self, r, v):
        return first_impact(self, r, v, ZERO)

    def falling_hit(self, r, v, pull):
        return first_impact(self, r, v, pull)

    def passed(self, r, v):
        low, high, far = self.low, self.high, self.radius
        x = ((r.x > high.x + far) & (v.x >= 0.0)) | ((r.x < low.x - far) & (v.x <= 0.0))
        y = ((r.y > high.y + far) & (v.y >= 0.0)) | ((r.y < low.y - far) & (v.y <= 0.0))
        return x | y | ((r.z > high.z + far) & (v.z >= 0.0)) | ((r.z < low.z - far) & (v.z <= 0.0))

    def within(self, r):
        """Return the nearest place of the box."""
        low, high = self.low, self.high
        return Vec(_clipped(r.x, low.x, high.x), _clipped(r.y, low.y, high.y), _clipped(r.z, low.z, high.z))

    def holds(self, r):
        """Whether the wall may be at a place: the box contains the place."""
        low, high = self.low, self.high
        x, y = (r.x >= low.x) & (r.x <= high.x), (r.y >= low.y) & (r.y <= high.y)
        return x & y & (r.z >= low.z) & (r.z <= high.z)

    def side_of_body(self):
        """+1 for a cavity, -1 for a solid."""
        return self.body.side


def _clipped(x, low, high):
    return select(x < low, low, select(x > high, high, x))


def _free(wall, y, p, f, n):
    """Return the least distance of the wall from y, by f and its gradient at p."""
    e, m = y - p, wall.most
    level = f + dot(n, e) + m * square(e)
    return select(level < 0.0, rise_time(level, 0.5 * norm(n + (2.0 * m) * e), m), 0.0)


def _certain(wall, y, f, away):
    """Return the certain part of this bound, up to `known`, or where f is below 0 the bound by the body."""
    if wall.known < math.inf:
        return max(min(away, wall.known), select(f < 0.0, wall.body.clearance(y), 0.0))
    return away
