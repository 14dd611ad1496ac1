"""How soon a particle may meet a wall that reacts, whatever others do to the wall within its lease.

In the frame that moves with the middle velocity of the lease the wall stays within the width times the time of where it
is: for a plane and a ball the first time at which a flight is as near as that is the root of a parabola.
"""

import math
from typing import Any, NamedTuple

from ..kernel.jit import by_type, index, select
from ..kernel.vector import Vec, column, dot, norm, square
from ..surfaces import contract
from ..surfaces.course import rise_time
from ..surfaces.fold import Chain
from ..surfaces.rotation import Rotated
from ..surfaces.shapes.plane import PlaneNumbers
from ..surfaces.shapes.quadratic import QuadricNumbers
from ..surfaces.shapes.rotated import own as rotated_own
from ..surfaces.shapes.slab import SlabNumbers, along
from ..surfaces.shapes.solid import SolidNumbers
from ..surfaces.shapes.sphere import SphereNumbers
from .freedoms import Hinged, arm_of, axis_of, pose_of
from .pendulum import Pendulum

# Trials of a time for which the fall is bounded.
_TRIALS = 3


class Seen(NamedTuple):
    """A particle in the frame of the lease, and by how much the wall may depart from it."""

    r: Vec
    v: Vec
    pull: Vec
    width: float
    axis: Any  # along which it may, or None
    longest: float


@by_type
def reach(freedom, body, walls, flight):
    """A time during which the flight surely does not meet this wall, at most the longest that matters."""
    k = index(freedom.row)
    seen = Seen(
        flight.r - pose_of(freedom, walls, flight.time).shift, flight.v - column(walls.middle, 0, k), flight.pull,
        walls.width[k], axis_of(freedom), flight.longest,
    )  # fmt: skip
    return _reach(body, seen)


@reach.register(Hinged)
@reach.register(Pendulum)
def _(freedom, body, walls, flight):
    # No point of the wall within the arm and the clearance is faster than the rate says.
    k = index(freedom.row)
    arm, turn = arm_of(freedom, flight.r), pose_of(freedom, walls, flight.time).turn
    own = freedom.center + turn.x * arm.x + turn.y * arm.y + turn.z * arm.z
    clear = max(_clear(body, own), 0.0)
    fastest = (abs(walls.turning[k]) + walls.width[k]) * (norm(arm) + clear) + norm(flight.v)
    return rise_time(-clear, 0.5 * fastest, 0.5 * norm(flight.pull))


@by_type
def _clear(body, r):
    """A lower bound of the distance to the wall."""
    return contract.clearance(body, r)


@_clear.register(SolidNumbers)
def _(body, r):
    return _farthest_part(body.parts, r)


@_clear.register(Rotated)
def _(body, r):
    return _clear(body.body, rotated_own(body, r))


@by_type
def _farthest_part(parts, r):
    """How far a point is out of the part that it is farthest from: so far at least it is from the body."""
    return 0.0


@_farthest_part.register(Chain)
def _(parts, r):
    return max(_out_of(parts.first, r), _farthest_part(parts.rest, r))


@by_type
def _out_of(part, r):
    """How far a point is out of a part at least; below 0 inside."""
    return 0.0


@_out_of.register(PlaneNumbers)
@_out_of.register(SlabNumbers)
@_out_of.register(SphereNumbers)
def _(part, r):
    return -contract.gap_of(part, contract.inner(part, r))


@_out_of.register(QuadricNumbers)
def _(part, r):
    # phi over its gradient is no more than the distance where phi is convex.
    convex = min(part.a.x, part.a.y, part.a.z) >= 0.0
    steepness = norm(contract.gradient(part, r))
    out = -contract.gap_of(part, contract.inner(part, r)) / select(steepness > 0.0, steepness, 1.0)
    return select(convex, out, 0.0)


_out_of.register(Rotated, lambda part, r: _out_of(part.body, rotated_own(part, r)))


@by_type
def _across(axis, n):
    """How much of the width is along n."""
    return 1.0


_across.register(Vec, lambda axis, n: abs(dot(axis, n)))


@by_type
def _across_slab(axis, n):
    return 1.0


_across_slab.register(Vec, lambda axis, n: abs(along(n, axis)))


@by_type
def _reach(body, seen):
    # Of any shape the distance is all that is known.
    clear = max(_clear(body, seen.r), 0.0)
    return rise_time(-clear, 0.5 * (norm(seen.v) + seen.width), 0.5 * norm(seen.pull))


@_reach.register(PlaneNumbers)
def _(body, seen):
    n = body.normal
    rise = 0.5 * (dot(n, seen.v) + seen.width * _across(seen.axis, n))
    return rise_time(dot(n, seen.r) - body.offset, rise, 0.5 * dot(n, seen.pull))


@_reach.register(SlabNumbers)
def _(body, seen):
    n = body.normal
    x, u, a = along(n, seen.r) - body.offset, along(n, seen.v), 0.5 * along(n, seen.pull)
    width = seen.width * _across_slab(seen.axis, n)
    # To the wall on the one side and on the other; of a plate the particle is on one side.
    up = rise_time(body.side * (x - body.radius), 0.5 * (body.side * u + width), body.side * a)
    down = rise_time(body.side * (-x - body.radius), 0.5 * (-body.side * u + width), -body.side * a)
    outside = select(x > 0.0, up, down)
    return select(body.side > 0.0, min(up, down), outside)


@_reach.register(SphereNumbers)
def _(body, seen):
    # |d + v t| = R -+ width t, with the fall up to a time in the width
    d, side, weight = seen.r - body.center, body.side, norm(seen.pull)
    c, b, a = side * (square(d) - body.radius2), side * dot(d, seen.v), square(seen.v)
    time, within = 0.0, seen.longest
    for _k in range(_TRIALS):
        width = seen.width + 0.5 * weight * within
        found = rise_time(c, b + body.radius * width, side * (a - width * width))
        time = max(time, min(found, within))
        if not time < within or weight == 0.0:
            break
        within = math.sqrt(time * within)
    return time


@by_type
def _turned_back(axis, body):
    return


_turned_back.register(Vec, lambda axis, body: rotated_own(body, axis))


@_reach.register(Rotated)
def _(body, seen):
    r, v, pull = (rotated_own(body, a) for a in (seen.r, seen.v, seen.pull))
    return _reach(body.body, Seen(r, v, pull, seen.width, _turned_back(seen.axis, body), seen.longest))
