"""Verlet: explicit steps with soft walls. It does not conserve the energy: a baseline for the charts."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from ..contact.energy import NEEDS as FORCE_NEEDS
from ..contact.energy import add_impulses, add_works, walls_force, work
from ..kernel.gravity import accelerated, displacement
from ..kernel.vector import Vec, norm
from ..scene import Scene
from . import fixed_step


@dataclass(frozen=True)
class Verlet(fixed_step.SoftWalls):
    """Velocity Verlet with a penalty contact: a baseline, not for results.

    r1 = r0 + h v0 + h^2/2 a0,   v1 = v0 + h (a0 + a1)/2,   a = G - V'(g) grad g/m.

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: nothing exactly; each contact with a wall of exponent 1 changes the energy by a part of up to
    about dt^2 alpha/m; its sign depends on where in a step it begins, and beyond dt sqrt(alpha/m) = 2 it is unstable:
    the energy grows without bound. Order: 2 in dt, also across the corner of the force at the wall. Cost:
    free steps, which it takes exactly, are jumped over in one evaluation; two forces a contact step. Penetration:
    |v| sqrt(m/alpha), more where it is unstable; through the middle of a solid it ends the run with an error.
    Walls may move without turning: each force is that of the walls at its time.
    Source: Hairer, Lubich & Wanner, Geometric Numerical Integration, I.1.4.

    >>> Verlet(dt=0.0, penalty=1e4)
    Traceback (most recent call last):
    swarm.errors.SceneError: dt must be above 0, got 0
    """

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *super().needs(scene), *FORCE_NEEDS

    def is_explicit(self) -> bool:
        return self.exponent == 1.0

    def numbers(self, scene: Scene) -> fixed_step.SoftNumbers:
        # h/(2m)
        return self.record(VerletNumbers, scene, 0.5 * self.dt)


# --- The form for kernels --------------------------------------------------------------------------------


class VerletStep(NamedTuple):
    """r1, v1, the change of the velocity by the walls, h (F0 + F1)/(2m), and the work of the walls per mass."""

    r: Vec
    v: Vec
    kick: Vec
    work: float


class VerletNumbers(fixed_step.SoftNumbers):
    """The rule of the velocity Verlet step."""

    def step(self, walls, gravity, lane):
        """Return the `VerletStep` of a lane."""
        h, over_mass = self.dt, lane.own.over_mass
        before, over, after = self.times(walls, lane.remaining)
        f0 = walls_force(before, self.law, lane.r)
        # h^2/(2m) F0
        r1 = lane.r + (displacement(gravity, lane.v, h) + (h * over_mass) * f0)
        kick = over_mass * (f0 + walls_force(after, self.law, r1))
        given = work(self.moving, over, before, self.law, lane.r) + work(self.moving, over, after, self.law, r1)
        return VerletStep(r1, accelerated(gravity, lane.v, h) + kick, kick, over_mass / h * given)

    def contact(self, walls, gravity, lane, wall, solution):
        step = self.step(walls, gravity, lane)
        new = (wall >= 0.0) & (not self.at_start(walls, lane.remaining).outside(-1.0, lane.r))
        # The careful way counts a contact with another wall.
        solved = not self.after(walls, lane.remaining).outside(wall, step.r)
        solved = solved & (not self.passes(walls, lane, wall, step.r, step.v))
        taken = fixed_step.Taken(step.r, step.v, solved, norm(step.kick), new, step.work)
        return fixed_step.contact(lane, wall, taken)

    def careful_step(self, walls, gravity, lane, impulse, i):
        step, over_mass, law = self.step(walls, gravity, lane), lane.own.over_mass, self.law
        before, over, after = self.times(walls, lane.remaining)
        add_impulses(before, law, over_mass, lane.r, impulse, i)
        add_impulses(after, law, over_mass, step.r, impulse, i)
        work = add_works(self.moving, over, before, law, over_mass / self.dt, lane.r, impulse, i)
        work += add_works(self.moving, over, after, law, over_mass / self.dt, step.r, impulse, i)
        return fixed_step.Careful(step.r, step.v, True, work)
