"""Penalty: fixed steps with soft walls, conserving kinetic + potential + stored energy."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contact import corner
from ..contact import energy as energies
from ..contact import impulse as contact_impulse
from ..contact.discrete_gradient import form_of, reaction_needs
from ..contact.impulse import Step
from ..kernel.arrays import scratch
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import select
from ..kernel.vector import norm
from ..scene import Scene
from . import contract, fixed_step


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
    ends the run with an error. Walls are compliant: for a = 1 a particle is up to |v| sqrt(m/alpha) deep in one.
    Of bodies the links stay rigid, and walls are springs for their contact points, each alone or in cavities.
    Order: 2 in dt. Cost: free steps are jumped over in one evaluation; a contact step solves one scalar equation. Steps
    look at the gap at their ends only: a solid thinner than |v| dt is refused, but a step can miss a chord through the
    edge of a solid that is shorter than |v| dt.
    Walls may move without turning: the step is that of the frame of each wall, and with the energy less the work of the
    walls it conserves the same. Where walls move in any way but uniformly, free steps are jumped over in several parts.
    Source: García Orden & Ortega 2007, eqs. (2)-(5), with the composite discrete gradient of surfaces/contract.py.

    >>> Penalty(dt=1e-3, penalty=1e4, exponent=0.5)
    Traceback (most recent call last):
    swarm.errors.SceneError: exponent must be 1 or more, got 0.5
    """

    gradient: str = "composite"

    def __post_init__(self) -> None:
        super().__post_init__()
        fixed_step.check_gradient(self)

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *super().needs(scene), *reaction_needs(self.gradient)

    def numbers(self, scene: Scene) -> fixed_step.Numbers:
        # h^2/(2m) of equation (K) in contact/impulse.py
        return self.record(PenaltyNumbers, scene, 0.5 * self.dt * self.dt, form_of(self.gradient))

    def seldom_hard(self, scene: Scene) -> bool:
        return self.gradient == "composite" and super().seldom_hard(scene)


# --- As kernels know it ----------------------------------------------------------------------------------


class PenaltyNumbers(fixed_step.Numbers):
    """The step with the composite discrete gradient, or with the mean-value one."""

    def free(self, gravity, lane):
        """The step without walls: r0, p and c."""
        return Step(lane.r, displacement(gravity, lane.v, self.dt), lane.own.over_mass)

    def restored(self, over, after, gravity, lane, work, ends):
        """The factor of v1 with which the energy is that of the start and `work`, and whether it was so before."""
        budget = energies.Budget(
            2.0 / (self.dt * self.dt) * lane.own.over_mass, 0.5 * lane.own.twice_energy + work, 0.0
        )
        return energies.restored(self.law, over, after, gravity, budget, ends)

    def most_sweeps(self, walls):
        return contact_impulse.NEWTON_STEPS

    def guess(self, walls, gravity, lane, wall):
        over = self.over(walls, lane.remaining)
        kappa = contact_impulse.guess(over, wall, self.law, self.free(gravity, lane))
        touching = wall >= 0.0
        return select(touching, kappa, 0.0), touching

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        kappa, unsolved = solution.kappa, solution.unsolved
        over = self.over(walls, lane.remaining)
        newton = contact_impulse.improve(over, wall, self.law, None, self.free(gravity, lane), kappa)
        return select(unsolved, kappa - newton.step, kappa), unsolved & newton.more, contract.NO_RECORD

    def contact(self, walls, gravity, lane, wall, solution):
        # One step, free or in contact with one wall: r1 = r0 + p - kappa D(r0, r1)
        h, kappa = self.dt, solution.kappa
        over, after = self.over(walls, lane.remaining), self.after(walls, lane.remaining)
        step = self.free(gravity, lane)
        touching = wall >= 0.0
        r1 = select(touching, over.push(wall, step.r, step.p, kappa), step.r + step.p)
        # v1 = v0 + h G - (2 kappa/h) D; the equal 2 (r1 - r0)/h - v0 cancels
        g = over.discrete_gradient(wall, step.r, r1)
        f = select(touching, 2.0 / h * kappa, 0.0)
        v1 = accelerated(gravity, lane.v, h) - f * g
        work = self.work_along(over, wall, -f / h * g)

        # A push into another wall, or an equation that is not solved yet: the careful way.
        factor, balanced = self.restored(over, after, gravity, lane, work, energies.Ends(step.r, r1, v1, h))
        solved = balanced & (not solution.unsolved) & over.pushes(wall, kappa)
        solved = solved & (not after.outside(wall, r1))
        new = touching & (not over.outside(-1.0, lane.r))
        taken = fixed_step.Taken(r1, v1 * select(touching, factor, 1.0), solved, abs(f) * norm(g), new, work)
        return fixed_step.contact(lane, wall, taken)

    def careful_step(self, walls, gravity, lane, impulse, i):
        h, step = self.dt, self.free(gravity, lane)
        over, after = self.over(walls, lane.remaining), self.after(walls, lane.remaining)
        reactions = scratch((walls.length(), 4), np.float64)
        r1, solved = corner.hold(self.form, self.law, None, over, step, reactions)
        corner.add_impulses(reactions, h, impulse, i)
        work = corner.add_works(self.moving, over, -2.0 / (h * h), reactions, impulse, i)
        v1 = accelerated(gravity, lane.v, h) - 2.0 / h * corner.total(reactions)
        factor, balanced = self.restored(over, after, gravity, lane, work, energies.Ends(step.r, r1, v1, h))
        return fixed_step.Careful(r1, v1 * factor, solved and balanced, work)
