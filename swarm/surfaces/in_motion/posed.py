"""A wall that moves, at one instant or over one step: calls are forwarded to the surface in the frame of the wall.

A flight to a wall in uniform translation ends as at a wall at rest; to any other it takes safe steps, safe.py.

In the frame of a wall that is displaced by d(t) and does not turn a step goes from rho0 = r0 - d0 by
rho1 - rho0 = r1 - r0 - (d1 - d0): it is a step at a wall at rest, with the free displacement p - (d1 - d0).
"""

from typing import Any

from ...kernel.elementary import sine_and_versine
from ...kernel.jit import select
from ...kernel.vector import ZERO, Vec, absolute, cross, dot, norm, times, total
from ..frames import Framed
from ..time_of_impact import safe
from ..time_of_impact.rising import flight_of
from ..walls import Field, Walls
from .drive import Drive, PoseDerivatives


class Posed(Framed):
    """A wall at one instant, or over one step, or a field of them."""

    body: Any
    pose: PoseDerivatives
    end: PoseDerivatives  # at the end of the step
    drive: Drive
    remaining: float  # left of the frame [s]
    after: float  # left of the frame at the end of the step [s]

    def wall(self, number):
        """Return one of the walls of a field."""
        return self._replace(body=self.body.wall(number))

    def later(self, t):
        """Return the wall, or field, after a time [s]."""
        remaining = self.remaining - t
        pose = self.drive.pose(remaining)
        return self._replace(pose=pose, end=pose, remaining=remaining, after=remaining)

    # --- The frame of the wall ---

    def own_place(self, r):
        """Return a point in the frame of the wall."""
        return self.pose.place_back(self.drive.center, r)

    def own_end(self, r):
        """Return a point in the frame of the wall, at the end of the step."""
        return self.end.place_back(self.drive.center, r)

    def own_velocity(self, r, v):
        """Return the velocity of a particle in the frame of the wall."""
        w = v - self.pose.velocity
        return w if self.pose.turn is None else self.pose.back(w) - cross(self.drive.spin, self.pose.back(self.arm(r)))

    def own_pull(self, r, v, pull):
        """Return the acceleration of a free particle in the frame of the wall."""
        at_rest = pull is ZERO and self.pose.acceleration is ZERO
        felt = ZERO if at_rest else pull - self.pose.acceleration
        if self.pose.turn is None:
            return felt
        # The accelerations of a rotating frame, -2 w x v - w x (w x a), where it turns about the same axis
        spin, arm = self.drive.spin, self.pose.back(self.arm(r))
        turns = cross(2.0 * self.own_velocity(r, v) + cross(spin, arm), spin)
        return turns if at_rest else self.pose.back(felt) + turns

    def arm(self, r):
        """Return the vector from the centre of the rotation to a point."""
        return r - self.drive.center - self.pose.shift

    def arm_length(self, r):
        """Return the distance of a point from the centre of the rotation; 0 if the frame does not turn."""
        return 0.0 if self.pose.turn is None else norm(self.arm(r))

    def middle(self):
        """Return the middle of the step, as a time since the end of the frame."""
        return -0.5 * (self.remaining + self.after)

    place_in, end_in = own_place, own_end

    def place_out(self, r):
        return self.pose.place_out(self.drive.center, r)

    def end_out(self, r):
        """Return a point of the frame of the wall at the end of the step, in the scene."""
        return self.end.place_out(self.drive.center, r)

    def vector_out(self, a):
        return self.pose.out(a)

    def way_in(self, p):
        """Return the free displacement of a step in the frame of a wall that does not turn."""
        return p - self.displacement()

    def normal_out(self, n):
        """Return a normal of a step, from the frame of the wall, in the scene."""
        if self.pose.turn is None:
            return n
        # rho1 - rho0 = M^-1 (r1 - r0 - way) with M = (A0 + A1)/2, so n becomes M^-T n = M S^-2 n, where S is cos(a/2)
        # across the axis and 1 along it, with the angle a of the step.
        k = self.drive.turn.axis
        _sine, versine = sine_and_versine(self.drive.turn.rate * (self.remaining - self.after))
        along = dot(k, n) * k
        n = along + (n - along) * (1.0 / (1.0 - 0.5 * versine))
        return 0.5 * (self.pose.out(n) + self.end.out(n))

    # --- At this instant ---

    # A rotation that leaves the surface unchanged still turns its material.

    def velocity(self, r):
        moved, spin = self.pose.velocity, self.drive.spin
        return moved if spin is None else moved + cross(spin, self.arm(r))

    def acceleration(self, r):
        moved, spin = self.pose.acceleration, self.drive.spin
        return moved if spin is None else moved + cross(spin, cross(spin, self.arm(r)))

    def outward_acceleration(self, r, v, pull):
        own_v, own_pull = self.own_velocity(r, v), self.own_pull(r, v, pull)
        return self.body.outward_acceleration(self.own_place(r), own_v, own_pull)

    def time_scale(self):
        return self.drive.time_scale

    # --- Flight ---

    accelerates = True

    def seen(self, flight, t):
        return flight.seen(t, self.later(t), flight.pull)

    def sees(self, gravity, r, v):
        """Return a particle in the frame of the wall now, as `Seen`."""
        return self.seen(flight_of(r, v, gravity, self.remaining), 0.0)

    def first_hit(self, r, v):
        return self.falling_hit(r, v, None)

    def falling_hit(self, r, v, pull):
        found = safe.march_alone(Walls((self,)), r, v, pull, self.remaining)
        return found.time, found.wall >= 0.0

    def field_hit(self, gravity, r, v):
        """Return the first `Hit` with the bodies of a field, or the time until which the flight is surely free."""
        return safe.march_alone(Walls((Field(self),)), r, v, gravity, self.remaining)

    def until_next_cell(self, r, v):
        """Return when a straight flight may meet another body of a field."""
        return safe.until_next_cell(self.body, self.sees(None, r, v), self.remaining)

    is_quartic, may_be_far, has_levels, leaves_once = False, True, False, False
    in_steps, kept, aims, fall_powers, looked_at = False, 0, False, 0, False

    def safe_time(self, r, v, pull):
        return 0.0

    def steps(self, gravity, r, v):
        return None

    def straight_hit(self, end, r0, r1):
        own = self.own_place(r0)
        return self.body.first_hit(own, end.own_place(r1) - own)

    # --- Over the step ---

    def displacement(self):
        return self.end.shift - self.pose.shift

    def carry(self, r):
        spin = self.drive.spin
        if spin is None:
            return self.end.shift - self.pose.shift + r
        rate = norm(spin)
        k = spin / select(rate > 0.0, rate, 1.0)
        sine, versine = sine_and_versine(rate * (self.remaining - self.after))
        before = self.arm(r)
        after = before + versine * (dot(k, before) * k - before) + sine * cross(k, before)
        return self.drive.center + self.end.shift + after

    def mean_velocity(self, r0, r1, h):
        drive, middle = self.drive, self.middle()
        moved = drive.mean_velocity(middle, h)
        if drive.turn is None:
            return moved
        mean = 0.5 * (self.own_place(r0) + self.own_end(r1)) - drive.center
        return moved + drive.turn.mean_velocity(middle, h, mean)

    def gap_scale(self, r):
        # A place in the frame has the round-off of the displacement and of the time too.
        own = self.own_place(r)
        gradient, late = self.body.gradient(own), self.drive.late
        moved = total(absolute(times(gradient, self.pose.shift))) + late * total(absolute(gradient))
        return self.body.gap_scale(own) + moved

    def place_scale(self, s):
        late = self.drive.late
        return s + absolute(self.pose.shift) + Vec(late, late, late)

    def framed(self, r, p):
        return self.body, self.own_place(r), self.way_in(p)

    def step_normal(self, r0, r1):
        n = self.normal_out(self.body.step_normal(self.own_place(r0), self.own_end(r1)))
        return n if self.pose.turn is None else n / norm(n)


class Drifting(Posed):
    """A `Posed` wall in uniform translation: a flight ends as at a wall at rest."""

    def velocity_in(self, v):
        """Return a velocity in the frame of the wall."""
        return v - self.pose.velocity

    def vector_in(self, a):
        """Return an acceleration in the frame of the wall."""
        return a

    gravity_in = vector_in
    accelerates = False
    is_quartic = property(lambda self: self.body.is_quartic)
    may_be_far = property(lambda self: self.body.may_be_far)

    def steps(self, gravity, r, v):
        # As at a wall at rest if the level is known as a whole; otherwise lanes call for the hit.
        return Framed.steps(self, gravity, r, v) if gravity is not None and self.is_quartic else None

    first_hit, falling_hit, safe_time = Framed.first_hit, Framed.falling_hit, Framed.safe_time
    field_hit, until_next_cell = Framed.field_hit, Framed.until_next_cell  # type: ignore[attr-defined]
