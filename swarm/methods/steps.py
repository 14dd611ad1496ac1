"""The steps of `AugmentedLagrangian`: of fixed length, or cut at the instant of impact, or centred about it.

Each kind of step gives the end of a flight, the length of its contact step, whether another wall takes part in it,
and the exact impacts that replace it.
"""

import math
from typing import Any

import numpy as np

from ..common.status import Status
from ..contact import uzawa
from ..contact.discrete_gradient import MeanValue
from ..contact.impulse import Step
from ..contact.laws import NONE
from ..contact.reflection import Energy, chord, exact
from ..contact.touching import ImpactSettings, ParticleMoment, impact
from ..kernel.arrays import kept, scratch
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import outlined, select
from ..kernel.vector import square
from ..surfaces.lowered import as_met, lowered
from ..surfaces.time_of_impact import flights
from . import base, contract, penalty

RAISE, COUNT, IMPACT = 0, 1, 2
# A second wall nearer than this fraction of the shortest flight is met at the same instant.
_SAME_INSTANT = 1e-6
# Exact impacts within one step that replace a contact; a step of this many is stuck in a corner.
_MOST_BOUNCES = 1000
# A |v|^2 that differs from its first value by more than this has lost energy to a tolerance, which must not be hidden.
_ROUND_OFF = 1e-13


class StepNumbers(penalty.GradientSteps):
    """The method in the form for kernels, and the methods that differ between its kinds of steps."""

    multiplies = True
    # Of 1/mass in the numbers of a lane.
    factor = 0.5
    dt: float
    law: Any
    form: Any  # of the discrete gradient
    shortest_length: float  # of the flights of particles that graze where a step is not possible [m]
    tolerance: float
    max_sweeps: int
    acceleration: float
    policy: int
    longest: Any  # longest step that jumps over no solid and out of a cell only to known walls [m]; None without solids
    moving: Any  # `Moves` if a wall moves, in fixed steps, else None
    ends: Any  # the `Laws` of its walls, which act where a contact ends, or None

    @property
    def size(self):
        """The size of the scene [m]."""
        return self.shortest_length / base.SHORTEST

    def is_alone(self, met, after, start, r1, kappa):
        """Whether only the wall that is `met` (walls, number) takes part in the step from `start` to r1.

        `after` are the walls at the end of the step. Then one lane can do the step alone.
        """
        raise NotImplementedError

    def is_blocked(self, met, held, start, h):
        """Whether the chord on the wall that is `met` meets another wall later in the step, or passes by a solid.

        `held` are the walls and the number of the wall in the form that the step takes.
        """
        return False

    def start(self, lane):
        """Return the lane at the start of its contact step."""
        return lane

    def held(self, walls, start, wall):
        """Return the walls, and the number of one, in the form that the step from the lane `start` takes."""
        return walls, wall

    def ended(self, lane, contact):
        """Return the contact, with the time left of the frame of the lane."""
        return contact

    def as_impacts(self, walls, lane, cut, wall, lanes, i):
        """Make the contact by exact impacts; return the result of `hard_pass`."""
        raise NotImplementedError

    # --- The unknown of a contact ---

    def guess(self, walls, gravity, lane, wall):
        start = self.start(lane)
        walls, wall = self.held(walls, start, wall)
        return penalty.GradientSteps.guess(self, walls, gravity, start, wall)

    def improve(self, walls, gravity, lane, wall, solution, multiplier):
        start = self.start(lane)
        walls, wall = self.held(walls, start, wall)
        return penalty.GradientSteps.improve(self, walls, gravity, start, wall, solution, multiplier)

    def free(self, gravity, lane, h):
        return Step(lane.r, displacement(gravity, lane.v, h), lane.own.over_mass * h * h)

    def over_mass(self, lane):
        return 2.0 * lane.own.over_mass

    # --- Uzawa's loop (8) ---

    @property
    def multiplier_sweeps(self):
        return self.max_sweeps

    def first_multiplier(self, walls, gravity, lane, wall, kappa):
        lane = self.start(lane)
        walls, wall = self.held(walls, lane, wall)
        cut, over = self.cut(lane.remaining), self.over(walls, lane.remaining)
        better, multiplier = uzawa.reflection(over, wall, cut.law, self.free(gravity, lane, cut.h))
        use = (self.acceleration == uzawa.REFLECTION) & (multiplier > 0.0)
        limited = over.of(wall, False, uzawa.has_limit, cut.law, lane.r)
        return select(use, multiplier, 0.0), select(use, better, kappa), select(limited, self.acceleration, uzawa.PLAIN)

    def next_multiplier(self, lane, acceleration, multiplier, record, before):
        miss = self.cut(self.start(lane).remaining).law.alpha * record.mean
        following = uzawa.next_multiplier(acceleration, multiplier, miss, before.multiplier, before.miss)
        return following, miss, not (record.stored <= self.tolerance)

    # --- Contact ---

    def contact(self, walls, gravity, lane, wall, solution):
        return self.ended(lane, self._step(walls, gravity, self.start(lane), wall, solution))

    def _step(self, walls, gravity, lane, wall, solution):
        """Return the `Contact` of a lane at the start of its step."""
        cut, kappa = self.cut(lane.remaining), solution.kappa
        held, number = self.held(walls, lane, wall)
        end = self.pushed(held, gravity, lane, number, cut.h, kappa)
        alone = self.is_alone((walls, wall), end.after, lane, end.r, kappa)
        solved = alone & (not solution.unsolved) & end.over.pushes(number, kappa)
        touching = wall >= 0.0
        step = (lane.remaining > 0.0) & touching & solved
        new = step & (not self.is_outside(end.over, wall, lane.r))
        work = select(step, end.work, 0.0)
        # A step without contact: only fixed steps end here without one, just before a contact.
        loose = (lane.remaining > 0.0) & (wall > contract.HARD) & (not touching)
        return contract.Contact(
            select(step | loose, end.r, kept(lane.r)),
            select(step, end.v, select(loose, accelerated(gravity, lane.v, cut.h), kept(lane.v))),
            lane.remaining - select(step | loose, cut.used, 0.0),
            select(touching & (not solved), contract.HARD - wall, wall),
            select(step, end.impulse, 0.0),
            select(new, 1.0, 0.0),
            lane.own.twice_energy + 2.0 * work,
            False,
            work,
        )

    @outlined
    def hard_pass(self, walls, gravity, lane, wall, lanes, i):
        start = self.start(lane)
        held, number = self.held(walls, start, wall)
        cut, record = self.cut(start.remaining), lanes.record
        h, over = cut.h, self.over(held, start.remaining)
        if self.is_blocked((walls, wall), (held, number), start, h):
            record[uzawa.SWEEPS, i] = 0.0
            return self.as_impacts(walls, lane, cut, wall, lanes, i)
        free = self.free(gravity, start, h)
        if self.is_too_fast(free.p):
            return contract.refused(lane, Status.TOO_FAST.value)
        reactions = scratch((walls.length(), 4), np.float64)
        end = uzawa.loop(self, cut.law, over, free, reactions)
        record[uzawa.SWEEPS, i], record[uzawa.STORED, i] = end.sweeps, end.stored
        record[uzawa.UNCONVERGED, i] = 0.0 if end.converged else 1.0
        if not end.converged and self.policy == IMPACT:
            return self.as_impacts(walls, lane, cut, wall, lanes, i)
        if not end.converged and (self.policy == RAISE or not end.solved):
            return contract.refused(lane, Status.UNCONVERGED.value if end.solved else Status.UNSOLVED.value)
        # Contacts of steps into walls are counted where the impulses of all walls are known.
        new = 0.0 if self.steps_into_walls else 1.0
        pushed = self.reacted(held, gravity, start, h, end.r, reactions, lanes.impulse, i)
        remaining, twice_energy = start.remaining - cut.used, start.own.twice_energy + 2.0 * pushed.work
        contact = contract.Contact(pushed.r, pushed.v, remaining, wall, 0.0, new, twice_energy, False)
        return self.ended(lane, contact), Status.DONE.value


@outlined
def _first_energy(lane):
    """Return the energy at the start of the run if it is the present one up to round-off, else the present one."""
    now, first = square(lane.v), lane.own.twice_energy
    speed2 = first if abs(first - now) <= _ROUND_OFF * now else now
    return Energy(speed2, 0.5 / speed2)


def _after(r, v, remaining, hits):
    """Return the contact; its impulses were added one by one."""
    return contract.Contact(r, v, remaining, 0.0, 0.0, hits, 0.0, False)


class FixedSteps(StepNumbers):
    """The method with steps of fixed length."""

    def is_alone(self, met, after, start, r1, kappa):
        return not after.outside(met[1], r1)

    def is_outside(self, walls, wall, r):
        # The next step pushes the particle again from there, whether or not the loop of this one has converged.
        return walls.of(wall, False, uzawa.is_outside, r)

    @outlined
    def as_impacts(self, walls, lane, cut, wall, lanes, i):
        if self.moving is not None:
            # The checks before the run refuse this case.
            return contract.refused(lane, Status.UNCONVERGED.value)
        energy, r, v = _first_energy(lane), lane.r, lane.v
        walls, remaining = self.at_start(walls, lane.remaining), cut.h
        for _i in range(_MOST_BOUNCES):
            hit = flights.first_hit(walls, None, r, v)
            t = min(hit.time, remaining)
            r, remaining = r + t * v, remaining - t
            if not hit.time < math.inf or remaining <= 0.0:
                return _after(r, v, lane.remaining - cut.used, 0.0), Status.DONE.value
            if hit.wall < 0.0:
                continue
            bounce = exact(NONE, walls, None, hit.wall, r, v, energy)
            v = bounce.v
            lanes.impulse[int(hit.wall), i] += bounce.impulse
        return _after(r, v, lane.remaining, 0.0), Status.STALLED.value


class CutSteps(StepNumbers):
    """The method with steps that begin at the impact, without gravity."""

    looks_around = True

    def seconds(self, remaining):
        return remaining

    def cut(self, remaining):
        # The rate of the loop depends on alpha h^2, its fixed point does not: a step that the frame cuts gets a larger
        # alpha.
        h = select(self.dt < remaining, self.dt, remaining)
        part = self.dt / h
        return penalty.ContactStep(h, h, self.law.stiffened(part * part))

    def is_outside(self, walls, wall, r):
        # A contact is one step.
        return False

    def held(self, walls, start, wall):
        # In a field the member that is met, with its number as its row; in a union the room.
        if len(walls.fields()) == 0 and len(walls.unions) == 0:
            return walls, wall
        return as_met(walls, wall), select(wall < 0.0, wall, 1.0 * walls.row(wall))

    def is_alone(self, met, after, start, r1, kappa):
        # Fixed steps look at their ends only; these follow the chord. A solid that it passes by (kappa = 0, the free
        # flight ends outside it again) was hit all the same.
        walls, wall = met
        free = (flights.other_hit(walls, wall, start.r, r1 - start.r, 1.0).time > 1.0) & (kappa != 0.0)
        return free & walls.keeps(wall, r1) & (not self.is_too_fast(r1 - start.r))

    def is_blocked(self, met, held, start, h):
        (walls, wall), (taken, number) = met, held
        r, p = start.r, h * start.v
        kappa = chord(taken, number, r, p)
        r1 = taken.push(number, r, p, kappa)
        other = flights.other_hit(walls, wall, r, r1 - r, 1.0)
        # Another wall that the particle is also on takes part in the loop; one that is a little away is met later.
        later = other.time <= 1.0 and not _is_held_by(walls, other.wall, self.law, r)
        later = later or not walls.keeps(wall, r1) or uzawa.meets_later(taken, number, self.law, r, p)
        return not taken.pushes(number, kappa) or kappa == 0.0 or later

    @outlined
    def as_impacts(self, walls, lane, cut, wall, lanes, i):
        energy = _first_energy(lane)
        shortest = self.shortest_length / math.sqrt(energy.twice)
        contacts = ImpactSettings(None, NONE, shortest, _SAME_INSTANT * self.shortest_length)
        end = impact(
            contacts, walls, None, wall, ParticleMoment(lane.r, lane.v, lane.remaining), energy, lanes.impulse, i
        )
        return _after(end.r, end.v, lane.remaining - end.used, 1.0), Status.DONE.value

    def land(self, walls, gravity, lane, hit):
        met = hit.time <= lane.remaining
        t = select(met, hit.time, lane.remaining)
        r = lane.r + t * lane.v
        remaining = lane.remaining - t
        # A hit in the last instant of a frame is met again in the next one.
        met = met & (hit.wall >= 0.0) & (remaining > 0.0)
        wall = select(isinstance(self.form, MeanValue), contract.HARD - hit.wall, hit.wall)
        return contract.FlightEnd(
            select(met, walls.project(hit.wall, r), r), lane.v, remaining, select(met, wall, -1.0)
        )


class CentredSteps(CutSteps):
    """Steps with their middle at the impact, where the lane is, in State I of the level on which they begin."""

    asks_flown = True

    def half(self, lane):
        """Return half the length of the contact step."""
        return base.centred_half(self.dt, lane)

    def start(self, lane):
        half = self.half(lane)
        return lane._replace(r=lane.r - half * lane.v, remaining=2.0 * half)

    def held(self, walls, start, wall):
        walls, wall = CutSteps.held(self, walls, start, wall)
        return lowered(walls, wall, start.r), wall

    def ended(self, lane, contact):
        half = self.half(lane)
        step = contact.remaining < 2.0 * half
        return contact._replace(
            r=select(step, contact.r, kept(lane.r)), v=select(step, contact.v, kept(lane.v)),
            remaining=lane.remaining - select(step, half, 0.0),
        )  # fmt: skip

    def guess(self, walls, gravity, lane, wall):
        kappa, touching = CutSteps.guess(self, walls, gravity, lane, wall)
        # The exact impact replaces a step of zero length.
        there = touching & (self.half(lane) > 0.0)
        return select(there, kappa, 0.0), there

    def is_alone(self, met, after, start, r1, kappa):
        free = (start.remaining > 0.0) & _is_free(met[0], start, r1) & (kappa != 0.0)
        return free & (not self.is_too_fast(r1 - start.r))

    def is_blocked(self, met, held, start, h):
        if not h > 0.0:
            return True
        walls, wall = held
        p = h * start.v
        kappa = chord(walls, wall, start.r, p)
        free = _is_free(met[0], start, walls.push(wall, start.r, p, kappa))
        later = uzawa.meets_later(walls, wall, self.law, start.r, p)
        return not walls.pushes(wall, kappa) or kappa == 0.0 or not free or later


def _is_free(walls, start, r1):
    """Whether no wall is between the impact, which is the middle of the step from `start`, and its end r1."""
    middle = start.r + 0.5 * start.remaining * start.v
    return flights.is_free(walls, middle, r1 - middle, 1.0)


def _is_held_by(walls, wall, law, r):
    """Whether a wall takes part in the loop of a step from r: the particle is on it, and it is no member of a field."""
    return wall >= walls.count_in_fields() and walls.of(wall, False, uzawa.has_limit, law, r)
