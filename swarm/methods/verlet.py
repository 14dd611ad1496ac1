"""Verlet: explicit steps with soft walls. It does not conserve the energy: a baseline for the charts."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..contact.force import NEEDS as FORCE_NEEDS
from ..contact.force import add_impulses, force
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import inlined, select
from ..scene import Scene
from ..status import Status
from ..surfaces import chain as walls
from . import base, fixed_step


@dataclass(frozen=True)
class Verlet(fixed_step.SoftWalls):
    """Velocity Verlet with a penalty contact: a baseline, not for results.

    r1 = r0 + h v0 + h^2/2 a0,   v1 = v0 + h (a0 + a1)/2,   a = G - V'(g) grad g/m.

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: nothing exactly; each contact with a wall of exponent 1 changes the energy by a part of about
    dt sqrt(alpha/m), whose sign depends on where in a step it begins, and beyond dt sqrt(alpha/m) = 2 it is unstable:
    the energy grows without bound. Order: 2 in dt between contacts, 1 across the corner of the force at the wall. Cost:
    free steps, which it takes exactly, are jumped over in one evaluation; two forces a contact step. Penetration:
    |v| sqrt(m/alpha), more where it is unstable.
    Source: Hairer, Lubich & Wanner, Geometric Numerical Integration, I.1.4.

    >>> Verlet(dt=0.0, penalty=1e4)
    Traceback (most recent call last):
    swarm.errors.SceneError: dt must be above 0, got 0
    """

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *fixed_step.of_steps(scene), *FORCE_NEEDS

    def numbers(self, scene: Scene) -> "VerletNumbers":
        return VerletNumbers(self.dt, self.law(), fixed_step.longest_step(scene))


class VerletNumbers(NamedTuple):
    """What kernels know of the method."""

    dt: float
    law: Any
    longest: Any  # step that jumps over no solid [m], None where there is none


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(VerletNumbers)
def _(method, mass, energy, vx, vy, vz):
    # h/(2m), and nothing
    return 0.5 * method.dt / mass, 0.0, 0.0


@base.flight.register(VerletNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, time, surface, hits):
    x, y, z, vx, vy, vz, left = fixed_step.free_steps(chain, gravity, method.dt, x, y, z, vx, vy, vz, left)
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    surface, count = walls.touched(chain, x, y, z, px, py, pz)
    # Impulses of several walls at once: one by one.
    surface = select(count > 1.0, base.HARD - surface, surface)
    surface = select(fixed_step.too_fast(method.longest, px, py, pz), base.HARD, surface)
    return x, y, z, vx, vy, vz, left, select(left > 0.0, surface, -1.0)


@base.unknown.register(VerletNumbers)
def _(method):
    return None


@inlined
def _step(method, chain, gravity, x, y, z, vx, vy, vz, k0):
    """r1, v1 and what the walls add to the velocity, h (F0 + F1)/(2m)."""
    h = method.dt
    fx, fy, fz = force(chain, method.law, x, y, z)
    dx, dy, dz = displacement(gravity, vx, vy, vz, h)
    # h^2/(2m) F0
    c = h * k0
    x1, y1, z1 = x + (dx + c * fx), y + (dy + c * fy), z + (dz + c * fz)
    gx, gy, gz = force(chain, method.law, x1, y1, z1)
    kx, ky, kz = k0 * (fx + gx), k0 * (fy + gy), k0 * (fz + gz)
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    return x1, y1, z1, wx + kx, wy + ky, wz + kz, kx, ky, kz


@base.contact.register(VerletNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned):
    x1, y1, z1, wx, wy, wz, kx, ky, kz = _step(method, chain, gravity, x, y, z, vx, vy, vz, k0)
    step = (left > 0.0) & (surface > base.HARD)
    new = step & (surface >= 0.0) & (not walls.outside(chain, -1.0, x, y, z))
    return (
        *fixed_step.taken(step, x, y, z, vx, vy, vz, left, x1, y1, z1, wx, wy, wz),
        surface,
        select(step, math.sqrt(kx * kx + ky * ky + kz * kz), 0.0),
        select(new, 1.0, 0.0),
        k0,
    )


# --- Several walls at once -------------------------------------------------------------------------------


@base.hard_pass.register(VerletNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    h = method.dt
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    if fixed_step.too_fast(method.longest, px, py, pz):
        return x, y, z, vx, vy, vz, left, 0.0, k0, Status.TOO_FAST.value
    x1, y1, z1, wx, wy, wz, _kx, _ky, _kz = _step(method, chain, gravity, x, y, z, vx, vy, vz, k0)
    add_impulses(chain, method.law, k0, 0, x, y, z, impulse, lane)
    add_impulses(chain, method.law, k0, 0, x1, y1, z1, impulse, lane)
    new = 0.0 if walls.outside(chain, -1.0, x, y, z) else 1.0
    return x1, y1, z1, wx, wy, wz, left - 1.0, new, k0, Status.DONE.value
