"""What the implicit baselines share: the pass of a rule that takes the force at a point it has to find.

A rule says where that point would be without walls (`reach`), and what follows from where it is (`end`).
"""

from typing import Any, NamedTuple

import numpy as np

from ..contact import corner, implicit
from ..contact.records import Step
from ..kernel.gravity import displacement
from ..kernel.jit import by_type, by_type_outlined, scratch, select
from ..kernel.vector import Vec, norm
from ..status import Status
from ..surfaces import fold as walls
from . import contract, fixed_step


class RuleNumbers(NamedTuple):
    """What kernels know of the method."""

    dt: float
    law: Any
    longest: Any  # step that jumps over no solid [m], None where there is none
    rule: Any


class RuleOwn(NamedTuple):
    """What a lane keeps."""

    c: float  # h^2/(4m) of equation (I) in contact/implicit.py
    unused: float
    also_unused: float


class RuleStep(NamedTuple):
    """r1, v1 and what the walls took of the velocity."""

    r: Vec
    v: Vec
    kick: Vec


@by_type
def reach(rule, h, law, chain, gravity, lane):
    """From r0 to where the point would be without the force there."""
    raise NotImplementedError


@by_type
def end(rule, h, law, chain, gravity, lane, point, push):
    """The `RuleStep`, from the point s and `push`, kappa grad q(s)."""
    raise NotImplementedError


@by_type_outlined
def add_impulses(rule, method, chain, lane, reactions, impulse, i):
    """Add the impulse per mass of each wall in one step to impulse[wall, i]."""
    raise NotImplementedError


# --- One pass --------------------------------------------------------------------------------------------


@contract.constants.register(RuleNumbers)
def _(method, mass, energy, v):
    return 0.25 * method.dt * method.dt / mass, 0.0, 0.0


@contract.own.register(RuleNumbers)
def _(method, first, second, third):
    return RuleOwn(first, second, third)


@contract.flight.register(RuleNumbers)
def _(method, chain, gravity, lane):
    start = fixed_step.free_steps(chain, gravity, method.dt, lane)
    free = contract.Lane(start.r, start.v, start.left, lane.hits, lane.own)
    touched = walls.touched(chain, start.r, reach(method.rule, method.dt, method.law, chain, gravity, free))
    # Several walls at once: the careful way.
    p = displacement(gravity, start.v, method.dt)
    return fixed_step.before_step(method, start, touched, touched.number <= 1.0, p)


@contract.most_sweeps.register(RuleNumbers)
def _(method, chain):
    return implicit.SWEEPS


@contract.guess.register(RuleNumbers)
def _(method, chain, gravity, lane, wall):
    r = lane.r + reach(method.rule, method.dt, method.law, chain, gravity, lane)
    touching = wall >= 0.0
    return select(touching, implicit.guess(chain, wall, method.law, r, lane.own.c), 0.0), touching


@contract.improve.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, solution, multiplier):
    r, kappa = lane.r + reach(method.rule, method.dt, method.law, chain, gravity, lane), solution.kappa
    step, more = implicit.improve(chain, wall, method.law, r, lane.own.c, kappa)
    return select(solution.unsolved, kappa - step, kappa), solution.unsolved & more, contract.NO_RECORD


@contract.contact.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, solution):
    r = lane.r + reach(method.rule, method.dt, method.law, chain, gravity, lane)
    point = implicit.reached(chain, wall, r, solution.kappa)
    step = end(method.rule, method.dt, method.law, chain, gravity, lane, point, r - point)
    touching = wall >= 0.0
    # Another wall at s, or an equation that is not solved yet: the careful way.
    solved = (not solution.unsolved) & (not walls.outside(chain, wall, point))
    # The midpoint rule may end outside before it feels a force.
    inside = not walls.outside(chain, -1.0, lane.r)
    taken = fixed_step.Taken(
        step.r,
        step.v,
        select(touching & (not solved), contract.HARD - wall, wall),
        select(touching, norm(step.kick), 0.0),
        inside & (touching | walls.outside(chain, -1.0, step.r)),
    )
    return fixed_step.contact(lane, (lane.left > 0.0) & select(touching, solved, wall > contract.HARD), taken)


# --- Several walls at once -------------------------------------------------------------------------------


@contract.hard_pass.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, lanes, i):
    h, law = method.dt, method.law
    if fixed_step.too_fast(method.longest, displacement(gravity, lane.v, h)):
        return fixed_step.refused(lane, Status.TOO_FAST.value)
    free = Step(lane.r, reach(method.rule, h, law, chain, gravity, lane), lane.own.c)
    reactions = scratch((walls.length(chain), 4), np.float64)
    point, solved = corner.hold(implicit.AtEnd(), law, None, chain, free, reactions)
    add_impulses(method.rule, method, chain, lane, reactions, lanes.impulse, i)
    step = end(method.rule, h, law, chain, gravity, lane, point, corner.total(reactions))
    status = Status.DONE.value if solved else Status.UNSOLVED.value
    return fixed_step.done(lane, step.r, step.v, not walls.outside(chain, -1.0, lane.r), status)
