"""Penalty: fixed steps with soft walls, conserving kinetic + potential + stored energy."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contact import corner
from ..contact import energy as energies
from ..contact import impulse as contact_impulse
from ..contact.discrete_gradient import form_of, nested, reaction_needs
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import scratch, select
from ..scene import Scene
from ..status import Status
from ..surfaces import chain as walls
from . import base, fixed_step


@dataclass(frozen=True)
class Penalty(fixed_step.SoftWalls):
    """Energy-conserving penalty contact with a fixed step (the paper's eq. (5), composite discrete gradient).

    (v0 + v1)/2 = (r1 - r0)/h,   m (v1 - v0) = h m G - h D alpha (Phi0 + Phi1)/2.

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: m v^2/2 - m G.r + alpha Phi^2/2 of each particle, to round-off, at any dt: a contact step counts only
    if its energy balances, and one that cannot be solved (a step longer than the cavity into several walls at once)
    ends the run with an error. Walls give way by up to |v| sqrt(m/alpha) for a = 1. Order: 2 in dt. Cost: free
    steps are jumped over in one evaluation; a contact step solves one scalar equation. Steps look at the gap at their
    ends only: a solid thinner than |v| dt is refused, but a step can miss a chord through the edge of a solid that is
    shorter than |v| dt.
    Source: García Orden & Ortega 2007, eqs. (2)-(5), with the composite discrete gradient of surfaces/base.py.

    >>> Penalty(dt=1e-3, penalty=1e4, exponent=0.5)
    Traceback (most recent call last):
    swarm.errors.SceneError: exponent must be 1 or more, got 0.5
    """

    gradient: str = "composite"

    def __post_init__(self) -> None:
        fixed_step.check_arguments(self)

    def seldom_hard(self, scene: Scene) -> bool:
        return self.gradient == "composite" and super().seldom_hard(scene)

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *fixed_step.of_steps(scene), *reaction_needs(self.gradient)

    def numbers(self, scene: Scene) -> "PenaltyNumbers":
        return PenaltyNumbers(self.dt, self.law(), form_of(self.gradient), fixed_step.longest_step(scene))


class PenaltyNumbers(NamedTuple):
    """What kernels know of the method."""

    dt: float
    law: Any
    form: Any  # of the discrete gradient
    longest: Any  # step that jumps over no solid [m], None where there is none


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(PenaltyNumbers)
def _(method, mass, energy, vx, vy, vz):
    # c = h^2/(2m) of equation (K) in contact/impulse.py, the energy per mass at the start, and nothing
    return 0.5 * method.dt * method.dt / mass, energy, 0.0


@base.flight.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, time, surface, hits):
    x, y, z, vx, vy, vz, left = fixed_step.free_steps(chain, gravity, method.dt, x, y, z, vx, vy, vz, left)
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    surface, count = walls.touched(chain, x, y, z, px, py, pz)
    # Several walls at once, or nested solves: the careful way.
    surface = select((count > 1.0) | nested(method.form), base.HARD - surface, surface)
    surface = select(fixed_step.too_fast(method.longest, px, py, pz), base.HARD, surface)
    return x, y, z, vx, vy, vz, left, select(left > 0.0, surface, -1.0)


@base.most_sweeps.register(PenaltyNumbers)
def _(method, chain):
    return contact_impulse.NEWTON_STEPS


@base.guess.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface):
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    kappa = contact_impulse.guess(chain, surface, method.law, x, y, z, px, py, pz, k0)
    touching = surface >= 0.0
    return select(touching, kappa, 0.0), touching


@base.improve.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa, unsolved, multiplier):
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    step, more, _mean, _stored, _gain = contact_impulse.improve(
        chain, surface, method.law, None, x, y, z, px, py, pz, k0, kappa
    )
    return select(unsolved, kappa - step, kappa), unsolved & more, 0.0, 0.0, 0.0


@base.contact.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned):
    # One step, free or in contact with one wall: r1 = r0 + p - kappa D(r0, r1)
    h = method.dt
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    touching = surface >= 0.0
    bx, by, bz = walls.push(chain, surface, x, y, z, px, py, pz, kappa)
    x1, y1, z1 = select(touching, bx, x + px), select(touching, by, y + py), select(touching, bz, z + pz)
    # v1 = v0 + h G - (2 kappa/h) D; the equal 2 (r1 - r0)/h - v0 cancels
    gx, gy, gz = walls.inner_gradient(chain, surface, x, y, z, x1, y1, z1)
    f = select(touching, 2.0 / h * kappa, 0.0)
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    wx, wy, wz = wx - f * gx, wy - f * gy, wz - f * gz

    # A push into another wall, or an equation that is not solved yet: the careful way.
    # k0 = h^2/(2m)
    over_mass = 2.0 / (h * h) * k0
    factor, balanced = energies.restored(
        method.law, chain, gravity, over_mass, k1, h, x, y, z, x1, y1, z1, wx, wy, wz, 0.0
    )
    solved = balanced & (not unsolved) & walls.pushes(chain, surface, kappa)
    solved = solved & (not walls.outside(chain, surface, x1, y1, z1))
    step = (left > 0.0) & select(touching, solved, surface > base.HARD)
    e = select(touching, factor, 1.0)
    new = step & touching & (not walls.outside(chain, -1.0, x, y, z))
    return (
        *fixed_step.taken(step, x, y, z, vx, vy, vz, left, x1, y1, z1, wx * e, wy * e, wz * e),
        select(touching & (not solved), base.HARD - surface, surface),
        select(step, abs(f) * math.sqrt(gx * gx + gy * gy + gz * gz), 0.0),
        select(new, 1.0, 0.0),
        k0,
    )


# --- Several walls at once -------------------------------------------------------------------------------


@base.hard_pass.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    h = method.dt
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    if fixed_step.too_fast(method.longest, px, py, pz):
        return x, y, z, vx, vy, vz, left, 0.0, k0, Status.TOO_FAST.value
    reactions = scratch((walls.length(chain), 4), np.float64)
    x1, y1, z1, solved = corner.hold(method.form, method.law, None, chain, x, y, z, px, py, pz, k0, reactions)
    corner.add_impulses(reactions, h, impulse, lane)
    rx, ry, rz = corner.total(reactions)
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    wx, wy, wz = wx - 2.0 / h * rx, wy - 2.0 / h * ry, wz - 2.0 / h * rz
    new = 0.0 if walls.outside(chain, -1.0, x, y, z) else 1.0
    over_mass = 2.0 / (h * h) * k0
    e, balanced = energies.restored(method.law, chain, gravity, over_mass, k1, h, x, y, z, x1, y1, z1, wx, wy, wz, 0.0)
    status = Status.DONE.value if solved and balanced else Status.UNSOLVED.value
    return x1, y1, z1, wx * e, wy * e, wz * e, left - 1.0, new, k0, status
