"""What the implicit baselines share: the pass of a rule that takes the force at a point it has to find.

A rule says where that point would be without walls (`fixed_step.reach`), and what follows from where it is (`end`).
"""

from typing import Any, NamedTuple

import numpy as np

from ..contact import corner, implicit
from ..contact.records import Step
from ..kernel.jit import by_type, by_type_outlined, inlined, scratch, select
from ..kernel.vector import Vec, norm
from ..scene import Scene
from ..surfaces import fold as walls
from . import contract, fixed_step


class RuleNumbers(fixed_step.Numbers):
    """What kernels know of such a method; its form is the rule."""


def numbers(method: fixed_step.SoftWalls, scene: Scene, rule: Any) -> RuleNumbers:
    """The numbers of a method with this rule."""
    # h^2/(4m) of equation (I) in contact/implicit.py
    factor = 0.25 * method.dt * method.dt
    return RuleNumbers(method.dt, method.law(), fixed_step.longest_step(scene), factor, rule)


class RuleStep(NamedTuple):
    """r1, v1 and what the walls took of the velocity."""

    r: Vec
    v: Vec
    kick: Vec


@by_type
def end(rule, h, law, chain, gravity, lane, point, push):
    """The `RuleStep`, from the point s and `push`, kappa grad q(s)."""
    raise NotImplementedError


@by_type_outlined
def add_impulses(rule, method, chain, lane, reactions, impulse, i):
    """Add the impulse per mass of each wall in one step to impulse[wall, i]."""
    raise NotImplementedError


# --- One pass --------------------------------------------------------------------------------------------


@inlined
def _free(method, chain, gravity, lane):
    """The point, as if it felt no force."""
    return lane.r + fixed_step.reach(method.form, method.dt, method.law, chain, gravity, lane)


@contract.most_sweeps.register(RuleNumbers)
def _(method, chain):
    return implicit.SWEEPS


@contract.guess.register(RuleNumbers)
def _(method, chain, gravity, lane, wall):
    r = _free(method, chain, gravity, lane)
    touching = wall >= 0.0
    return select(touching, implicit.guess(chain, wall, method.law, r, lane.own.over_mass), 0.0), touching


@contract.improve.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, solution, multiplier):
    r, kappa = _free(method, chain, gravity, lane), solution.kappa
    step, more = implicit.improve(chain, wall, method.law, r, lane.own.over_mass, kappa)
    return select(solution.unsolved, kappa - step, kappa), solution.unsolved & more, contract.NO_RECORD


@contract.contact.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, solution):
    r = _free(method, chain, gravity, lane)
    point = implicit.reached(chain, wall, r, solution.kappa)
    step = end(method.form, method.dt, method.law, chain, gravity, lane, point, r - point)
    touching = wall >= 0.0
    # Another wall at s, or an equation that is not solved yet: the careful way.
    solved = (not solution.unsolved) & (not walls.outside(chain, wall, point))
    # The midpoint rule may end outside before it feels a force.
    inside = not walls.outside(chain, -1.0, lane.r)
    new = inside & (touching | walls.outside(chain, -1.0, step.r))
    taken = fixed_step.Taken(step.r, step.v, solved, select(touching, norm(step.kick), 0.0), new)
    return fixed_step.contact(lane, wall, taken)


# --- Several walls at once -------------------------------------------------------------------------------


@fixed_step.careful_step.register(RuleNumbers)
def _(method, chain, gravity, lane, impulse, i):
    h, law, rule = method.dt, method.law, method.form
    free = Step(lane.r, fixed_step.reach(rule, h, law, chain, gravity, lane), lane.own.over_mass)
    reactions = scratch((walls.length(chain), 4), np.float64)
    point, solved = corner.hold(implicit.AtEnd(), law, None, chain, free, reactions)
    add_impulses(rule, method, chain, lane, reactions, impulse, i)
    step = end(rule, h, law, chain, gravity, lane, point, corner.total(reactions))
    return step.r, step.v, solved
