"""A wall that moves, at one instant or over one step: every function of a surface, asked in the frame of the wall.

Of a flight only a wall in uniform translation is asked: it ends there as at a wall at rest.
"""

from typing import Any

from ..kernel.jit import by_type, inlined
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, cross, dot, norm
from . import contract
from .drive import Drive, Pose, Rows


class Posed(Record):
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
        return self.body.is_in_another(number, own_place(self, r))

    def count_in_cell(self, r):
        return self.body.count_in_cell(own_place(self, r))

    def list_in_cell(self, k, before, r, into):
        return self.body.list_in_cell(k, before, own_place(self, r), into)

    def one_in_cell(self, k, r):
        return self.body.one_in_cell(k, own_place(self, r))

    def deepest_in_cell(self, r):
        return self.body.deepest_in_cell(own_place(self, r))


class Drifting(Posed):
    """The same of a wall in uniform translation: a flight ends as at a wall at rest."""

    def first_hit(self, gravity, r, v):
        return self.body.first_hit(gravity, r - self.pose.shift, v - self.pose.velocity)

    def until_next_cell(self, r, v):
        return self.body.until_next_cell(r - self.pose.shift, v - self.pose.velocity)


# --- The frame of a wall ---------------------------------------------------------------------------------


@by_type
def _back(turn, a):
    """A vector of the scene in the frame of the wall."""
    return a


@by_type
def out(turn, a):
    """A vector of the frame of the wall in the scene."""
    return a


_back.register(Rows, lambda turn, a: turn.x * a.x + turn.y * a.y + turn.z * a.z)
out.register(Rows, lambda turn, a: Vec(dot(turn.x, a), dot(turn.y, a), dot(turn.z, a)))


@by_type
def _place(turn, center, a):
    """c + A^T (a - c) of a point, less its displacement."""
    return a


@by_type
def _scene_place(turn, center, a):
    """c + A (a - c)"""
    return a


_place.register(Rows, lambda turn, center, a: center + _back(turn, a - center))
_scene_place.register(Rows, lambda turn, center, a: center + out(turn, a - center))


@inlined
def own_place(surface, r):
    """A point in the frame of the wall, at the start of the step."""
    return _place(surface.pose.turn, surface.drive.center, r - surface.pose.shift)


@inlined
def own_end(surface, r):
    """A point in the frame of the wall, at its end."""
    return _place(surface.end.turn, surface.drive.center, r - surface.end.shift)


@inlined
def arm(surface, r):
    """From the centre of the rotation to a point."""
    return r - surface.drive.center - surface.pose.shift


@by_type
def _carried_along(turn, spin, arm):
    """The velocity w x a of what the rotation moves."""
    return ZERO


@_carried_along.register(Rows)
def _(turn, spin, arm):
    return cross(spin, arm)


@inlined
def _frame_velocity(surface, r):
    """The velocity of the frame of the wall at a point."""
    return surface.pose.velocity + _carried_along(surface.pose.turn, surface.drive.spin, arm(surface, r))


@by_type
def _fictitious(turn, spin, arm, w):
    """The accelerations of a rotating frame, -2 w x v - w x (w x a)."""
    return ZERO


@_fictitious.register(Rows)
def _(turn, spin, arm, w):
    return -1.0 * (2.0 * cross(spin, w) + cross(spin, cross(spin, arm)))


@inlined
def _relative_pull(surface, r, w, pull):
    """The acceleration of a free particle with the relative velocity w in the frame of the wall."""
    given = _fictitious(surface.pose.turn, surface.drive.spin, arm(surface, r), w)
    return _back(surface.pose.turn, pull - surface.pose.acceleration + given)


@by_type
def _surface_velocity(spin, surface, r):
    return surface.pose.velocity


@_surface_velocity.register(Vec)
def _(spin, surface, r):
    return surface.pose.velocity + cross(spin, arm(surface, r))


@inlined
def in_frame(surface, r, v):
    """The velocity of a particle in the frame of the wall."""
    return _back(surface.pose.turn, v - _frame_velocity(surface, r))


@by_type
def arm_length(turn, surface, r):
    """The distance of a point from the centre of the rotation; 0 where there is none."""
    return 0.0


arm_length.register(Rows, lambda turn, surface, r: norm(arm(surface, r)))


@inlined
def frame_pull(surface, r, v, pull):
    """The acceleration of a free particle in the frame of the wall."""
    return _relative_pull(surface, r, v - _frame_velocity(surface, r), pull)


contract.velocity.register(Posed, lambda surface, r: _surface_velocity(surface.drive.spin, surface, r))


@by_type
def _surface_acceleration(spin, surface, r):
    return surface.pose.acceleration


@_surface_acceleration.register(Vec)
def _(spin, surface, r):
    return surface.pose.acceleration + cross(spin, cross(spin, arm(surface, r)))


contract.acceleration.register(Posed, lambda surface, r: _surface_acceleration(surface.drive.spin, surface, r))


contract.pace.register(Posed, lambda surface: surface.drive.pace)

# --- Its functions ---------------------------------------------------------------------------------------


def _of(made: Any, *functions: Any) -> None:
    for function in functions:
        function.register(Posed, made(function))


_of(lambda f: lambda surface: f(surface.body), contract.flat, contract.chord_sweeps, contract.farthest_push)
_of(lambda f: lambda surface, q: f(surface.body, q), contract.gap_of, contract.level_of)
_of(lambda f: lambda surface, q0, q1: f(surface.body, q0, q1), contract.gap_slope)
_of(
    lambda f: lambda surface, r: f(surface.body, own_place(surface, r)),
    contract.phi, contract.inner, contract.distance,
)  # fmt: skip
_of(
    lambda f: lambda surface, r: out(surface.pose.turn, f(surface.body, own_place(surface, r))),
    contract.gradient, contract.slope, contract.unit_normal,
)  # fmt: skip


@contract.settle.register(Posed)
def _(surface, r):
    settled = contract.settle(surface.body, own_place(surface, r))
    return _scene_place(surface.pose.turn, surface.drive.center, settled) + surface.pose.shift


@contract.outward_acceleration.register(Posed)
def _(surface, r, v, pull):
    own_v = in_frame(surface, r, v)
    return contract.outward_acceleration(surface.body, own_place(surface, r), own_v, frame_pull(surface, r, v, pull))


@by_type
def rising(surface, n, r, v):
    """The speed of a particle along the normal n of a wall, relative to it."""
    return dot(n, v)


rising.register(Posed, lambda surface, n, r, v: dot(n, v - contract.velocity(surface, r)))


@by_type
def straight_hit(surface, end, r0, r1):
    """When a straight way from r0 at one instant to r1 at another meets a wall, which is `end` there."""
    return contract.first_hit(surface, r0, r1 - r0)


@straight_hit.register(Posed)
def _(surface, end, r0, r1):
    own = own_place(surface, r0)
    return contract.first_hit(surface.body, own, own_place(end, r1) - own)


# --- Flight ----------------------------------------------------------------------------------------------

contract.is_quartic.register(Drifting, lambda surface: contract.is_quartic(surface.body))
contract.may_be_far.register(Drifting, lambda surface: contract.may_be_far(surface.body))


@contract.first_hit.register(Drifting)
def _(surface, r, v):
    return contract.first_hit(surface.body, r - surface.pose.shift, v - surface.pose.velocity)


@contract.falling_hit.register(Drifting)
def _(surface, r, v, pull):
    return contract.falling_hit(surface.body, r - surface.pose.shift, v - surface.pose.velocity, pull)


@contract.course.register(Drifting)
def _(surface, r, v, pull):
    return contract.course(surface.body, r - surface.pose.shift, v - surface.pose.velocity, pull)


@contract.safe_time.register(Drifting)
def _(surface, r, v, pull):
    return contract.safe_time(surface.body, r - surface.pose.shift, v - surface.pose.velocity, pull)
