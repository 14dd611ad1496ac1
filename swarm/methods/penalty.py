"""Penalty: fixed steps with soft walls, conserving kinetic + potential + stored energy."""

from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..common import checks
from ..contact import corner
from ..contact import energy as energies
from ..contact import impulse as contact_impulse
from ..contact.discrete_gradient import form_of, reaction_needs
from ..contact.impulse import Step
from ..kernel.arrays import scratch
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import select
from ..kernel.vector import Vec, norm
from ..scene import Scene
from . import base, fixed_step


@dataclass(frozen=True)
class Penalty(fixed_step.SoftWalls):
    """Energy-conserving penalty contact with a fixed step (the paper's eq. (5), composite discrete gradient).

        (v0 + v1)/2 = (r1 - r0)/h
        m (v1 - v0) = h m G - h D alpha (Phi0 + Phi1)/2

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.
        gradient: "composite", or "mean-value", which is the paper's general form, slow, and needs exponent > 1.
        friction_tolerance: of grains, from 1e-10 to 1: the change by which a sweep over all contacts ends the
            solution of a step for friction, relative to the momentum at a contact. In 20 steps places in a pile are
            exact to 5e-5 of a radius with 0.02, and to 1e-10 with 1e-8. A few grains are exact with any value.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Points: a contact step counts only if its energy balances; one that cannot be solved (a step longer than the cavity
    into several walls at once) ends the run with an error. For a = 1 a particle is up to |v| sqrt(m/alpha) deep in a
    wall. Steps look at the gap at their ends only. A solid thinner than |v| dt is refused, but a step can miss a chord
    through the edge of a solid that is shorter than |v| dt. A particle that gets through the middle of a solid ends
    the run with an error, which names a penalty that holds it.

    Moving walls: the step is that in the frame of each wall. A contact with a wall that turns costs two to three times
    one at rest. If walls do not move uniformly, free steps may be jumped over in several parts.

    Periodic cells: a particle that leaves the cell comes back at the end of its step. Among solids that have images
    a step may go a twentieth of the shortest period.

    Laws of walls: `restitution`, `friction`, `temperature` and `laws` act on points where a contact ends. They change
    the velocity as at an impact on a rigid wall, and the energy that they take or give is booked. In an edge they act
    only on the speed that their wall has given; the speed from other walls stays. Friction acts on the whole impulse
    of a contact; in a contact that gravity makes last it acts each time that the particle swings back.

    Openings: a step decides at its start whether the wall is open at the foot of the point on it. Doors are at whole
    steps. The energy that a contact stores in a wall that opens or goes is in "dissipated_energy"; so is the energy
    that walls store of a particle that another wall absorbs.

    Unions and foams: a `Union` of several rooms, or a foam, is one wall with the same laws for all of its parts. In a
    doorway no wall pushes, and behind its edge the nearer room pushes. A step that is longer than the wall
    between two rooms is thick may pass it without a contact.

    Bodies: links stay rigid, and walls are springs for the contact points, each alone or in cavities.

    Particles with a radius (grains) press on one another and on walls by the same law, with the gap
    R_i + R_j - |r_i - r_j|. All impulses of a step are solved together. `restitution` (0.01 or more) and `friction`
    are those of `Pairs` and of surfaces; the loss is in "dissipated_energy". A damper that never pulls gives the
    required restitution at any speed. Friction sticks where it can, so that a pile comes to rest and stays at rest. It
    turns balls, with a moment of inertia of 2/5 m R^2, in a plane too. Balls that roll lose energy by `rolling` alone.
    `temperature` and `laws` of walls act on a ball where a contact ends, on the velocity that its dampers and its
    friction leave, mirrored; the ball keeps its spin. Walls may move in any way. The impulses of friction and rolling
    belong to a run and not to `Particles`: in a second run from `result.particles` they begin at 0.

    A contact should take 12 steps or more. A step in which the limit of friction, or a damper, is met to fewer digits
    than others is counted in "unconverged"; energy and momentum are those of the impulses that were used.

    Two balls that meet at the relative speed v overlap by up to v sqrt(m/alpha), for a = 1, with their reduced mass m,
    and a ball and a wall with the mass of the ball. "largest_overlap" is the largest since the frame before; it should
    be at most a fifth of the radii. An overlap of more than the radius of the smaller ball (its centre then has passed
    a surface) ends the run with an error, and so does a step in which a ball jumps over another one or over a solid.

    Grains meet fields, outlines and meshes too: each solid once, and each face once. A face is the
    triangles of a plane or of a convex body, or the sides that join smoothly or at an edge towards the balls. In a
    corner around them they touch both faces. Within a contact's width of the joint of two faces of one surface, as on
    the facets of a round hopper, they feel both, and are lifted by less than they overlap.

    Conserves: m v^2/2 - m G.r + alpha Phi^2/2 of each point, to round-off, at any dt; with moving walls this energy
    minus the work of the walls. For grains the energy, the momentum and the angular momentum of all, at any dt.
    Order: 2 in dt.
    Cost: free steps are jumped over in one evaluation; a contact step solves one scalar equation.
    Source: García Orden & Ortega 2007, eqs. (2)-(5), with the composite discrete gradient of surfaces/contract.py.

    >>> Penalty(dt=1e-3, penalty=1e4, exponent=0.5)
    Traceback (most recent call last):
    swarm.errors.SceneError: exponent must be 1 or more, got 0.5
    """

    gradient: fixed_step.Gradient = "composite"
    friction_tolerance: Annotated[float, partial(checks.part, least=1e-10)] = field(default=0.02, metadata=base.YOUNGER)

    def __post_init__(self) -> None:
        super().__post_init__()
        fixed_step.check_gradient(self)

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *super().needs(scene), *reaction_needs(self.gradient)

    def numbers(self, scene: Scene) -> fixed_step.SoftNumbers:
        # h^2/(2m) of equation (K) in contact/impulse.py
        return self.record(PenaltyNumbers, scene, 0.5 * self.dt * self.dt, form_of(self.gradient))

    def seldom_hard(self, scene: Scene) -> bool:
        return self.gradient == "composite" and super().seldom_hard(scene)


# --- The form for kernels --------------------------------------------------------------------------------


class ContactStep(NamedTuple):
    """Length of the contact step, this length in the unit of `remaining`, and the regularisation."""

    h: float
    used: float
    law: Any


class Pushed(NamedTuple):
    """The end of a contact step, its walls over the step and at its end, and the impulse and the work per mass.

    `balanced` is whether its energy is that of the start plus the work, up to round-off that is restored.
    """

    r: Vec
    v: Vec
    over: Any
    after: Any
    impulse: float
    work: float
    balanced: bool


class GradientSteps(fixed_step.Steps):
    """The steps with a discrete gradient, r1 = r0 + p - kappa D(r0, r1); they also have the fields `law` and `form`."""

    # Whether multipliers add to the springs.
    multiplies = False

    def cut(self: Any, remaining):
        """Return the `ContactStep` of the next contact step."""
        return ContactStep(self.dt, 1.0, self.law)

    def free(self: Any, gravity, lane, h):
        """Return the step without walls: r0, p and c = h^2/(2m)."""
        raise NotImplementedError

    def over_mass(self: Any, lane):
        """1/m"""
        raise NotImplementedError

    def most_sweeps(self, walls):
        return contact_impulse.NEWTON_STEPS

    def guess(self, walls, gravity, lane, wall):
        cut, over = self.cut(lane.remaining), self.over(walls, lane.remaining)
        kappa = contact_impulse.guess(over, wall, cut.law, self.free(gravity, lane, cut.h))
        touching = wall >= 0.0
        return select(touching, kappa, 0.0), touching

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        cut, over, kappa = self.cut(lane.remaining), self.over(walls, lane.remaining), solution.kappa
        given, free = multiplier if self.multiplies else None, self.free(gravity, lane, cut.h)
        newton = contact_impulse.improve(over, wall, cut.law, given, free, kappa)
        return select(solution.unsolved, kappa - newton.step, kappa), solution.unsolved & newton.more, newton.record

    def pushed(self, walls, gravity, lane, wall, h, kappa):
        """Return the `Pushed` step of a wall, or the free step."""
        over, step = self.over(walls, lane.remaining), self.free(gravity, lane, h)
        touching = wall >= 0.0
        r1 = select(touching, over.push(wall, step.r, step.p, kappa), step.r + step.p)
        # v1 = v0 + h G - (2 kappa/h) D; the equal 2 (r1 - r0)/h - v0 cancels
        g = over.discrete_gradient(wall, step.r, r1)
        f = select(touching, 2.0 / h * kappa, 0.0)
        v1, work = accelerated(gravity, lane.v, h) - f * g, self.work_along(over, wall, -f / h * g, (step.r, r1))
        given = abs(f) * norm(g)
        end = self._restored(walls, gravity, lane, h, Pushed(r1, v1, over, None, given, work, False), 1.0 / h * given)
        return end._replace(v=select(touching, end.v, v1))

    def reacted(self, walls, gravity, lane, h, end, reactions, impulse, i):
        """Return the `Pushed` step with the reactions of all walls; add their impulses and works to `impulse`."""
        over, reaction = self.over(walls, lane.remaining), corner.total(reactions)
        corner.add_reaction_impulses(reactions, h, impulse, i)
        work = corner.add_reaction_works(self.moving, over, -2.0 / (h * h), reactions, (lane.r, end), impulse, i)
        v1 = accelerated(gravity, lane.v, h) - 2.0 / h * reaction
        force = 1.0 / h * (2.0 / h * norm(reaction))
        return self._restored(walls, gravity, lane, h, Pushed(end, v1, over, None, 0.0, work, False), force)

    def _restored(self: Any, walls, gravity, lane, h, end, force):
        """Return a `Pushed` step with the energy of the start plus the work; `force` counts with multipliers only."""
        after = self.after(walls, lane.remaining)
        energy = 0.5 * lane.own.twice_energy + end.work
        budget = energies.Budget(self.over_mass(lane), energy, force if self.multiplies else 0.0)
        ends = energies.Ends(lane.r, end.r, end.v, h)
        factor, balanced = energies.restoring_factor(self.law, end.over, after, gravity, budget, ends)
        return end._replace(v=end.v * factor, after=after, balanced=balanced)


class PenaltyNumbers(GradientSteps, fixed_step.SoftNumbers):
    """The step with the composite or the mean-value discrete gradient."""

    def free(self, gravity, lane, h):
        return Step(lane.r, displacement(gravity, lane.v, h), lane.own.over_mass)

    def over_mass(self, lane):
        return 2.0 / (self.dt * self.dt) * lane.own.over_mass

    def contact(self, walls, gravity, lane, wall, solution):
        # One step, free or in contact with one wall
        end = self.pushed(walls, gravity, lane, wall, self.dt, solution.kappa)
        # A push into another wall or an unsolved equation needs the careful way.
        solved = end.balanced & (not solution.unsolved) & end.over.pushes(wall, solution.kappa)
        solved = solved & (not end.after.outside(wall, end.r)) & (not self.passes(walls, lane, wall, end.r, end.v))
        new = (wall >= 0.0) & (not end.over.outside(-1.0, lane.r))
        taken = fixed_step.Taken(end.r, end.v, solved, end.impulse, new, end.work)
        return fixed_step.contact(lane, wall, taken)

    def careful_step(self, walls, gravity, lane, impulse, i):
        reactions = scratch((walls.length(), 4), np.float64)
        over, free = self.over(walls, lane.remaining), self.free(gravity, lane, self.dt)
        r1, solved = corner.hold(self.form, self.law, None, over, free, reactions)
        end = self.reacted(walls, gravity, lane, self.dt, r1, reactions, impulse, i)
        return fixed_step.Careful(end.r, end.v, solved and end.balanced, end.work)
