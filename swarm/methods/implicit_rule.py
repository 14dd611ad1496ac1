"""What the implicit baselines share: the pass of a rule that takes the force at a point it has to find.

A rule says where that point would be without walls (`reach`), and what follows from where it is (`end`).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..contact import corner, implicit
from ..kernel.gravity import displacement
from ..kernel.jit import by_type, by_type_outlined, scratch, select
from ..status import Status
from ..surfaces import chain as walls
from . import base, fixed_step


class RuleNumbers(NamedTuple):
    """What kernels know of the method."""

    dt: float
    law: Any
    longest: Any  # step that jumps over no solid [m], None where there is none
    rule: Any


@by_type
def reach(rule, h, law, chain, gravity, x, y, z, vx, vy, vz, c):
    """From r0 to where the point would be without the force there; c = h^2/(4m)."""
    raise NotImplementedError


@by_type
def end(rule, h, law, chain, gravity, x, y, z, vx, vy, vz, c, sx, sy, sz, rx, ry, rz):
    """r1, v1 and what the walls took of the velocity, from the point s and kappa grad q(s)."""
    raise NotImplementedError


@by_type_outlined
def add_impulses(rule, h, law, chain, x, y, z, c, reactions, impulse, lane):
    """Add the impulse per mass of each wall in one step to impulse[wall, lane]."""
    raise NotImplementedError


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(RuleNumbers)
def _(method, mass, energy, vx, vy, vz):
    # c = h^2/(4m) of equation (I) in contact/implicit.py, and nothing
    return 0.25 * method.dt * method.dt / mass, 0.0, 0.0


@base.flight.register(RuleNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, time, surface, hits):
    x, y, z, vx, vy, vz, left = fixed_step.free_steps(chain, gravity, method.dt, x, y, z, vx, vy, vz, left)
    px, py, pz = reach(method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0)
    surface, count = walls.touched(chain, x, y, z, px, py, pz)
    # Several walls at once: the careful way.
    surface = select(count > 1.0, base.HARD - surface, surface)
    px, py, pz = displacement(gravity, vx, vy, vz, method.dt)
    surface = select(fixed_step.too_fast(method.longest, px, py, pz), base.HARD, surface)
    return x, y, z, vx, vy, vz, left, select(left > 0.0, surface, -1.0)


@base.most_sweeps.register(RuleNumbers)
def _(method, chain):
    return implicit.SWEEPS


@base.guess.register(RuleNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface):
    px, py, pz = reach(method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0)
    kappa = implicit.guess(chain, surface, method.law, x + px, y + py, z + pz, k0)
    touching = surface >= 0.0
    return select(touching, kappa, 0.0), touching


@base.improve.register(RuleNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa, unsolved, multiplier):
    px, py, pz = reach(method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0)
    step, more = implicit.improve(chain, surface, method.law, x + px, y + py, z + pz, k0, kappa)
    return select(unsolved, kappa - step, kappa), unsolved & more, 0.0, 0.0, 0.0


@base.contact.register(RuleNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned):
    px, py, pz = reach(method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0)
    sx, sy, sz = implicit.reached(chain, surface, x + px, y + py, z + pz, kappa)
    # kappa grad q(s)
    rx, ry, rz = x + px - sx, y + py - sy, z + pz - sz
    x1, y1, z1, wx, wy, wz, kx, ky, kz = end(
        method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0, sx, sy, sz, rx, ry, rz
    )
    touching = surface >= 0.0
    # Another wall at s, or an equation that is not solved yet: the careful way.
    solved = (not unsolved) & (not walls.outside(chain, surface, sx, sy, sz))
    step = (left > 0.0) & select(touching, solved, surface > base.HARD)
    # The midpoint rule may end outside before it feels a force.
    inside = not walls.outside(chain, -1.0, x, y, z)
    new = step & inside & (touching | walls.outside(chain, -1.0, x1, y1, z1))
    return (
        *fixed_step.taken(step, x, y, z, vx, vy, vz, left, x1, y1, z1, wx, wy, wz),
        select(touching & (not solved), base.HARD - surface, surface),
        select(step & touching, math.sqrt(kx * kx + ky * ky + kz * kz), 0.0),
        select(new, 1.0, 0.0),
        k0,
    )


# --- Several walls at once -------------------------------------------------------------------------------


@base.hard_pass.register(RuleNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    h = method.dt
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    if fixed_step.too_fast(method.longest, px, py, pz):
        return x, y, z, vx, vy, vz, left, 0.0, k0, Status.TOO_FAST.value
    px, py, pz = reach(method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0)
    reactions = scratch((walls.length(chain), 4), np.float64)
    sx, sy, sz, solved = corner.hold(implicit.AtEnd(), method.law, None, chain, x, y, z, px, py, pz, k0, reactions)
    add_impulses(method.rule, h, method.law, chain, x, y, z, k0, reactions, impulse, lane)
    rx, ry, rz = corner.total(reactions)
    x1, y1, z1, wx, wy, wz, _kx, _ky, _kz = end(
        method.rule, method.dt, method.law, chain, gravity, x, y, z, vx, vy, vz, k0, sx, sy, sz, rx, ry, rz
    )
    new = 0.0 if walls.outside(chain, -1.0, x, y, z) else 1.0
    status = Status.DONE.value if solved else Status.UNSOLVED.value
    return x1, y1, z1, wx, wy, wz, left - 1.0, new, k0, status
