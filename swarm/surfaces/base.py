"""What a surface is: a description for people, a tuple of numbers for kernels, and the functions of that tuple.

A surface is an implicit function phi(r): below 0 inside, 0 on it, above 0 outside. `side` says which part
is admissible, as a sign in the numbers: +1 for a cavity (phi <= 0), -1 for a solid (phi >= 0). The *gap* is
g = side * phi, admissible where g <= 0.

phi is a function of a smooth inner function q(r), phi = phi(q(r)). A divided difference times a discrete gradient of
q is then a discrete gradient of anything built on phi (the composite gradient), even where the penalty has a corner.
The functions below are what flights, contact and drawing need; a further surface is one more file that registers them.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._jit import by_type, inlined, select
from ..checks import Vector, array, one_of
from ..errors import SceneError

SIDES = {"inside": 1.0, "outside": -1.0}

Box = tuple[Vector, Vector]
UNBOUNDED: Box = ((-math.inf,) * 3, (math.inf,) * 3)


@dataclass(frozen=True)
class Surface:
    """A rigid surface. See the subclasses for their arguments."""

    def numbers(self) -> Any:
        """The NamedTuple of numbers that kernels take in place of this description."""
        raise NotImplementedError

    def size(self) -> float:
        """The characteristic length of the surface [m], infinite where it has none."""
        raise NotImplementedError

    def bounds(self) -> Box:
        """A box (lower, upper) that holds the admissible side; infinite where that side is open."""
        raise NotImplementedError

    def phi(self, points: ArrayLike) -> NDArray[np.float64]:
        """The implicit function at points (3, N): below 0 inside, 0 on the surface, above 0 outside; shape (N,)."""
        return np.asarray(phi(self.numbers(), *_rows(points)))

    def gradient(self, points: ArrayLike) -> NDArray[np.float64]:
        """Gradient of phi at points (3, N); shape (3, N)."""
        rows = _rows(points)
        return np.array(np.broadcast_arrays(*gradient(self.numbers(), *rows), rows[0])[:3])


def _rows(points: ArrayLike) -> NDArray[np.float64]:
    rows = array("points", points)
    if rows.ndim not in (1, 2) or rows.shape[0] != 3:
        raise SceneError(f"points must have shape (3, N), got {rows.shape}")
    return rows


def side_sign(side: str) -> float:
    """+1 for "inside", -1 for "outside"."""
    return SIDES[one_of("side", side, SIDES)]


def box_around(center: Vector, half: Vector, side: str) -> Box:
    """Bounds of the cavity of a body with these half extents; a solid bounds nothing."""
    if side == "outside":
        return UNBOUNDED
    (cx, cy, cz), (hx, hy, hz) = center, half
    return (cx - hx, cy - hy, cz - hz), (cx + hx, cy + hy, cz + hz)


# --- The level set ---------------------------------------------------------------------------------------


@by_type
def phi(surface, x, y, z):
    """The implicit function at one point (or, in Python, at arrays of points)."""
    raise NotImplementedError


@by_type
def gradient(surface, x, y, z):
    """Gradient of phi."""
    raise NotImplementedError


# --- Flight ----------------------------------------------------------------------------------------------


@by_type
def first_hit(surface, x, y, z, vx, vy, vz):
    """Time until the straight flight r + v t leaves the admissible side; infinite if it never does.

    A particle on the surface that moves inward does not hit it at time 0: the sign of the approach decides,
    not an epsilon. At a point outside by round-off the answer is 0 if the particle moves outward.
    """
    raise NotImplementedError


@by_type
def safe_time(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    """A time during which the parabola r + v t + G t^2/2 surely stays admissible: a lower bound, cheap."""
    raise NotImplementedError


# --- Contact ---------------------------------------------------------------------------------------------


@by_type
def unit_normal(surface, x, y, z):
    """Unit vector along the gradient of the gap, out of the admissible side."""
    raise NotImplementedError


@by_type
def chord_guess(surface, x, y, z, px, py, pz):
    """First guess of the kappa for which a step from r0 on the surface ends on it: r1 = r0 + p - kappa D(r0, r1).

    p is the free displacement h v0 + h^2 G/2. Exact where `chord_improve` is always 0.
    """
    raise NotImplementedError


@by_type
def chord_improve(surface, x, y, z, px, py, pz, kappa):
    """Newton step of that kappa, to be subtracted."""
    return 0.0


@by_type
def chord_sweeps(surface):
    """The most steps of `chord_improve` it takes: a constant for the compiler."""
    return 0


@by_type
def chord_normal(surface, x, y, z, px, py, pz, kappa):
    """Unit normal of that step, parallel to D(r0, r1) and out of the admissible side; for p = 0 it is `unit_normal`."""
    raise NotImplementedError


@by_type
def inner(surface, x, y, z):
    """The inner function q(r)."""
    raise NotImplementedError


@by_type
def gap_of(surface, q):
    """The signed gap g as a function of q."""
    raise NotImplementedError


@by_type
def level_of(surface, q):
    """A number of the same sign as the gap, for decisions; cheaper where the gap takes a square root."""
    raise NotImplementedError


@by_type
def distance(surface, x, y, z):
    """Signed distance outside, to first order: g/|grad g|."""
    gx, gy, gz = gradient(surface, x, y, z)
    return gap_of(surface, inner(surface, x, y, z)) / math.sqrt(gx * gx + gy * gy + gz * gz)


@by_type
def gap_scale(surface, x, y, z):
    """How far the gap moves at most when each coordinate moves by its own size: where its last bits are."""
    gx, gy, gz = gradient(surface, x, y, z)
    return abs(gx * x) + abs(gy * y) + abs(gz * z)


@by_type
def gap_slope(surface, q0, q1):
    """Divided difference g[q0, q1] = (g1 - g0)/(q1 - q0), without cancellation, and its derivative by q1.

    The derivative must be exact: the solve stops where the square of its last Newton step is below round-off.
    """
    raise NotImplementedError


@by_type
def inner_gradient(surface, x0, y0, z0, x1, y1, z1):
    """Discrete gradient of q: D.(r1 - r0) = q1 - q0."""
    raise NotImplementedError


@by_type
def push(surface, x0, y0, z0, px, py, pz, kappa):
    """The point r1 that solves r1 = r0 + p - kappa D(r0, r1), D the discrete gradient of q."""
    raise NotImplementedError


@by_type
def resolve(surface, x, y, z, strength):
    """The point s with s + strength grad q(s) = r, for the mean-value form."""
    raise NotImplementedError


@by_type
def rise(surface, x0, y0, z0, px, py, pz, kappa):
    """q1 - q0 = D.(r1 - r0) for the r1 of `push`, without cancellation, and its derivative by kappa."""
    raise NotImplementedError


@by_type
def farthest_push(surface):
    """The kappa up to which `push` is continuous from 0 on, with the sign in which the surface pushes."""
    raise NotImplementedError


@by_type
def settle(surface, x, y, z):
    """A point within round-off of the surface, moved onto it: one Newton step along the gradient."""
    raise NotImplementedError


# --- Shared by quadrics ----------------------------------------------------------------------------------


@inlined
def rise_time(c, b, a):
    """First t >= 0 at which c + 2 b t + a t^2 rises through 0, where c <= 0 up to round-off; else infinity.

    A cavity has a > 0, a solid a < 0, a plane a = 0. Branch-free.
    """
    discriminant = b * b - a * c
    # a > 0, c > 0 by round-off at a grazing hit: the flight touches, it does not miss.
    root = math.sqrt(select(discriminant > 0.0, discriminant, 0.0))
    approaching = b > 0.0
    # The form of the root that does not cancel: -c/(b + root) when b > 0, (root - b)/a when b <= 0.
    top = select(approaching, -c, root - b)
    bottom = select(approaching, b + root, a)
    misses = (bottom <= 0.0) | ((a < 0.0) & (discriminant < 0.0))
    time = top / bottom
    return select(misses, math.inf, select(time > 0.0, time, 0.0))


@inlined
def safe_rise_time(c, b, a2, a3, a4, window):
    """A time up to `window` during which c + 2 b t + a2 t^2 + a3 t^3 + a4 t^4 surely stays <= 0.

    Over the window the last three terms are at most M t^2, M = a2 + |a3| w + max(a4, 0) w^2, so the root of
    c + 2 b t + M t^2 never oversteps.
    """
    m = a2 + abs(a3) * window + select(a4 > 0.0, a4, 0.0) * window * window
    time = rise_time(c, b, m)
    return select(c > 0.0, 0.0, select(time < window, time, window))
