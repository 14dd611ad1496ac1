"""Trapezoidal: implicit steps with soft walls. It does not conserve the energy: a baseline for the charts."""

from dataclasses import dataclass
from typing import Any

from ..contact import corner
from ..contact.energy import add_impulses, add_works, walls_force
from ..kernel.gravity import accelerated, displacement
from ..scene import Scene
from . import fixed_step, implicit_rule


@dataclass(frozen=True)
class Trapezoidal(fixed_step.SoftWalls):
    """Trapezoidal rule (Newmark, gamma = 1/2, beta = 1/4) with a penalty contact: a baseline, not for results.

    r1 = r0 + h v0 + h^2/4 (a0 + a1),   v1 = v0 + h (a0 + a1)/2,   a = G - V'(g) grad g/m.

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: the energy of a linear spring that never lets go, as the midpoint rule, of which it is a conjugate, but
    not that of a contact that begins and ends. No stability limit for linear problems. Order: 2 in dt between contacts.
    Cost: free steps, which it takes exactly, are jumped over in one evaluation; a contact step solves one scalar
    equation.
    Walls may move without turning: each force is that of the walls at its time.
    Source: Newmark 1959; Hairer, Lubich & Wanner, Geometric Numerical Integration, VI.8.

    >>> Trapezoidal(dt=1e-3, penalty=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: penalty must be above 0, got -1
    """

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *super().needs(scene), *implicit_rule.NEEDS

    def numbers(self, scene: Scene) -> fixed_step.SoftNumbers:
        # h^2/(4m) of equation (I) in implicit_rule.py
        return self.record(TrapezoidalNumbers, scene, 0.25 * self.dt * self.dt)


# --- As kernels know it ----------------------------------------------------------------------------------


class TrapezoidalNumbers(implicit_rule.RuleNumbers):
    """The rule."""

    def reach(self, before, gravity, lane):
        # r1 = r0 + h v0 + h^2/2 G + h^2/(4m) (F0 + F1)
        return displacement(gravity, lane.v, self.dt) + lane.own.over_mass * walls_force(before, self.law, lane.r)

    def end(self, before, gravity, lane, s, push):
        # v1 = v0 + h G + h/(2m) F0 - (2/h) kappa grad q(r1)
        kick = 2.0 / self.dt * (push - lane.own.over_mass * walls_force(before, self.law, lane.r))
        return implicit_rule.RuleStep(s, accelerated(gravity, lane.v, self.dt) - kick, kick)

    def add_impulses(self, walls, lane, reactions, impulse, i):
        h, law, moving = self.dt, self.law, self.moving
        before, over = self.before(walls, lane.remaining), self.over(walls, lane.remaining)
        corner.add_reaction_impulses(reactions, h, impulse, i)
        # h/(2m) |F0|
        factor = 2.0 * lane.own.over_mass / h
        add_impulses(before, law, factor, lane.r, impulse, i)
        work = add_works(moving, over, before, law, factor / h, lane.r, impulse, i)
        return work + corner.add_reaction_works(moving, over, -2.0 / (h * h), reactions, impulse, i)
