"""Midpoint and Trapezoidal: implicit steps with soft walls, which do not conserve the energy: baselines for charts.

A rule takes the force at an unknown point: it gives this point without walls (`reach`), and the end of
the step from the point (`end`). The force at the point moves it from r to s: s = r - c V'(g(s)) grad
g(s). With kappa = c V'(g(s)) g'(q(s)) it is s = r - kappa grad q(s), which the surface solves for s (`resolve`), so
that one equation in one unknown is left:
    F(kappa) = kappa - c V'(g) g'(q) = 0 at s(kappa).                                        (I)
c = h^2/(4m) for the midpoint and the trapezoidal rule.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..contact import corner
from ..contact.discrete_gradient import Reaction, illinois, narrowed
from ..contact.energy import NEEDS as FORCE_NEEDS
from ..contact.energy import add_impulses, add_works, strength, walls_force
from ..contact.impulse import Step
from ..kernel.arrays import scratch
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import select
from ..kernel.limits import EPSILON
from ..kernel.vector import ZERO, Vec, norm, square
from ..scene import Scene
from . import contract, fixed_step

# The derivative of F is a difference quotient over this part of kappa, and correct to about the same part, so that a
# step of _TOLERANCE is the last.
_NUDGE = 1e-7
_TOLERANCE = 1e-8
# Sweeps of the vectorised solve; lanes that need more are solved by `reaction`.
_SWEEPS = 10
_CAREFUL_ITERATIONS = 200


# --- The equation ----------------------------------------------------------------------------------------


def _residual(law, surface, r, c, kappa):
    """F(kappa)"""
    return kappa - c * strength(law, surface, surface.inner(surface.resolve(r, kappa)))


def _guess(surface, law, r, c):
    """Return kappa for a flat wall and a linear spring."""
    q = surface.inner(r)
    g = surface.gap_of(q)
    slope, _curvature = surface.gap_slope(q, q)
    # g(s) = g - kappa g'(q) |grad q|^2 and V' = k g(s): kappa (1 + c k g'^2 |grad q|^2) = c k g' g
    stiff = c * law.stiffness(g) * slope
    return select(g > 0.0, stiff * g, 0.0) / (1.0 + stiff * slope * square(surface.discrete_gradient(r, r)))


def _improve(surface, law, r, c, kappa):
    """Return the Newton step of kappa, and whether it is so large that another is needed."""
    f = _residual(law, surface, r, c, kappa)
    nudge = _NUDGE * kappa
    rise = _residual(law, surface, r, c, kappa + nudge) - f
    # Without a push there is nothing to solve.
    pushes = kappa != 0.0
    step = f * nudge / select(pushes, rise, 1.0)
    # True for NaN.
    return step, pushes & (not (abs(step) <= _TOLERANCE * abs(kappa)))


def _reached(walls, wall, r, kappa):
    """Return s, or r without such a wall."""
    end = r
    for k, one in reversed(tuple(enumerate(walls.each))):
        end = select(wall == k, one.resolve(r, kappa), end)
    return end


class _AtEnd(NamedTuple):
    """A form of `reaction`: the force at the end of the displacement, with c = h^2/(4m)."""

    def reaction(self, law, multiplier, surface, step):
        """Return the `Reaction` of a surface."""
        # A cavity pushes with kappa > 0, a solid with kappa < 0. The force falls along the push: F changes sign by
        # -F(0).
        r, c = step.r + step.p, step.c
        f_low = _residual(law, surface, r, c, 0.0)
        if f_low == 0.0:
            return Reaction(ZERO, 0.0, True)
        # The root is before the pole of `resolve`.
        farthest = 0.5 * abs(surface.farthest_push())
        low, high = 0.0, math.copysign(min(abs(f_low), (1.0 - 1e-12) * farthest), -f_low)
        f_high = _residual(law, surface, r, c, high)
        kappa, found = high, f_low * f_high <= 0.0
        for _i in range(_CAREFUL_ITERATIONS):
            if not found or f_high == 0.0 or abs(high - low) <= 2.0 * EPSILON * abs(high):
                break
            kappa = illinois(low, f_low, high, f_high)
            low, f_low, high, f_high = narrowed(low, f_low, high, f_high, kappa, _residual(law, surface, r, c, kappa))
        return Reaction(r - surface.resolve(r, kappa), 0.0, found)


# --- The rule --------------------------------------------------------------------------------------------


class RuleStep(NamedTuple):
    """r1, v1 and the change of the velocity by the walls."""

    r: Vec
    v: Vec
    kick: Vec


class RuleNumbers(fixed_step.SoftNumbers):
    """An implicit rule in the form for kernels: the part of a step at its point, `reach`, and the methods below."""

    def end(self, before, gravity, lane, s, push):
        """Return the `RuleStep` from the point s and `push`, kappa grad q(s), with the walls at its start."""
        raise NotImplementedError

    def add_impulses(self, walls, lane, reactions, impulse, i):
        """Add the impulse per mass of each wall to impulse[wall, i], its work to the rows behind; return all work."""
        raise NotImplementedError

    def free(self, walls, gravity, lane):
        """Return the point without forces at it."""
        return lane.r + self.reach(self.at_start(walls, lane.remaining), gravity, lane)

    def there(self, walls, lane):
        """Return the walls when the particle is at the point."""
        return walls.at((lane.remaining - self.point) * self.dt)

    def most_sweeps(self, walls):
        return _SWEEPS

    def guess(self, walls, gravity, lane, wall):
        r = self.free(walls, gravity, lane)
        touching = wall >= 0.0
        kappa = self.there(walls, lane).of(wall, 0.0, _guess, self.law, r, lane.own.over_mass)
        return select(touching, kappa, 0.0), touching

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        r, kappa = self.free(walls, gravity, lane), solution.kappa
        there = self.there(walls, lane)
        step, more = there.of(wall, (0.0, False), _improve, self.law, r, lane.own.over_mass, kappa)
        return select(solution.unsolved, kappa - step, kappa), solution.unsolved & more, contract.NO_RECORD

    def contact(self, walls, gravity, lane, wall, solution):
        r, there = self.free(walls, gravity, lane), self.there(walls, lane)
        before, over, after = self.times(walls, lane.remaining)
        point = _reached(there, wall, r, solution.kappa)
        step = self.end(before, gravity, lane, point, r - point)
        touching = wall >= 0.0
        # An unsolved equation, or another wall at s or at the end, needs the careful way.
        solved = (not solution.unsolved) & (not there.outside(wall, point)) & (not after.outside(wall, step.r))
        solved = solved & (not self.passes(walls, lane, wall, step.r, step.v))
        # The midpoint rule may end outside before it feels a force; of several walls the careful way finds which.
        unfelt = (not touching) & (lane.remaining > 0.0) & after.outside(-1.0, step.r)
        new = (touching | unfelt) & (not before.outside(-1.0, lane.r))
        wall = select(unfelt & (walls.length() > 1), min(wall, contract.HARD), wall)
        # One wall alone contributes to the kick.
        work = self.work_along(over, wall, -1.0 / self.dt * step.kick, (lane.r, step.r))
        taken = fixed_step.Taken(step.r, step.v, solved, select(touching, norm(step.kick), 0.0), new, work)
        return fixed_step.contact(lane, wall, taken)

    def careful_step(self, walls, gravity, lane, impulse, i):
        before = self.at_start(walls, lane.remaining)
        free = Step(lane.r, self.reach(before, gravity, lane), lane.own.over_mass)
        reactions = scratch((walls.length(), 4), np.float64)
        point, solved = corner.hold(_AtEnd(), self.law, None, self.there(walls, lane), free, reactions)
        work = self.add_impulses(walls, lane, reactions, impulse, i)
        step = self.end(before, gravity, lane, point, corner.total(reactions))
        return fixed_step.Careful(step.r, step.v, solved, work)


class MidpointNumbers(RuleNumbers):
    """The midpoint rule."""

    point = 0.5

    def reach(self, before, gravity, lane):
        # rm = r0 + h/2 v0 + h^2/4 a(rm)
        return 0.5 * self.dt * accelerated(gravity, lane.v, 0.5 * self.dt)

    def end(self, before, gravity, lane, s, push):
        # r1 = 2 rm - r0, v1 = v0 + h G - (4/h) kappa grad q(rm)
        kick = 4.0 / self.dt * push
        return RuleStep(2.0 * s - lane.r, accelerated(gravity, lane.v, self.dt) - kick, kick)

    def add_impulses(self, walls, lane, reactions, impulse, i):
        h = self.dt
        corner.add_reaction_impulses(reactions, 0.5 * h, impulse, i)
        return corner.add_reaction_works(
            self.moving, self.over(walls, lane.remaining), -4.0 / (h * h), reactions, (lane.r, lane.r), impulse, i
        )


class TrapezoidalNumbers(RuleNumbers):
    """The trapezoidal rule."""

    def reach(self, before, gravity, lane):
        # r1 = r0 + h v0 + h^2/2 G + h^2/(4m) (F0 + F1)
        return displacement(gravity, lane.v, self.dt) + lane.own.over_mass * walls_force(before, self.law, lane.r)

    def end(self, before, gravity, lane, s, push):
        # v1 = v0 + h G + h/(2m) F0 - (2/h) kappa grad q(r1)
        kick = 2.0 / self.dt * (push - lane.own.over_mass * walls_force(before, self.law, lane.r))
        return RuleStep(s, accelerated(gravity, lane.v, self.dt) - kick, kick)

    def add_impulses(self, walls, lane, reactions, impulse, i):
        h, law, moving = self.dt, self.law, self.moving
        before, over = self.at_start(walls, lane.remaining), self.over(walls, lane.remaining)
        corner.add_reaction_impulses(reactions, h, impulse, i)
        # h/(2m) |F0|
        factor = 2.0 * lane.own.over_mass / h
        add_impulses(before, law, factor, lane.r, impulse, i)
        work = add_works(moving, over, before, law, factor / h, lane.r, impulse, i)
        return work + corner.add_reaction_works(moving, over, -2.0 / (h * h), reactions, (lane.r, lane.r), impulse, i)


# --- The description for users ---------------------------------------------------------------------------


class ImplicitRule(fixed_step.SoftWalls):
    """A method with an implicit rule."""

    rule: ClassVar[type[RuleNumbers]]

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        return *super().needs(scene), *FORCE_NEEDS, "resolve", "farthest_push"

    def numbers(self, scene: Scene) -> fixed_step.SoftNumbers:
        # h^2/(4m) of equation (I)
        return self.record(self.rule, scene, 0.25 * self.dt * self.dt)


@dataclass(frozen=True)
class Midpoint(ImplicitRule):
    """Implicit midpoint rule with a penalty contact: a baseline, not for results.

    rm = (r0 + r1)/2,   r1 = r0 + h (v0 + v1)/2,   v1 = v0 + h a(rm),   a = G - V'(g) grad g/m.

    Args:
        dt: step h > 0 [s]; frames must fall on whole steps.
        penalty: alpha > 0, the stiffness of the wall (N/m for a = 1 and a gap in m).
        exponent: a >= 1 of the regularisation: 1 a linear spring, 1.5 Hertz's law.

    Raises:
        SceneError: an argument is out of its range; a frame time is not a whole number of steps.

    Conserves: quadratic invariants only, so the energy of a linear spring that never lets go, but not that of a contact
    that begins and ends: each changes the energy by the error of the force at the middle of a step. No stability limit.
    Order: 2 in dt. Cost: free steps, which it takes exactly, are jumped over in one evaluation; a
    contact step solves one scalar equation.
    Walls may move without turning: the force is that of the walls at the middle of the step.
    Source: Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.1.

    >>> Midpoint(dt=1e-3, penalty=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: penalty must be above 0, got -1
    """

    rule = MidpointNumbers


@dataclass(frozen=True)
class Trapezoidal(ImplicitRule):
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

    rule = TrapezoidalNumbers
