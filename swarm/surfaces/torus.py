"""Torus about the z axis: phi = sqrt(q) - a, the distance; inner function q = (rho - R)^2 + z^2, not a quadric.

Its discrete gradient is Gonzalez's, and what a quadric has in closed form is found by iteration; lanes with a torus
are not vectorised.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .._jit import inlined, outlined, select
from ..checks import Vector, length, vector
from ..errors import SceneError
from . import base

_EPSILON = 2.220446049250313e-16
# Steps of the march to the first hit; near the wall each one doubles the digits.
_MARCH = 1000
# Newton steps of `push` and `resolve`, and of the chord; changes below this part of a step may be noise.
_ITERATIONS = 50
_NOISE = 1e-12


@dataclass(frozen=True)
class Torus(base.Surface):
    """A ring torus about the z axis; the cavity in the tube or the space around the solid.

    Args:
        major_radius: R [m], from the axis to the middle of the tube.
        minor_radius: a [m], of the tube, 0 < a < R.
        center: three numbers [m].
        side: "inside" or "outside", the admissible part.

    Raises:
        SceneError: an argument is out of its range.

    >>> Torus(major_radius=1.0, minor_radius=0.25).phi([[1.25], [0.0], [0.0]])
    array([0.])
    """

    major_radius: float
    minor_radius: float
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"

    def __post_init__(self) -> None:
        object.__setattr__(self, "major_radius", length("major_radius", self.major_radius))
        object.__setattr__(self, "minor_radius", length("minor_radius", self.minor_radius))
        if self.minor_radius >= self.major_radius:
            raise SceneError(
                f"minor_radius must be below major_radius = {self.major_radius:g}, got {self.minor_radius:g}"
            )
        object.__setattr__(self, "center", vector("center", self.center))
        base.side_sign(self.side)

    def numbers(self) -> "TorusNumbers":
        return TorusNumbers(*self.center, self.major_radius, self.minor_radius, base.side_sign(self.side))

    def size(self) -> float:
        return self.minor_radius

    def bounds(self) -> base.Box:
        wide = self.major_radius + self.minor_radius
        return base.box_around(self.center, (wide, wide, self.minor_radius), self.side)


class TorusNumbers(NamedTuple):
    """What kernels know of a torus."""

    cx: float
    cy: float
    cz: float
    major: float
    minor: float
    side: float


@inlined
def _from_axis(surface, x, y):
    """rho, never 0: on the axis the direction to the tube is not defined."""
    dx, dy = x - surface.cx, y - surface.cy
    return np.maximum(np.sqrt(dx * dx + dy * dy), np.finfo(np.float64).tiny)


@inlined
def _slope(surface, x, y, z):
    """grad q"""
    f = 2.0 - 2.0 * surface.major / _from_axis(surface, x, y)
    return f * (x - surface.cx), f * (y - surface.cy), 2.0 * (z - surface.cz)


# --- The level set ---------------------------------------------------------------------------------------


@base.phi.register(TorusNumbers)
def _(surface, x, y, z):
    return np.sqrt(base.inner(surface, x, y, z)) - surface.minor


@base.gradient.register(TorusNumbers)
def _(surface, x, y, z):
    # In the middle of the tube, where the distance has no gradient, the answer is 0.
    gx, gy, gz = _slope(surface, x, y, z)
    half = 0.5 / np.maximum(np.sqrt(base.inner(surface, x, y, z)), np.finfo(np.float64).tiny)
    return half * gx, half * gy, half * gz


# --- Flight ----------------------------------------------------------------------------------------------


@base.first_hit.register(TorusNumbers)
def _(surface, x, y, z, vx, vy, vz):
    return _march(surface, x, y, z, vx, vy, vz)


@outlined
def _march(surface, x, y, z, vx, vy, vz):
    """Safe steps to the first root of g(r + v t); infinite where there is none."""
    a = vx * vx + vy * vy + vz * vz
    speed = math.sqrt(a)
    # Angular momentum about the axis; along a straight flight rho'' = spin^2/rho^3 >= 0.
    spin = (x - surface.cx) * vy - (y - surface.cy) * vx
    wide = surface.major + surface.minor
    t = 0.0
    for i in range(_MARCH):
        px, py, pz = x + t * vx, y + t * vy, z + t * vz
        gx, gy, gz = _slope(surface, px, py, pz)
        c = base.inner(surface, px, py, pz) - surface.minor * surface.minor
        b = 0.5 * (gx * vx + gy * vy + gz * vz)
        if surface.side > 0.0:
            # q'' = 2 |v|^2 - 2 R rho'' <= 2 |v|^2: the root of c + 2 b s + a s^2 never oversteps.
            step = base.rise_time(c, b, a)
        else:
            dx, dy, dz = px - surface.cx, py - surface.cy, pz - surface.cz
            away = dx * vx + dy * vy + dz * vz >= 0.0
            if speed == 0.0 or (away and dx * dx + dy * dy + dz * dz > wide * wide):
                return math.inf
            # For half the way to the axis -q'' <= 2 R spin^2/(rho/2)^3 - 2 |v|^2; and phi is a distance.
            rho = _from_axis(surface, px, py)
            step = base.rise_time(-c, -b, 8.0 * surface.major * spin * spin / (rho * rho * rho) - a)
            step = min(step, 0.5 * rho / speed)
            step = max(step, (math.sqrt(c + surface.minor * surface.minor) - surface.minor) / speed)
        if not step < math.inf:
            return math.inf
        t += step
        # At t = 0 the sign of the approach decides, which rise_time has seen to.
        if (i > 0 or step == 0.0) and step * speed <= 2.0 * _EPSILON * wide:
            return t
    return t


@base.safe_time.register(TorusNumbers)
def _(surface, x, y, z, vx, vy, vz, gx, gy, gz):
    # phi is a distance: |v| t + |G| t^2/2 <= -g
    depth = -base.gap_of(surface, base.inner(surface, x, y, z))
    speed2, pull = vx * vx + vy * vy + vz * vz, math.sqrt(gx * gx + gy * gy + gz * gz)
    root = math.sqrt(speed2) + math.sqrt(speed2 + 2.0 * pull * select(depth > 0.0, depth, 0.0))
    return select(depth > 0.0, 2.0 * depth / root, 0.0)


# --- Contact ---------------------------------------------------------------------------------------------


@base.unit_normal.register(TorusNumbers)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    return surface.side * gx, surface.side * gy, surface.side * gz


@base.inner.register(TorusNumbers)
def _(surface, x, y, z):
    across, dz = _from_axis(surface, x, y) - surface.major, z - surface.cz
    return across * across + dz * dz


@base.gap_of.register(TorusNumbers)
def _(surface, q):
    return surface.side * (math.sqrt(q) - surface.minor)


@base.level_of.register(TorusNumbers)
def _(surface, q):
    return surface.side * (q - surface.minor * surface.minor)


@base.distance.register(TorusNumbers)
def _(surface, x, y, z):
    return base.gap_of(surface, base.inner(surface, x, y, z))


@base.gap_slope.register(TorusNumbers)
def _(surface, q0, q1):
    root1 = math.sqrt(q1)
    slope = 1.0 / (math.sqrt(q0) + root1)
    return surface.side * slope, -0.5 * surface.side * slope * slope / root1


@base.inner_gradient.register(TorusNumbers)
def _(surface, x0, y0, z0, x1, y1, z1):
    # Gonzalez: grad q(m) + (q1 - q0 - grad q(m).d)/|d|^2 d
    gx, gy, gz = _slope(surface, 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1))
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    d2 = dx * dx + dy * dy + dz * dz
    f = (_difference(surface, x0, y0, z0, x1, y1, z1) - gx * dx - gy * dy - gz * dz) / select(d2 > 0.0, d2, 1.0)
    return gx + f * dx, gy + f * dy, gz + f * dz


@inlined
def _difference(surface, x0, y0, z0, x1, y1, z1):
    """q1 - q0 from rho1 - rho0 and z1 - z0, without cancellation."""
    rho0, rho1 = _from_axis(surface, x0, y0), _from_axis(surface, x1, y1)
    across = (x1 - x0) * (x0 + x1 - 2.0 * surface.cx) + (y1 - y0) * (y0 + y1 - 2.0 * surface.cy)
    along = (z1 - z0) * (z0 + z1 - 2.0 * surface.cz)
    return across * (1.0 - 2.0 * surface.major / (rho0 + rho1)) + along


@base.push.register(TorusNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    dx, dy, dz = _moved(surface, x0, y0, z0, px, py, pz, kappa)
    return x0 + dx, y0 + dy, z0 + dz


@inlined
def _settled(change, previous, size):
    """Whether an iteration has reached round-off: its change is below it, or is near it and shrinks no more."""
    return change <= _EPSILON * size or (change >= previous and change <= _NOISE * size)


@inlined
def _unpushed(surface, x, y, z, strength, fx, fy, fz):
    """(I + strength H)^-1 f, H = grad grad q/2 at a point: 1 across the tube, 1 - R/rho along it."""
    rho = _from_axis(surface, x, y)
    ex, ey = -(y - surface.cy) / rho, (x - surface.cx) / rho
    w = 1.0 / (1.0 + strength)
    along = (ex * fx + ey * fy) * (1.0 / (1.0 + strength * (1.0 - surface.major / rho)) - w)
    return w * fx + along * ex, w * fy + along * ey, w * fz


@outlined
def _moved(surface, x0, y0, z0, px, py, pz, kappa):
    """r1 - r0 = p - kappa D(r0, r1) by Newton's method with the H of the midpoint; NaN where it does not converge."""
    dx, dy, dz = _unpushed(surface, x0, y0, z0, kappa, px, py, pz)
    size, previous = max(abs(px), abs(py), abs(pz)), math.inf
    for _i in range(_ITERATIONS):
        gx, gy, gz = base.inner_gradient(surface, x0, y0, z0, x0 + dx, y0 + dy, z0 + dz)
        fx, fy, fz = dx - px + kappa * gx, dy - py + kappa * gy, dz - pz + kappa * gz
        fx, fy, fz = _unpushed(surface, x0 + 0.5 * dx, y0 + 0.5 * dy, z0 + 0.5 * dz, kappa, fx, fy, fz)
        dx, dy, dz = dx - fx, dy - fy, dz - fz
        change = max(abs(fx), abs(fy), abs(fz))
        pushed = abs(kappa) * max(abs(gx), abs(gy), abs(gz))
        if _settled(change, previous, max(size, pushed)):
            return dx, dy, dz
        previous = change
    return math.nan, math.nan, math.nan


@base.resolve.register(TorusNumbers)
def _(surface, x, y, z, strength):
    return _resolved(surface, x, y, z, strength)


@outlined
def _resolved(surface, x, y, z, strength):
    sx, sy, sz = x, y, z
    size, previous = surface.major + surface.minor, math.inf
    for _i in range(_ITERATIONS):
        gx, gy, gz = _slope(surface, sx, sy, sz)
        fx, fy, fz = sx - x + strength * gx, sy - y + strength * gy, sz - z + strength * gz
        fx, fy, fz = _unpushed(surface, sx, sy, sz, 2.0 * strength, fx, fy, fz)
        sx, sy, sz = sx - fx, sy - fy, sz - fz
        change = max(abs(fx), abs(fy), abs(fz))
        if _settled(change, previous, size):
            return sx, sy, sz
        previous = change
    return math.nan, math.nan, math.nan


@base.rise.register(TorusNumbers)
def _(surface, x0, y0, z0, px, py, pz, kappa):
    dx, dy, dz = _moved(surface, x0, y0, z0, px, py, pz, kappa)
    x1, y1, z1 = x0 + dx, y0 + dy, z0 + dz
    gx, gy, gz = base.inner_gradient(surface, x0, y0, z0, x1, y1, z1)
    # dr1/dkappa = -(I + kappa H)^-1 D, H of the midpoint: the derivative is as good as the step is short.
    fx, fy, fz = _unpushed(surface, x0 + 0.5 * dx, y0 + 0.5 * dy, z0 + 0.5 * dz, kappa, gx, gy, gz)
    ex, ey, ez = _slope(surface, x1, y1, z1)
    return gx * dx + gy * dy + gz * dz, -(fx * ex + fy * ey + fz * ez)


@base.farthest_push.register(TorusNumbers)
def _(surface):
    # Where I + kappa H has its first pole: along the inner equator of a cavity, across the tube of a solid.
    return select(surface.side > 0.0, surface.major / surface.minor - 1.0, -1.0)


@base.chord_guess.register(TorusNumbers)
def _(surface, x, y, z, px, py, pz):
    return -base.chord_improve(surface, x, y, z, px, py, pz, 0.0)


@base.chord_improve.register(TorusNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    risen, slope = base.rise(surface, x, y, z, px, py, pz, kappa)
    return risen / slope


@base.chord_sweeps.register(TorusNumbers)
def _(surface):
    return _ITERATIONS


@base.chord_normal.register(TorusNumbers)
def _(surface, x, y, z, px, py, pz, kappa):
    x1, y1, z1 = base.push(surface, x, y, z, px, py, pz, kappa)
    gx, gy, gz = base.inner_gradient(surface, x, y, z, x1, y1, z1)
    k = surface.side / math.sqrt(gx * gx + gy * gy + gz * gz)
    return k * gx, k * gy, k * gz


@base.settle.register(TorusNumbers)
def _(surface, x, y, z):
    gx, gy, gz = base.gradient(surface, x, y, z)
    f = base.phi(surface, x, y, z)
    return x - f * gx, y - f * gy, z - f * gz
