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
from ..surfaces.moving import at
from . import contract, fixed_step


class RuleNumbers(fixed_step.Numbers):
    """What kernels know of such a method; its form is the rule."""


def numbers(method: fixed_step.SoftWalls, scene: Scene, rule: Any) -> RuleNumbers:
    """The numbers of a method with this rule."""
    # h^2/(4m) of equation (I) in contact/implicit.py
    factor = 0.25 * method.dt * method.dt
    longest = fixed_step.longest_step(scene, method.dt)
    return RuleNumbers(method.dt, method.law(), longest, factor, rule, fixed_step.moves(scene))


class RuleStep(NamedTuple):
    """r1, v1 and what the walls took of the velocity."""

    r: Vec
    v: Vec
    kick: Vec


@by_type
def end(rule, h, law, chain, gravity, lane, point, push):
    """The `RuleStep`, from the point s and `push`, kappa grad q(s), with the walls at its start."""
    raise NotImplementedError


@by_type_outlined
def add_impulses(rule, method, chain, lane, reactions, impulse, i):
    """Add the impulse per mass of each wall in one step to impulse[wall, i], its work to the rows behind: their sum."""
    raise NotImplementedError


# --- One pass --------------------------------------------------------------------------------------------


@inlined
def _free(method, chain, gravity, lane):
    """The point, as if it felt no force."""
    before = fixed_step.before(method.dt, chain, lane.left)
    return lane.r + fixed_step.reach(method.form, method.dt, method.law, before, gravity, lane)


@inlined
def _there(method, chain, lane):
    """The walls when the particle is at the point."""
    return at(chain, (lane.left - fixed_step.point_of(method.form)) * method.dt)


@contract.most_sweeps.register(RuleNumbers)
def _(method, chain):
    return implicit.SWEEPS


@contract.guess.register(RuleNumbers)
def _(method, chain, gravity, lane, wall):
    r = _free(method, chain, gravity, lane)
    touching = wall >= 0.0
    kappa = implicit.guess(_there(method, chain, lane), wall, method.law, r, lane.own.over_mass)
    return select(touching, kappa, 0.0), touching


@contract.improve.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, solution, multiplier):
    r, kappa = _free(method, chain, gravity, lane), solution.kappa
    there = _there(method, chain, lane)
    step, more = implicit.improve(there, wall, method.law, r, lane.own.over_mass, kappa)
    return select(solution.unsolved, kappa - step, kappa), solution.unsolved & more, contract.NO_RECORD


@contract.contact.register(RuleNumbers)
def _(method, chain, gravity, lane, wall, solution):
    h, r, there = method.dt, _free(method, chain, gravity, lane), _there(method, chain, lane)
    before, after = fixed_step.before(h, chain, lane.left), fixed_step.after(h, chain, lane.left)
    point = implicit.reached(there, wall, r, solution.kappa)
    step = end(method.form, h, method.law, before, gravity, lane, point, r - point)
    touching = wall >= 0.0
    # Another wall at s, or an equation that is not solved yet: the careful way.
    solved = (not solution.unsolved) & (not walls.outside(there, wall, point))
    # The midpoint rule may end outside before it feels a force.
    inside = not walls.outside(before, -1.0, lane.r)
    new = inside & (touching | walls.outside(after, -1.0, step.r))
    # One wall alone has a part in the kick.
    over = fixed_step.over(h, chain, lane.left)
    work = contract.work_along(method.moving, over, wall, -1.0 / h * step.kick)
    taken = fixed_step.Taken(step.r, step.v, solved, select(touching, norm(step.kick), 0.0), new, work)
    return fixed_step.contact(method.moving, lane, wall, taken)


# --- Several walls at once -------------------------------------------------------------------------------


@fixed_step.careful_step.register(RuleNumbers)
def _(method, chain, gravity, lane, impulse, i):
    h, law, rule = method.dt, method.law, method.form
    before = fixed_step.before(h, chain, lane.left)
    free = Step(lane.r, fixed_step.reach(rule, h, law, before, gravity, lane), lane.own.over_mass)
    reactions = scratch((walls.length(chain), 4), np.float64)
    point, solved = corner.hold(implicit.AtEnd(), law, None, _there(method, chain, lane), free, reactions)
    work = add_impulses(rule, method, chain, lane, reactions, impulse, i)
    step = end(rule, h, law, before, gravity, lane, point, corner.total(reactions))
    return fixed_step.Careful(step.r, step.v, solved, work)
