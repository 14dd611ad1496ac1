"""Ellipsoids that balls meet: phi is the distance from the parallel surface, by the foot of the normal.

With t for which x = a^2 y/(t + a^2) is on the ellipsoid, x is the foot of the normal through y, and t |y/(t + a^2)| the
signed distance. t is found from below by Newton's method for 1/|x/a| = 1, which is concave: no step is too long.
"""

import math

from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.vector import Symmetric, Vec, dot, largest, norm, square, times
from ..shapes.quadratic import ConvexQuadric
from ..time_of_impact.course import rise_time_inside
from .at_radius import AtRadius
from .by_foot import ByFoot
from .rounded import Rounded

# Newton's steps to a foot and to a hit; near both each one doubles the digits.
_SWEEPS, _STEPS = 60, 40
# The least denominator, as a part of the square of the semi-axis.
_POLE = 1e-30
# The bound of H holds up to this part of the distance that is left to the smallest radius of curvature.
_PART = 0.5


@outlined
def _foot(egg, r):
    """Return the signed distance of a point outside the ellipsoid, and the unit normal of the ellipsoid at its foot."""
    y, a2 = r - egg.center, egg.squares
    least = min(a2.x, min(a2.y, a2.z))
    size = times(a2, times(y, y))
    # Each term of |x/a|^2 is at most 1.
    t = max(math.sqrt(size.x) - a2.x, max(math.sqrt(size.y) - a2.y, math.sqrt(size.z) - a2.z))
    whole = 0.0
    for _sweep in range(_SWEEPS):
        x, z = _part(t, a2.x), _part(t, a2.z)
        w = _part(t, a2.y)
        s = size.x * x * x + size.y * w * w + size.z * z * z
        slope = size.x * x * x * x + size.y * w * w * w + size.z * z * z * z
        whole = s
        step = s * (math.sqrt(s) - 1.0) / select(slope > 0.0, slope, 1.0)
        after = t + step
        if not after > t:
            break
        t = after
    u = Vec(y.x * _part(t, a2.x), y.y * _part(t, a2.y), y.z * _part(t, a2.z))
    length = norm(u)
    # On the middle of the shortest axis, deep inside, x is beside it on both sides.
    deep = (t + least <= 4.0 * EPSILON * least) & (whole < 1.0)
    depth = -math.sqrt(t * t * square(u) + least * select(deep, 1.0 - whole, 0.0))
    return select(deep, depth, t * length), u * (1.0 / select(length > 0.0, length, 1.0))


def _part(t, a2):
    """1/(t + a^2)"""
    bottom = t + a2
    return 1.0 / select(bottom > _POLE * a2, bottom, _POLE * a2)


class EggCavity(AtRadius):
    """The places at the distance `radius` inside an ellipsoid, in its principal frame: convex, so it is left once."""

    center: Vec
    squares: Vec  # of the semi-axes
    radius: float  # of the ball
    bend: float  # the smallest radius of curvature

    side = 1.0
    leaves_once = True

    foot = _foot

    def phi(self, r):
        return self.foot(r)[0] + self.radius

    def gradient(self, r):
        return self.foot(r)[1]

    def hessian(self, r):
        # With C = 1/(t + a^2), k = n.C n and m = C n - k n: twice H is |a n| times
        # C - n C n^T - C n n^T + k n n^T + t m m^T/(1 - t k), which is 1/(R + d) across n on a sphere.
        away, n = self.foot(r)
        size = math.sqrt(dot(self.squares, times(n, n)))
        t = away * size
        c = Vec(_part(t, self.squares.x), _part(t, self.squares.y), _part(t, self.squares.z))
        cn = times(c, n)
        k = dot(n, cn)
        m, half = cn - k * n, 0.5 * size
        left = 1.0 - t * k
        share = t / select(left > 0.0, left, 1.0)

        def entry(i, j):
            return half * (k * n[i] * n[j] - n[i] * cn[j] - cn[i] * n[j] + share * m[i] * m[j])

        return Symmetric(
            entry(0, 0) + half * c.x, entry(1, 1) + half * c.y, entry(2, 2) + half * c.z,
            entry(0, 1), entry(1, 2), entry(2, 0),
        )  # fmt: skip

    def farthest_push(self):
        return math.inf

    def first_hit(self, r, v):
        return _leaving(self, r, v), True

    def falling_hit(self, r, v, pull):
        # A parabola may leave a convex volume and come back: planes at feet prove too little.
        return self.by_foot().falling_hit(r, v, pull)

    def by_foot(self):
        """Return the same wall as a wall of any smooth phi."""
        a2 = self.squares
        a = Vec(1.0 / a2.x, 1.0 / a2.y, 1.0 / a2.z)
        body = ConvexQuadric(self.center, a, None, 1.0, 1.0, 1.0)
        low, high = Vec(-math.inf, -math.inf, -math.inf), Vec(math.inf, math.inf, math.inf)
        return ByFoot(body, self.radius, largest(a), self.bend, low, high, math.inf)

    def hessian_bounds(self, r):
        # 1/(2 (R - d)) at most, with the distance d inside the ellipsoid and the radius of curvature R
        inside = max(-self.foot(r)[0], 0.0)
        room = self.bend - inside
        reach = select(room > 0.0, _PART * room, EPSILON * self.bend)
        left = select(room > 0.0, (1.0 - _PART) * room, EPSILON * self.bend)
        return 0.5 / left, 0.5 / left, reach


class EggSolid(Rounded):
    """The outside of a solid ellipsoid, in its principal frame."""

    center: Vec
    squares: Vec
    radius: float

    foot = _foot


@outlined
def _leaving(egg, r, v):
    """Return when a straight flight leaves the cavity: from the exit of the ellipsoid back to planes at the feet."""
    y, a2 = r - egg.center, egg.squares
    inverse = Vec(1.0 / a2.x, 1.0 / a2.y, 1.0 / a2.z)
    w, u = times(inverse, y), times(inverse, v)
    t = rise_time_inside(dot(w, y) - 1.0, dot(u, y), dot(u, v))
    if not t < math.inf:
        return t
    for _step in range(_STEPS):
        away, n = egg.foot(r + t * v)
        approach = dot(n, v)
        late = (away + egg.radius) / select(approach > 0.0, approach, math.inf)
        before = t - late
        if not (before < t and late > EPSILON * t):
            break
        t = before
    return select(t > 0.0, t, 0.0)
