"""The common part of the implicit baselines: the pass of a rule that takes the force at a point it has to find.

A rule says where that point would be without walls (`reach`), and the step that follows from where it is (`end`).
"""

from typing import NamedTuple

import numpy as np

from ..contact import corner, implicit
from ..contact.impulse import Step
from ..kernel.arrays import scratch
from ..kernel.jit import select
from ..kernel.vector import Vec, norm
from . import contract, fixed_step


class RuleStep(NamedTuple):
    """r1, v1 and the change of the velocity that the walls take."""

    r: Vec
    v: Vec
    kick: Vec


class RuleNumbers(fixed_step.Numbers):
    """An implicit rule as kernels know it: the part of a step at its point, `reach`, and these two."""

    def end(self, before, gravity, lane, s, push):
        """The `RuleStep`, from the point s and `push`, kappa grad q(s), with the walls at its start."""
        raise NotImplementedError

    def add_impulses(self, walls, lane, reactions, impulse, i):
        """Add the impulse per mass of each wall to impulse[wall, i], its work to the rows behind: their sum."""
        raise NotImplementedError

    def free(self, walls, gravity, lane):
        """The point, as if it felt no force."""
        return lane.r + self.reach(self.before(walls, lane.remaining), gravity, lane)

    def there(self, walls, lane):
        """The walls when the particle is at the point."""
        return walls.at((lane.remaining - self.point) * self.dt)

    def most_sweeps(self, walls):
        return implicit.SWEEPS

    def guess(self, walls, gravity, lane, wall):
        r = self.free(walls, gravity, lane)
        touching = wall >= 0.0
        kappa = implicit.guess(self.there(walls, lane), wall, self.law, r, lane.own.over_mass)
        return select(touching, kappa, 0.0), touching

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        r, kappa = self.free(walls, gravity, lane), solution.kappa
        there = self.there(walls, lane)
        step, more = implicit.improve(there, wall, self.law, r, lane.own.over_mass, kappa)
        return select(solution.unsolved, kappa - step, kappa), solution.unsolved & more, contract.NO_RECORD

    def contact(self, walls, gravity, lane, wall, solution):
        r, there = self.free(walls, gravity, lane), self.there(walls, lane)
        before, over, after = (
            self.before(walls, lane.remaining),
            self.over(walls, lane.remaining),
            self.after(walls, lane.remaining),
        )
        point = implicit.reached(there, wall, r, solution.kappa)
        step = self.end(before, gravity, lane, point, r - point)
        touching = wall >= 0.0
        # Another wall at s, or an equation that is not solved yet: the careful way.
        solved = (not solution.unsolved) & (not there.outside(wall, point))
        # The midpoint rule may end outside before it feels a force.
        inside = not before.outside(-1.0, lane.r)
        new = inside & (touching | after.outside(-1.0, step.r))
        # One wall alone has a part in the kick.
        work = self.work_along(over, wall, -1.0 / self.dt * step.kick)
        taken = fixed_step.Taken(step.r, step.v, solved, select(touching, norm(step.kick), 0.0), new, work)
        return fixed_step.contact(lane, wall, taken)

    def careful_step(self, walls, gravity, lane, impulse, i):
        before = self.before(walls, lane.remaining)
        free = Step(lane.r, self.reach(before, gravity, lane), lane.own.over_mass)
        reactions = scratch((walls.length(), 4), np.float64)
        point, solved = corner.hold(implicit.AtEnd(), self.law, None, self.there(walls, lane), free, reactions)
        work = self.add_impulses(walls, lane, reactions, impulse, i)
        step = self.end(before, gravity, lane, point, corner.total(reactions))
        return fixed_step.Careful(step.r, step.v, solved, work)
