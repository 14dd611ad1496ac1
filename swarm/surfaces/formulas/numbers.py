"""The numbers of a surface by functions: its flights by safe steps. Its subclasses give phi and gradient."""

import math
from typing import Any, NamedTuple

import numpy as np

from ...kernel.gravity import as_vector, rise_time
from ...kernel.jit import outlined, select
from ...kernel.limits import EPSILON
from ...kernel.vector import Symmetric, Vec, absolute, dot, largest, square, total
from .. import contract
from ..curvature import matrices_of
from ..time_of_impact.course import Majorant, positive
from ..time_of_impact.looks import FallByLooks, FallToBox, Straight, falling, first_found

# Points this close, relative to the size, are joined by Gauss's rule, with an error of the 7th power; its outer node
_SHORT = 1e-2
_NODE = 0.5 * math.sqrt(0.6)
_ONE = np.float64(1.0)


class Bend(NamedTuple):
    """Bounds of side H, H = grad grad phi/2: of its eigenvalues, and of its entries.

    `third` bounds the third derivative of phi in any direction; it is infinite where no bound is known.
    """

    least: float
    most: float
    low: Symmetric
    high: Symmetric
    third: float = math.inf

    @classmethod
    def of_magnitude(cls, curvature: float) -> "Bend":
        """Return the bend with |w.H w| <= curvature/2 for every unit vector w."""
        k = 0.5 * curvature
        return cls(-k, k, Symmetric(-k, -k, -k, 0.0, 0.0, 0.0), Symmetric(k, k, k, 0.0, 0.0, 0.0))

    @classmethod
    def of_entries(cls, low: Any, high: Any) -> "Bend":
        """Return the bend from bounds of the entries in each of many cells, (6, cells)."""
        middle, radius = map(matrices_of, (0.5 * (low + high), 0.5 * (high - low)))
        # |lambda(A + E) - lambda(A)| <= |E|, the largest sum of a row; and the round-off of lambda(A)
        values = np.linalg.eigvalsh(middle)
        room = radius.sum(axis=2).max(axis=1) + 64.0 * EPSILON * np.abs(values).max(axis=1)
        least, most = float((values[:, 0] - room).min()), float((values[:, 2] + room).max())
        return cls(least, most, Symmetric(*low.min(axis=1).tolist()), Symmetric(*high.max(axis=1).tolist()))


def _quadratic(v, high, low):
    """Return the upper bound of v.H v for entries of H from `low` to `high`; exchange the two for the lower bound."""
    xy, yz, zx = 2.0 * v.x * v.y, 2.0 * v.y * v.z, 2.0 * v.z * v.x
    sum = high.xx * v.x * v.x + high.yy * v.y * v.y + high.zz * v.z * v.z
    sum += select(xy > 0.0, high.xy, low.xy) * xy
    return sum + select(yz > 0.0, high.yz, low.yz) * yz + select(zx > 0.0, high.zx, low.zx) * zx


def _larger(a, b):
    return select(a > b, a, b)


def _between(low, high, x, v):
    """Return when a flight is between two planes: (from, until)."""
    still, within = v == 0.0, (low <= x) & (x <= high)
    speed = select(still, 1.0, v)
    a, b = (low - x) / speed, (high - x) / speed
    before, after = select(a < b, a, b), select(a < b, b, a)
    always = select(within, math.inf, -math.inf)
    return select(still, -always, before), select(still, always, after)


class _Face(Majorant):
    """The distance of a fall from a face of a box, c + 2 b t + a2 t^2, below 0 beyond it, and when it arrives."""

    c: float
    b: float
    a2: float
    time: float


def _face(low, high, x, v, pull):
    """Return the face beyond which a coordinate is, or any face if it is beyond none."""
    below = x - low < high - x
    # Floats of NumPy: in plain Python only their quotients by 0 are infinite
    sign = select(below, _ONE, -_ONE)
    c, b, a2 = select(below, x - low, high - x), 0.5 * sign * v, 0.5 * sign * pull
    return _Face(c, b, a2, select(c < 0.0, rise_time(c, b, a2), 0.0))


def _later(one, other):
    """Return the face that a fall reaches later."""
    later = one.time >= other.time
    return _Face(*(select(later, a, b) for a, b in zip(one, other, strict=True)))


class OwnNumbers(contract.Smooth):
    """The numbers of a surface by functions. The box is relative to the center."""

    # A user's functions may call it: their last bit may differ between plain Python and compiled kernels.
    calls_library = True

    center: Vec
    side: float
    step: float  # the step of the differences that replace second derivatives
    size: float
    bends: Bend
    low: Vec
    high: Vec
    closed: float  # 1 where there is surely no wall outside the box, else 0
    margin: float  # how far outside of the box the bounds of the bend hold
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

    def bent_along(self, r, w):
        """Return w.side H w at a place."""
        h = self.hessian(r)
        return self.side * _quadratic(w, h, h)

    def difference(self, r0, r1):
        d = r1 - r0
        if largest(d) > _SHORT * self.size:
            return self.phi(r1) - self.phi(r0)
        # At close points the difference of phi has few digits, and the integral of grad phi.d has all of them: Gauss's
        # rule of three points
        m, e = 0.5 * (r0 + r1), _NODE * d
        outer = self.gradient(m - e) + self.gradient(m + e)
        return dot(5.0 * outer + 8.0 * self.gradient(m), d) / 18.0

    def farthest_push(self):
        # 1 + kappa H has its first pole at the least eigenvalue of side H.
        least = self.bends.least
        return self.side * (-1.0 / least if least < 0.0 else math.inf)

    def hessian_bounds(self, r):
        # Around a solid the bend is known up to the margin; from half of it on `clearance` is used instead.
        most, magnitude = self.bends.most, max(abs(self.bends.least), abs(self.bends.most))
        if self.closed == 0.0:
            return most, magnitude, self.size
        out = self._outside(r)
        return most, magnitude, select(out > 0.5 * self.margin, out, min(self.known_around(r), self.size))

    def clearance(self, r):
        return select(self.closed > 0.0, max(self._outside(r), 0.0), 0.0)

    def _outside(self, r):
        """Return the distance outside the box, by its largest component; below 0 inside."""
        d = r - self.center
        low, high = self.low - d, d - self.high
        across = _larger(_larger(low.x, high.x), _larger(low.y, high.y))
        return _larger(across, _larger(low.z, high.z))

    def known_around(self, r):
        """How far around a place the bend of a solid is surely known; below 0 where it is not known at the place."""
        return self.margin - self._outside(r)

    def last_face(self, r, v, pull):
        """Return (the face of the box that a fall reaches last, whether the fall begins beyond it)."""
        d, low, high = r - self.center, self.low, self.high
        coordinates = total(absolute(r)) + total(absolute(self.center))
        face = _later(_face(low.x, high.x, d.x, v.x, pull.x), _face(low.y, high.y, d.y, v.y, pull.y))
        face = _later(face, _face(low.z, high.z, d.z, v.z, pull.z))
        return face, face.c < -4.0 * EPSILON * coordinates

    @outlined
    def first_hit(self, r, v):
        return first_found(self.straight(r, v))

    def straight(self, r, v):
        """Return the `Straight` of a flight."""
        bend, speed2 = self.bends, square(v)
        start, end = self.span(r, v)
        # least <= v.side H v <= most
        most = -_larger(-_quadratic(v, bend.high, bend.low), -bend.most * speed2)
        least = _larger(_quadratic(v, bend.low, bend.high), bend.least * speed2)
        return Straight(self, r, v, start, end, least, most)

    def span(self, r, v):
        """When a straight flight may meet the wall: (from, until), the first after the second if never."""
        return self._in_box(r, v) if self.closed > 0.0 else (0.0, math.inf)

    def _in_box(self, r, v):
        """When a straight flight is in the box of a solid: (from, until), the first after the second if never."""
        d, low, high = r - self.center, self.low, self.high
        from_x, until_x = _between(low.x, high.x, d.x, v.x)
        from_y, until_y = _between(low.y, high.y, d.y, v.y)
        from_z, until_z = _between(low.z, high.z, d.z, v.z)
        start = positive(_larger(from_x, _larger(from_y, from_z)))
        return start, -_larger(-until_x, _larger(-until_y, -until_z))


class SmoothCavity(OwnNumbers):
    """The cavity of a formula that is no polynomial of degree 4 or less: its flights are searched by looks in lanes."""

    in_steps = True
    looked_at = True
    falls = FallByLooks

    def steps(self, gravity, r, v):
        return self.straight(r, v) if gravity is None else falling(self, as_vector(gravity), r, v)

    @outlined
    def falling_hit(self, r, v, pull):
        return first_found(falling(self, pull, r, v), self.falling_looks)

    def span(self, r, v):
        return 0.0, math.inf


class SmoothSolid(SmoothCavity):
    """The solid of a formula that is no polynomial of degree 4 or less."""

    falls = FallToBox

    def span(self, r, v):
        return self._in_box(r, v)
