"""Penalty: fixed steps with soft walls, conserving kinetic + potential + stored energy."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .. import checks
from .._jit import by_type_outlined, inlined, outlined, select
from ..contact import impulse as contact_impulse
from ..contact import regularisation as law_of
from ..contact.energy import contact_energy, energy_doubt
from ..errors import SceneError
from ..gravity import Nothing, accelerated, displacement, potential, weight
from ..particles import Particles
from ..scene import Scene
from ..status import Status
from ..surfaces import base as surfaces
from ..surfaces import chain as walls
from . import base

# A frame may miss a whole number of steps by this part of a step: decimal times are not binary ones.
_WHOLE = 1e-6
# More steps than this are not counted exactly.
_MOST_STEPS = 2.0**53
# Gauss-Seidel sweeps over the walls that hold one particle at once; a corner of 90 degrees takes three.
_SWEEPS = 500
_EPSILON = float(np.finfo(np.float64).eps)
# Units of round-off by which a contact that is solved may miss its energy.
_ROUND_OFF = 64.0 * _EPSILON


@dataclass(frozen=True)
class Penalty(base.Method):
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

    dt: float
    penalty: float
    exponent: float = 1.0
    gradient: str = "composite"

    def __post_init__(self) -> None:
        object.__setattr__(self, "dt", checks.positive("dt", self.dt))
        object.__setattr__(self, "penalty", checks.positive("penalty", self.penalty))
        object.__setattr__(self, "exponent", checks.at_least("exponent", self.exponent, 1.0))
        checks.one_of("gradient", self.gradient, ["composite"])

    def check(self, scene: Scene, particles: Particles) -> None:
        step = particles.fastest() * self.dt
        for i, surface in enumerate(scene.surfaces):
            solid = getattr(surface, "side", "inside") == "outside"
            if solid and step > 2.0 * surface.size():
                raise SceneError(
                    f"dt must be so small that no particle jumps over a solid in one step, got dt = {self.dt:g} s, in "
                    f"which the fastest flies {step:.3g} m, and surfaces[{i}], {2.0 * surface.size():.3g} m thick; use "
                    f"dt < {2.0 * surface.size() / particles.fastest():.2g} s, or Impact"
                )

    def numbers(self, scene: Scene) -> "PenaltyNumbers":
        return PenaltyNumbers(self.dt, self.law())

    def span(self, name: str, duration: float) -> float:
        if duration / self.dt > _MOST_STEPS:
            raise SceneError(
                f"{name} must be at most {_MOST_STEPS:g} steps, got {name} = {duration:g} s with dt = {self.dt:g} s"
            )
        steps = round(duration / self.dt)
        if abs(duration / self.dt - steps) > _WHOLE:
            raise SceneError(
                f"{name} must be a whole number of steps, got {name} = {duration:g} s with dt = {self.dt:g} s, "
                f"which is {duration / self.dt:.6g} steps"
            )
        return float(steps)

    def law(self) -> Any:
        return law_of.regularisation(self.penalty, self.exponent)


class PenaltyNumbers(NamedTuple):
    """What kernels know of the method."""

    dt: float
    law: Any


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(PenaltyNumbers)
def _(method, mass, energy, vx, vy, vz):
    # c = h^2/(2m) of equation (K) in contact/impulse.py, the energy per mass at the start, and nothing
    return 0.5 * method.dt * method.dt / mass, energy, 0.0


@inlined
def _restored(method, chain, gravity, x0, y0, z0, x, y, z, vx, vy, vz, c, energy):
    """Factor of v after a contact step that gives the particle its first energy back, and whether it is that near to 1.

    Each step conserves energy to round-off: V(g) feels the last bit of r, which in a stiff contact is 1e-13 of the
    energy, and over many contacts the errors add up (measured: 2e-10 after 10 000 steps at dt sqrt(alpha/m) = 100). A
    larger difference than round-off is not touched: it is an equation that was not solved.
    """
    h = method.dt
    # c = h^2/(2m)
    mass = 0.5 * h * h / c
    speed2 = vx * vx + vy * vy + vz * vz
    stored = contact_energy(method.law, chain, mass, x, y, z)
    missing = 2.0 * (energy - potential(gravity, x, y, z) - stored) - speed2
    # Where the coordinates of the step have their last bits.
    sx, sy, sz = abs(x0) + abs(x) + h * abs(vx), abs(y0) + abs(y) + h * abs(vy), abs(z0) + abs(z) + h * abs(vz)
    doubt = energy_doubt(chain, method.law, mass, x0, y0, z0, sx, sy, sz)
    doubt += energy_doubt(chain, method.law, mass, x, y, z, sx, sy, sz)
    doubt += speed2 + abs(energy) + weight(gravity, sx, sy, sz)
    balanced = abs(missing) <= _ROUND_OFF * doubt
    return 1.0 + select(balanced & (speed2 > 0.0), 0.5 * missing / speed2, 0.0), balanced


@base.flight.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2):
    # Whole steps that surely stay free. One too many by round-off starts a contact 1e-16 deep: harmless.
    steps = np.floor(walls.free_time(gravity, chain, x, y, z, vx, vy, vz) / method.dt)
    steps = select(steps < left, steps, left)
    t = steps * method.dt
    dx, dy, dz = displacement(gravity, vx, vy, vz, t)
    vx, vy, vz = accelerated(gravity, vx, vy, vz, t)
    x, y, z, left = x + dx, y + dy, z + dz, left - steps
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    surface, count = walls.touched(chain, x, y, z, px, py, pz)
    # Several walls at once: the careful way.
    surface = select(count > 1.0, base.HARD - surface, surface)
    return x, y, z, vx, vy, vz, left, select(left > 0.0, surface, -1.0)


@base.most_sweeps.register(PenaltyNumbers)
def _(method):
    return contact_impulse.NEWTON_STEPS


@base.guess.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, k0, surface):
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    kappa = contact_impulse.guess(chain, surface, method.law, x, y, z, px, py, pz, k0)
    touching = surface >= 0.0
    return select(touching, kappa, 0.0), touching


@base.improve.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, k0, surface, kappa, unsolved):
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    step, more = contact_impulse.improve(chain, surface, method.law, x, y, z, px, py, pz, k0, kappa)
    return select(unsolved, kappa - step, kappa), unsolved & more


@base.contact.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved):
    # One step, free or in contact with one wall: r1 = r0 + p - kappa D(r0, r1)
    h = method.dt
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    touching = surface >= 0.0
    bx, by, bz = walls.push(chain, surface, x, y, z, px, py, pz, kappa)
    x1, y1, z1 = select(touching, bx, x + px), select(touching, by, y + py), select(touching, bz, z + pz)
    # v1 = v0 + h G - (2 kappa/h) D; the equal 2 (r1 - r0)/h - v0 cancels
    gx, gy, gz = walls.inner_gradient(chain, surface, x, y, z, x1, y1, z1)
    f = select(touching, 2.0 * kappa / h, 0.0)
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    wx, wy, wz = wx - f * gx, wy - f * gy, wz - f * gz

    # A push into another wall, or an equation that is not solved yet: the careful way.
    factor, balanced = _restored(method, chain, gravity, x, y, z, x1, y1, z1, wx, wy, wz, k0, k1)
    solved = balanced & (not unsolved) & walls.pushes(chain, surface, kappa)
    solved = solved & (not walls.outside(chain, surface, x1, y1, z1))
    step = (left > 0.0) & select(touching, solved, surface > base.HARD)
    e = select(touching, factor, 1.0)
    new = step & touching & (not walls.outside(chain, -1.0, x, y, z))
    return (
        select(step, x1, x),
        select(step, y1, y),
        select(step, z1, z),
        select(step, wx * e, vx),
        select(step, wy * e, vy),
        select(step, wz * e, vz),
        left - select(step, 1.0, 0.0),
        select(touching & (not solved), base.HARD - surface, surface),
        select(step, abs(f) * math.sqrt(gx * gx + gy * gy + gz * gz), 0.0),
        select(new, 1.0, 0.0),
    )


# --- Several walls at once -------------------------------------------------------------------------------


@outlined
def _reaction(surface, x0, y0, z0, x1, y1, z1, kappa):
    """kappa D(r0, r1) of one surface."""
    gx, gy, gz = surfaces.inner_gradient(surface, x0, y0, z0, x1, y1, z1)
    return kappa * gx, kappa * gy, kappa * gz


@by_type_outlined
def _reactions(chain, kappas, k, x0, y0, z0, x1, y1, z1):
    """The sum of kappa D over all surfaces."""
    raise NotImplementedError


@_reactions.register(walls.Chain)
def _(chain, kappas, k, x0, y0, z0, x1, y1, z1):
    ax, ay, az = _reaction(chain.first, x0, y0, z0, x1, y1, z1, kappas[k])
    bx, by, bz = _reactions(chain.rest, kappas, k + 1, x0, y0, z0, x1, y1, z1)
    return ax + bx, ay + by, az + bz


@_reactions.register(Nothing)
def _(chain, kappas, k, x0, y0, z0, x1, y1, z1):
    return 0.0, 0.0, 0.0


@by_type_outlined
def _sweep(chain, law, kappas, k, x0, y0, z0, px, py, pz, c, x1, y1, z1, whole, ok):
    """One Gauss-Seidel sweep: each wall is solved with the reactions of the others held. (r1, solved)"""
    raise NotImplementedError


@_sweep.register(walls.Chain)
def _(chain, law, kappas, k, x0, y0, z0, px, py, pz, c, x1, y1, z1, whole, ok):
    sx, sy, sz = _reactions(whole, kappas, 0, x0, y0, z0, x1, y1, z1)
    ax, ay, az = _reaction(chain.first, x0, y0, z0, x1, y1, z1, kappas[k])
    qx, qy, qz = px - (sx - ax), py - (sy - ay), pz - (sz - az)
    kappa, solved = contact_impulse.careful(law, chain.first, x0, y0, z0, qx, qy, qz, c)
    kappas[k] = kappa
    x1, y1, z1 = surfaces.push(chain.first, x0, y0, z0, qx, qy, qz, kappa)
    return _sweep(chain.rest, law, kappas, k + 1, x0, y0, z0, px, py, pz, c, x1, y1, z1, whole, ok and solved)


@_sweep.register(Nothing)
def _(chain, law, kappas, k, x0, y0, z0, px, py, pz, c, x1, y1, z1, whole, ok):
    return x1, y1, z1, ok


@by_type_outlined
def _add_impulses(chain, kappas, k, f, x0, y0, z0, x1, y1, z1, impulse, lane):
    """Add |2 kappa/h D| of each surface to its row."""
    raise NotImplementedError


@_add_impulses.register(walls.Chain)
def _(chain, kappas, k, f, x0, y0, z0, x1, y1, z1, impulse, lane):
    ax, ay, az = _reaction(chain.first, x0, y0, z0, x1, y1, z1, f * kappas[k])
    impulse[k, lane] += math.sqrt(ax * ax + ay * ay + az * az)
    _add_impulses(chain.rest, kappas, k + 1, f, x0, y0, z0, x1, y1, z1, impulse, lane)


@_add_impulses.register(Nothing)
def _(chain, kappas, k, f, x0, y0, z0, x1, y1, z1, impulse, lane):
    pass


@base.hard_pass.register(PenaltyNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, lane):
    h = method.dt
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    kappas = np.zeros(walls.length(chain))
    x1, y1, z1 = x + px, y + py, z + pz
    solved = False
    for _i in range(_SWEEPS):
        ox, oy, oz = x1, y1, z1
        x1, y1, z1, ok = _sweep(chain, method.law, kappas, 0, x, y, z, px, py, pz, k0, x1, y1, z1, chain, True)
        change = max(abs(x1 - ox), abs(y1 - oy), abs(z1 - oz))
        size = max(abs(x1), abs(y1), abs(z1), abs(px), abs(py), abs(pz))
        if ok and change <= 4.0 * _EPSILON * size:
            solved = True
            break
    sx, sy, sz = _reactions(chain, kappas, 0, x, y, z, x1, y1, z1)
    f = 2.0 / h
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    _add_impulses(chain, kappas, 0, f, x, y, z, x1, y1, z1, impulse, lane)
    new = 0.0 if walls.outside(chain, -1.0, x, y, z) else 1.0
    wx, wy, wz = wx - f * sx, wy - f * sy, wz - f * sz
    e, balanced = _restored(method, chain, gravity, x, y, z, x1, y1, z1, wx, wy, wz, k0, k1)
    status = Status.DONE.value if solved and balanced else Status.UNSOLVED.value
    return x1, y1, z1, wx * e, wy * e, wz * e, left - 1.0, new, status
