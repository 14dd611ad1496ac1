"""What a surface is: a description for people, a tuple of numbers for kernels, and the functions of that tuple.

A surface is an implicit function phi(r): below 0 inside, 0 on it, above 0 outside. `side` says which part
is admissible, as a sign in the numbers: +1 for a cavity (phi <= 0), -1 for a solid (phi >= 0). The *gap* is
g = side * phi, admissible where g <= 0.

phi is a function of a smooth inner function q(r), phi = phi(q(r)). A divided difference times a discrete gradient of
q is then a discrete gradient of anything built on phi (the composite gradient), even where the penalty has a corner.
The functions below are what flights, contact and drawing need; a further surface is one more file that registers them.
"""

import math
from dataclasses import MISSING, dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checks import Vector, array, number, one_of, vector
from ..errors import SceneError
from ..kernel.jit import by_type
from . import rotation as rotations
from .course import first_rise, safe_rise_time

SIDES = {"inside": 1.0, "outside": -1.0}

Box = tuple[Vector, Vector]
HalfSpace = tuple[Vector, float]
UNBOUNDED: Box = ((-math.inf,) * 3, (math.inf,) * 3)


@dataclass(frozen=True, repr=False)
class Surface:
    """A rigid surface. See the subclasses for their arguments; these are common to all.

    Args:
        rotation: about the centre: None, a quaternion (w, x, y, z) of any length, or {"axis": (x, y, z), "angle": rad}.
        restitution: e in [0, 1]: an impact turns the normal velocity v_n into -e v_n. 1 keeps the energy.
    """

    rotation: Any = field(default=None, kw_only=True)
    restitution: float = field(default=1.0, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", rotations.quaternion("rotation", self.rotation))
        restitution = number("restitution", self.restitution, "a number from 0 to 1")
        if not 0.0 <= restitution <= 1.0:
            raise SceneError(f"restitution must be from 0 to 1, got {restitution:g}")
        object.__setattr__(self, "restitution", restitution)
        if hasattr(self, "center"):
            object.__setattr__(self, "center", vector("center", self.center))
        side_sign(getattr(self, "side", "inside"))

    def __repr__(self) -> str:
        """The call that makes it, without what is as it is by default."""
        own = sorted(fields(self), key=lambda field: bool(field.kw_only))
        said = [f for f in own if f.default is MISSING or getattr(self, f.name) != f.default]
        return f"{type(self).__name__}({', '.join(f'{f.name}={getattr(self, f.name)!r}' for f in said)})"

    def numbers(self) -> Any:
        """The NamedTuple of numbers that kernels take in place of this description, before it is rotated."""
        raise NotImplementedError

    def walls(self) -> tuple[Any, ...]:
        """What kernels take: one tuple for a smooth surface, one for each smooth part of a cavity with edges."""
        return (rotations.rotated(self.rotation, self.numbers()),)

    def own_center(self) -> Vector:
        """The centre in the surface's own frame, which is turned about the origin."""
        return rotations.turned_back(self.rotation, self.center)  # type: ignore[attr-defined]

    def size(self) -> float:
        """The characteristic length of the surface [m], infinite where it has none."""
        raise NotImplementedError

    def bounds(self) -> Box:
        """A box (lower, upper) that holds the admissible side; infinite where that side is open."""
        raise NotImplementedError

    def half_spaces(self) -> list[HalfSpace]:
        """Half-spaces n.r <= offset that hold the admissible side, where they say more than `bounds`."""
        return []

    def open_faces(self) -> list[HalfSpace]:
        """Where the surface ends without a wall: (n, offset), beyond it is n.r > offset."""
        return []

    def is_solid(self) -> bool:
        """Whether particles are kept out of it rather than in it."""
        return getattr(self, "side", "inside") == "outside"

    def extent(self) -> float:
        """Distance from the origin within which the surface, or what is particular about it, lies [m]."""
        raise NotImplementedError

    def phi(self, points: ArrayLike) -> NDArray[np.float64]:
        """The implicit function at points (3, N): below 0 inside, 0 on the surface, above 0 outside; shape (N,)."""
        rows = _rows(points)
        # Where a formula has no value it is NaN, which is outside.
        with np.errstate(all="ignore"):
            return np.asarray(np.maximum.reduce([phi(wall, *rows) for wall in self.walls()]))

    def gradient(self, points: ArrayLike) -> NDArray[np.float64]:
        """Gradient of phi at points (3, N); shape (3, N). On an edge it is that of one of the parts."""
        rows = _rows(points)
        with np.errstate(all="ignore"):
            parts = [np.array(np.broadcast_arrays(*gradient(wall, *rows), rows[0])[:3]) for wall in self.walls()]
            largest = np.argmax([phi(wall, *rows) for wall in self.walls()], axis=0)
        return np.asarray(np.choose(largest, parts))


def _rows(points: ArrayLike) -> NDArray[np.float64]:
    rows = array("points", points)
    if rows.ndim not in (1, 2) or rows.shape[0] != 3:
        raise SceneError(f"points must have shape (3, N), got {rows.shape}")
    return rows


def side_sign(side: str) -> float:
    """+1 for "inside", -1 for "outside"."""
    return SIDES[one_of("side", side, SIDES)]


def rotated_box(rotation: Any, box: Box, center: Vector) -> Box:
    """Bounds of a box that is rotated about `center`."""
    if rotation is None or not all(map(math.isfinite, (*box[0], *box[1]))):
        return box if rotation is None else UNBOUNDED
    matrix = rotations.matrix(rotation)
    middle, half = (np.array(box[0]) + box[1]) / 2.0, (np.array(box[1]) - box[0]) / 2.0
    middle, half = center + matrix @ (middle - center), np.abs(matrix) @ half
    return tuple((middle - half).tolist()), tuple((middle + half).tolist())


def farthest(point: Vector) -> float:
    """The largest coordinate of a point."""
    return max(map(abs, point))


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
    """When the straight flight r + v t leaves the admissible side: (time, whether it does then).

    Where the second is False the flight surely stays admissible until then, and more cannot be said without more work;
    an infinite time means never. A particle on the surface that moves inward does not hit it at time 0: the sign of the
    approach decides, not an epsilon. At a point outside by round-off the time is 0 if the particle moves outward.
    """
    raise NotImplementedError


@by_type
def course(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    """The level along the parabola r + v t + G t^2/2 of a quadric: c + 2 b t + a2 t^2 + a3 t^3 + a4 t^4.

    Returns (c, b, a2, a3, a4, window), window being a time in which the flight crosses the surface's size, infinite
    where the level is a parabola; from afar both are as `level_and_window` says. Only what `is_quartic` has one.
    """
    raise NotImplementedError


@by_type
def is_quartic(surface):
    """Whether the surface has a `course`: a constant for the compiler."""
    return False


@by_type
def may_be_far(surface):
    """Whether its `course` may be one from afar: a constant for the compiler."""
    return True


@by_type
def falling_hit(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    """`first_hit` for the parabola r + v t + G t^2/2. Who gives a `course`, or a `bend` of smooth.py, has one."""
    raise NotImplementedError


@course.implies(falling_hit)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    return first_rise(may_be_far(surface), *course(surface, x, y, z, vx, vy, vz, gx, gy, gz))


@by_type
def safe_time(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    """A time during which the parabola r + v t + G t^2/2 surely stays admissible: a lower bound, cheap.

    0 says nothing: a method then takes every one of its steps. Who gives a `course`, or a `bend`, has a better one.
    """
    return 0.0


@course.implies(safe_time)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    return safe_rise_time(*course(surface, x, y, z, vx, vy, vz, gx, gy, gz))


# --- Contact ---------------------------------------------------------------------------------------------


@by_type
def flat(surface):
    """Whether the normal is the same everywhere on a wall: a constant for the compiler."""
    return False


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
    raise NotImplementedError


@by_type
def chord_sweeps(surface):
    """The most steps of `chord_improve` it takes: a constant for the compiler, 0 where the guess is exact."""
    raise NotImplementedError


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
