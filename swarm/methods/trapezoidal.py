"""Trapezoidal: implicit steps with soft walls. It does not conserve the energy: a baseline for the charts."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from ..contact import corner, implicit
from ..contact.force import add_impulses, force
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
    Source: Newmark 1959; Hairer, Lubich & Wanner, Geometric Numerical Integration, VI.8.

    >>> Trapezoidal(dt=1e-3, penalty=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: penalty must be above 0, got -1
    """

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *fixed_step.of_steps(scene), *implicit.NEEDS

    def numbers(self, scene: Scene) -> implicit_rule.RuleNumbers:
        return implicit_rule.RuleNumbers(self.dt, self.law(), fixed_step.longest_step(scene), TrapezoidalRule())


class TrapezoidalRule(NamedTuple):
    """Chooses this rule."""


@implicit_rule.reach.register(TrapezoidalRule)
def _(rule, h, law, chain, gravity, x, y, z, vx, vy, vz, c):
    # r1 = r0 + h v0 + h^2/2 G + h^2/(4m) (F0 + F1)
    dx, dy, dz = displacement(gravity, vx, vy, vz, h)
    fx, fy, fz = force(chain, law, x, y, z)
    return dx + c * fx, dy + c * fy, dz + c * fz


@implicit_rule.end.register(TrapezoidalRule)
def _(rule, h, law, chain, gravity, x, y, z, vx, vy, vz, c, sx, sy, sz, rx, ry, rz):
    # v1 = v0 + h G + h/(2m) F0 - (2/h) kappa grad q(r1)
    f = 2.0 / h
    fx, fy, fz = force(chain, law, x, y, z)
    kx, ky, kz = f * (rx - c * fx), f * (ry - c * fy), f * (rz - c * fz)
    wx, wy, wz = accelerated(gravity, vx, vy, vz, h)
    return sx, sy, sz, wx - kx, wy - ky, wz - kz, kx, ky, kz


@implicit_rule.add_impulses.register(TrapezoidalRule)
def _(rule, h, law, chain, x, y, z, c, reactions, impulse, lane):
    corner.add_impulses(reactions, h, impulse, lane)
    # h/(2m) |F0|
    add_impulses(chain, law, 2.0 * c / h, 0, x, y, z, impulse, lane)
