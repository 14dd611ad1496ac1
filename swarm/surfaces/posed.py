"""A wall that moves, at one instant or over one step: every function of a surface, asked in the frame of the wall.

Of a flight only a wall in uniform translation is asked: it ends there as at a wall at rest.
"""

from typing import Any

from ..kernel.record import Record
from ..kernel.vector import cross, norm
from . import contract
from .drive import Drive, Pose


class Posed(contract.Smooth):
    """A wall at one instant, or over one step, or a field of them."""

    body: Any
    pose: Pose
    end: Pose  # at the end of the step
    drive: Drive
    left: float  # of the frame [s]
    after: float  # of the frame, at the end of the step [s]

    # --- Of a field: see `Members` ---

    def count(self):
        return self.body.count()

    def wall(self, number):
        return self._replace(body=self.body.wall(number))

    def is_in_another(self, number, r):
        return self.body.is_in_another(number, self.own_place(r))

    def count_in_cell(self, r):
        return self.body.count_in_cell(self.own_place(r))

    def list_in_cell(self, k, before, r, into):
        return self.body.list_in_cell(k, before, self.own_place(r), into)

    def one_in_cell(self, k, r):
        return self.body.one_in_cell(k, self.own_place(r))

    def deepest_in_cell(self, r):
        return self.body.deepest_in_cell(self.own_place(r))

    # --- The frame of the wall ---

    def own_place(self, r):
        """A point in the frame of the wall."""
        return self.pose.place_back(self.drive.center, r)

    def own_end(self, r):
        """A point in the frame of the wall, at the end of the step."""
        return self.end.place_back(self.drive.center, r)

    def own_velocity(self, r, v):
        """The velocity of a particle in the frame of the wall."""
        return self.pose.back(v - self._velocity(r))

    def own_pull(self, r, v, pull):
        """The acceleration of a free particle in the frame of the wall."""
        felt = pull - self.pose.acceleration
        if self.pose.turn is None:
            return felt
        spin, w = self.drive.spin, v - self._velocity(r)
        # The accelerations of a rotating frame, -2 w x v - w x (w x a)
        return self.pose.back(felt + -1.0 * (2.0 * cross(spin, w) + cross(spin, cross(spin, self.arm(r)))))

    def _velocity(self, r):
        """The velocity of the frame at a point."""
        moved = self.pose.velocity
        return moved if self.pose.turn is None else moved + cross(self.drive.spin, self.arm(r))

    def arm(self, r):
        """From the centre of the rotation to a point."""
        return r - self.drive.center - self.pose.shift

    def arm_length(self, r):
        """The distance of a point from the centre of the rotation; 0 where the frame does not turn."""
        return 0.0 if self.pose.turn is None else norm(self.arm(r))

    def middle(self):
        """The middle of the step, from the end of the frame on."""
        return -0.5 * (self.left + self.after)

    def settle(self, r):
        return self.pose.place_out(self.drive.center, self.body.settle(self.own_place(r)))

    def outward_acceleration(self, r, v, pull):
        own_v, own_pull = self.own_velocity(r, v), self.own_pull(r, v, pull)
        return self.body.outward_acceleration(self.own_place(r), own_v, own_pull)

    def pace(self):
        return self.drive.pace

    def velocity(self, r):
        moved, spin = self.pose.velocity, self.drive.spin
        return moved if spin is None else moved + cross(spin, self.arm(r))

    def acceleration(self, r):
        moved, spin = self.pose.acceleration, self.drive.spin
        return moved if spin is None else moved + cross(spin, cross(spin, self.arm(r)))


class Drifting(Posed):
    """The same of a wall in uniform translation: a flight ends as at a wall at rest."""

    def own_flight(self, r, v):
        """Place and velocity of a particle in the frame of the wall."""
        return r - self.pose.shift, v - self.pose.velocity

    def field_hit(self, gravity, r, v):
        return self.body.field_hit(gravity, *self.own_flight(r, v))

    def until_next_cell(self, r, v):
        return self.body.until_next_cell(*self.own_flight(r, v))

    @property
    def is_quartic(self):
        return self.body.is_quartic

    @property
    def may_be_far(self):
        return self.body.may_be_far

    def first_hit(self, r, v):
        return self.body.first_hit(*self.own_flight(r, v))


def straight_hit(surface, end, r0, r1):
    """When a straight way from r0 at one instant to r1 at another meets a wall, which is `end` there."""
    if not isinstance(surface, Posed):
        return surface.first_hit(r0, r1 - r0)
    own = surface.own_place(r0)
    return surface.body.first_hit(own, end.own_place(r1) - own)


# --- Its functions ---------------------------------------------------------------------------------------


def _of(made: Any, *functions: Any, kind: type = Posed) -> None:
    for function in functions:
        function.register(kind, made(function))


_of(lambda f: lambda surface: f(surface.body), contract.flat, contract.chord_sweeps, contract.farthest_push)
_of(lambda f: lambda surface, q: f(surface.body, q), contract.gap_of, contract.level_of)
_of(lambda f: lambda surface, q0, q1: f(surface.body, q0, q1), contract.gap_slope)
_of(
    lambda f: lambda surface, r: f(surface.body, surface.own_place(r)),
    contract.phi, contract.inner, contract.distance,
)  # fmt: skip
_of(
    lambda f: lambda surface, r: surface.pose.out(f(surface.body, surface.own_place(r))),
    contract.gradient, contract.slope, contract.unit_normal,
)  # fmt: skip


# A rotation that leaves the surface as it is turns what it is made of.


# --- Flight ----------------------------------------------------------------------------------------------

_of(
    lambda f: lambda surface, r, v, pull: f(surface.body, *surface.own_flight(r, v), pull),
    contract.falling_hit, contract.course, contract.safe_time, kind=Drifting,
)  # fmt: skip
