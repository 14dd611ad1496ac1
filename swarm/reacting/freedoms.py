"""How a wall that reacts may move: freely without turning, along a guide, on a spring, about an axis.

Between two impacts its motion is known. What impacts may make of it is bounded by a lease: until the wall has left it,
the velocity stays within a width of a middle one, so that what was said of far particles holds.
"""

import math
from typing import NamedTuple

from ..kernel.jit import Array, by_type, index, inlined, select
from ..kernel.vector import ZERO, Vec, column, cross, dot, norm, put, square
from ..surfaces import contract
from ..surfaces.drive import Drive, Pose, Rows, Swing, Turn
from ..surfaces.fold import Chain
from ..surfaces.posed import Posed


class Freedoms(NamedTuple):
    """What is known of the walls that react: arrays of one column a wall."""

    shift: Array  # (3, K) the displacement at `time` [m]
    velocity: Array  # (3, K) [m/s]
    rest: Array  # (3, K) what round-off took of it: a heavy wall is struck a million times by what is light
    angle: Array  # (K,) [rad]
    rate: Array  # (K,) [rad/s]
    rate_rest: Array  # (K,)
    series: Array  # (.., K) of pendulums, the Taylor coefficients of the angle from that time on
    time: Array  # (K,) since the start of the frame [s]
    middle: Array  # (3, K) of the velocities of its lease
    turning: Array  # (K,) of the rates of its lease
    width: Array  # (K,) by how much both may differ from that, [m/s] or [rad/s]
    until: Array  # (K,) when it may leave the lease by what pulls it [s]


class Free(NamedTuple):
    """A wall that moves in any direction and does not turn."""

    row: int
    lightness: float  # 1/M
    pull: Vec


class Guided(NamedTuple):
    """A wall that moves along a guide."""

    row: int
    lightness: float
    pull: Vec  # along the axis
    axis: Vec


class Sprung(NamedTuple):
    """A wall on a guide with a spring, which is relaxed where the wall is given."""

    row: int
    lightness: float
    pull: Vec
    axis: Vec
    rate: float  # of its vibration [rad/s]


class Hinged(NamedTuple):
    """A wall that turns about an axis, on which its centre of mass is."""

    row: int
    lightness: float  # 1/I
    axis: Vec
    center: Vec


class Falling(Posed):
    """A wall at one instant of a free motion with a constant acceleration, or none."""


_AT_REST = Drive(ZERO, ZERO, None, None, None, None, ZERO, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)


@contract.first_hit.register(Falling)
def _(surface, r, v):
    return contract.first_hit(surface.body, r - surface.pose.shift, v - surface.pose.velocity)


@contract.falling_hit.register(Falling)
def _(surface, r, v, pull):
    way, speed = r - surface.pose.shift, v - surface.pose.velocity
    return contract.falling_hit(surface.body, way, speed, pull - surface.pose.acceleration)


# --- Where it is -----------------------------------------------------------------------------------------


@by_type
def pose_of(freedom, walls, t):
    """The `Pose` at a time of the frame."""
    # s = s0 + V t + a t^2/2
    k = index(freedom.row)
    t = t - walls.time[k]
    v, pull = column(walls.velocity, 0, k), freedom.pull
    return Pose(column(walls.shift, 0, k) + t * (v + (0.5 * t) * pull), v + t * pull, pull, None)


@pose_of.register(Sprung)
def _(freedom, walls, t):
    # s = s_e + (s0 - s_e) cos wt + V/w sin wt about the equilibrium s_e = a/w^2
    k, rate = index(freedom.row), freedom.rate
    angle = rate * (t - walls.time[k])
    rest = freedom.pull / (rate * rate)
    c, s = math.cos(angle), math.sin(angle)
    away, speed = column(walls.shift, 0, k) - rest, column(walls.velocity, 0, k) / rate
    here = c * away + s * speed
    return Pose(rest + here, rate * (c * speed - s * away), (-rate * rate) * here, None)


@pose_of.register(Hinged)
def _(freedom, walls, t):
    k = index(freedom.row)
    angle = walls.angle[k] + walls.rate[k] * (t - walls.time[k])
    return Pose(ZERO, ZERO, ZERO, rows_about(freedom.axis, angle))


@inlined
def rows_about(axis, angle):
    """The rows of the rotation about an axis by an angle (Rodrigues)."""
    a, c, s = axis, math.cos(angle), math.sin(angle)
    b = 1.0 - c
    return Rows(
        Vec(c + b * a.x * a.x, b * a.x * a.y - s * a.z, b * a.x * a.z + s * a.y),
        Vec(b * a.y * a.x + s * a.z, c + b * a.y * a.y, b * a.y * a.z - s * a.x),
        Vec(b * a.z * a.x - s * a.y, b * a.z * a.y + s * a.x, c + b * a.z * a.z),
    )


@by_type
def drive_of(freedom, walls, t):
    """Its motion from this time on as that of a wall whose motion is given, whose frame ends then."""
    return _AT_REST


@drive_of.register(Sprung)
def _(freedom, walls, t):
    found, rate = pose_of(freedom, walls, t), freedom.rate
    away, speed = found.shift - freedom.pull / (rate * rate), found.velocity / rate
    most = math.sqrt(square(away) + square(speed))
    bounds = rate * most, rate * rate * most, rate * rate * rate * most
    swings, jerks = Chain(Swing(away, speed, rate), None), Vec(bounds[2], bounds[2], bounds[2])
    return Drive(found.shift, ZERO, swings, None, None, None, ZERO, *bounds, math.inf, 0.0, jerks)


@drive_of.register(Hinged)
def _(freedom, walls, t):
    rate, turn = walls.rate[index(freedom.row)], pose_of(freedom, walls, t).turn
    turning, spin = Turn(turn.x, turn.y, turn.z, freedom.axis, rate), rate * freedom.axis
    return Drive(ZERO, ZERO, None, None, turning, spin, freedom.center, 0.0, 0.0, 0.0, math.inf, 0.0, ZERO)


@by_type
def posed(freedom, body, walls, t):
    """A wall at a time of the frame, as a surface."""
    here = pose_of(freedom, walls, t)
    return Falling(body, here, here, _AT_REST, 0.0, 0.0)


@posed.register(Sprung)
@posed.register(Hinged)
def _(freedom, body, walls, t):
    drive = drive_of(freedom, walls, t)
    here = drive.pose(0.0)
    return Posed(body, here, here, drive, 0.0, 0.0)


# --- What an impulse does --------------------------------------------------------------------------------


@by_type
def mobility(freedom, n, arm):
    """The velocity along n that a unit impulse along n gives the wall at the end of the arm [1/kg]."""
    return freedom.lightness * square(n)


@mobility.register(Guided)
@mobility.register(Sprung)
def _(freedom, n, arm):
    along = dot(n, freedom.axis)
    return freedom.lightness * along * along


@mobility.register(Hinged)
def _(freedom, n, arm):
    lever = dot(cross(arm, n), freedom.axis)
    return freedom.lightness * lever * lever


@by_type
def push(freedom, walls, t, impulse, arm):
    """Give the wall an impulse at a time, at the end of an arm from its centre."""
    _move(freedom, walls, t, freedom.lightness * impulse)


@push.register(Guided)
@push.register(Sprung)
def _(freedom, walls, t, impulse, arm):
    _move(freedom, walls, t, (freedom.lightness * dot(impulse, freedom.axis)) * freedom.axis)


@push.register(Hinged)
def _(freedom, walls, t, impulse, arm):
    k = index(freedom.row)
    walls.angle[k] += walls.rate[k] * (t - walls.time[k])
    change = freedom.lightness * dot(cross(arm, impulse), freedom.axis)
    walls.rate[k], walls.rate_rest[k] = _exact_sum(walls.rate[k], change + walls.rate_rest[k])
    walls.time[k] = t


@inlined
def _move(freedom, walls, t, change):
    k, here = index(freedom.row), pose_of(freedom, walls, t)
    more = change + column(walls.rest, 0, k)
    x, y, z = (
        _exact_sum(here.velocity.x, more.x),
        _exact_sum(here.velocity.y, more.y),
        _exact_sum(here.velocity.z, more.z),
    )
    put(walls.shift, 0, k, here.shift)
    put(walls.velocity, 0, k, Vec(x[0], y[0], z[0]))
    put(walls.rest, 0, k, Vec(x[1], y[1], z[1]))
    walls.time[k] = t


@inlined
def _exact_sum(a, b):
    """a + b and what round-off takes of it (Knuth)."""
    found = a + b
    other = found - a
    return found, (a - (found - other)) + (b - other)


@by_type
def arm_of(freedom, r):
    """From the centre of the rotation to a point."""
    return r


arm_of.register(Hinged, lambda freedom, r: r - freedom.center)

# --- Leases ----------------------------------------------------------------------------------------------


@by_type
def hardest(freedom, walls):
    """A bound of the wall's acceleration between impacts [m/s^2]."""
    return norm(freedom.pull)


@hardest.register(Sprung)
def _(freedom, walls):
    k, rate = index(freedom.row), freedom.rate
    away, speed = column(walls.shift, 0, k) - freedom.pull / (rate * rate), column(walls.velocity, 0, k) / rate
    return rate * rate * math.sqrt(square(away) + square(speed))


hardest.register(Hinged, lambda freedom, walls: 0.0)


@by_type
def renew(freedom, walls, t):
    """A new lease from this time on, about the velocity that the wall has."""
    put(walls.middle, 0, index(freedom.row), pose_of(freedom, walls, t).velocity)
    _extend(freedom, walls, t, 0.0)


@renew.register(Hinged)
def _(freedom, walls, t):
    walls.turning[index(freedom.row)] = walls.rate[index(freedom.row)]
    _extend(freedom, walls, t, 0.0)


@inlined
def _extend(freedom, walls, t, away):
    k, most = index(freedom.row), hardest(freedom, walls)
    walls.until[k] = select(most > 0.0, t + (walls.width[k] - away) / select(most > 0.0, most, 1.0), math.inf)


@by_type
def stays(freedom, walls):
    """Whether a wall that was just struck is within its lease; says until when."""
    k = index(freedom.row)
    away = norm(column(walls.velocity, 0, k) - column(walls.middle, 0, k))
    _extend(freedom, walls, walls.time[k], away)
    return away < walls.width[k]


@stays.register(Hinged)
def _(freedom, walls):
    k = index(freedom.row)
    return abs(walls.rate[k] - walls.turning[k]) < walls.width[k]


@by_type
def axis_of(freedom):
    """The direction in which its velocity may change, or None for any."""
    return


axis_of.register(Guided, lambda freedom: freedom.axis)
axis_of.register(Sprung, lambda freedom: freedom.axis)
