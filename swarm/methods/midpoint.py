"""Midpoint: implicit steps with soft walls. It does not conserve the energy: a baseline for the charts."""

from dataclasses import dataclass
from typing import Any

from ..contact import corner
from ..kernel.gravity import accelerated
from ..scene import Scene
from . import fixed_step, implicit_rule


@dataclass(frozen=True)
class Midpoint(fixed_step.SoftWalls):
    """Implicit midpoint rule with a penalty contact: a baseline, not for results.

    rm = (r0 + r1)/2,   r1 = r0 + h (v0 + v1)/2,   v1 = v0 + h a(rm),   a = G - V'(g) grad g/m.

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: quadratic invariants only, so the energy of a linear spring that never lets go, but not that of a contact
    that begins and ends: each changes the energy by what the force at the middle of a step misses. No stability limit.
    Order: 2 in dt between contacts. Cost: free steps, which it takes exactly, are jumped over in one evaluation; a
    contact step solves one scalar equation.
    Walls may move without turning: the force is that of the walls at the middle of the step.
    Source: Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.1.

    >>> Midpoint(dt=1e-3, penalty=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: penalty must be above 0, got -1
    """

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *super().needs(scene), *implicit_rule.NEEDS

    def numbers(self, scene: Scene) -> fixed_step.SoftNumbers:
        # h^2/(4m) of equation (I) in implicit_rule.py
        return self.record(MidpointNumbers, scene, 0.25 * self.dt * self.dt)


# --- As kernels know it ----------------------------------------------------------------------------------


class MidpointNumbers(implicit_rule.RuleNumbers):
    """The rule."""

    point = 0.5

    def reach(self, before, gravity, lane):
        # rm = r0 + h/2 v0 + h^2/4 a(rm)
        return 0.5 * self.dt * accelerated(gravity, lane.v, 0.5 * self.dt)

    def end(self, before, gravity, lane, s, push):
        # r1 = 2 rm - r0, v1 = v0 + h G - (4/h) kappa grad q(rm)
        kick = 4.0 / self.dt * push
        return implicit_rule.RuleStep(2.0 * s - lane.r, accelerated(gravity, lane.v, self.dt) - kick, kick)

    def add_impulses(self, walls, lane, reactions, impulse, i):
        h = self.dt
        corner.add_reaction_impulses(reactions, 0.5 * h, impulse, i)
        return corner.add_reaction_works(
            self.moving, self.over(walls, lane.remaining), -4.0 / (h * h), reactions, impulse, i
        )
