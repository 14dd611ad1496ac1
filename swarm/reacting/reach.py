"""The times until which a particle surely does not meet a wall that reacts, whatever happens within its lease.

In the frame that moves with the middle velocity of the lease the wall stays within the width times the time of where it
is: for a plane and a ball the first time at which a flight is as near as that is the root of a parabola.
"""

import math
from typing import Any, NamedTuple

from ..kernel.jit import select
from ..kernel.vector import Vec, dot, norm, square
from ..surfaces.course import rise_time
from ..surfaces.rotation import Rotated
from ..surfaces.shapes.plane import PlaneNumbers
from ..surfaces.shapes.quadratic import QuadricNumbers
from ..surfaces.shapes.slab import SlabNumbers
from ..surfaces.shapes.solid import SolidNumbers
from ..surfaces.shapes.sphere import SphereNumbers

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


def clear_of(body, r):
    """A lower bound of the distance to the wall."""
    if isinstance(body, Rotated):
        return clear_of(body.body, body.vector_in(r))
    if isinstance(body, SolidNumbers):
        # How far the point is out of the part that it is farthest from.
        clear = 0.0
        for part in reversed(body.parts):
            clear = max(_out_of(part, r), clear)
        return clear
    return body.clearance(r)


def _out_of(part, r):
    """A lower bound of the distance of a point outside of a part; below 0 inside."""
    if isinstance(part, Rotated):
        return _out_of(part.body, part.vector_in(r))
    if isinstance(part, (PlaneNumbers, SlabNumbers, SphereNumbers)):
        return -part.gap_of(part.inner(r))
    if isinstance(part, QuadricNumbers):
        # phi over its gradient is no more than the distance where phi is convex.
        convex = min(part.a.x, part.a.y, part.a.z) >= 0.0
        steepness = norm(part.gradient(r))
        out = -part.gap_of(part.inner(r)) / select(steepness > 0.0, steepness, 1.0)
        return select(convex, out, 0.0)
    return 0.0


def reach_of(body, seen):
    """A time during which a particle surely does not meet a wall that does not turn."""
    if isinstance(body, Rotated):
        r, v, pull = (body.vector_in(a) for a in (seen.r, seen.v, seen.pull))
        axis = None if seen.axis is None else body.vector_in(seen.axis)
        return reach_of(body.body, Seen(r, v, pull, seen.width, axis, seen.longest))
    if isinstance(body, PlaneNumbers):
        return _reach_of_plane(body, seen)
    if isinstance(body, SlabNumbers):
        return _reach_of_slab(body, seen)
    if isinstance(body, SphereNumbers):
        return _reach_of_sphere(body, seen)
    # Of any other shape the distance is all that is known.
    clear = max(clear_of(body, seen.r), 0.0)
    return rise_time(-clear, 0.5 * (norm(seen.v) + seen.width), 0.5 * norm(seen.pull))


def _reach_of_plane(body, seen):
    n = body.normal
    across = 1.0 if seen.axis is None else abs(dot(seen.axis, n))
    rise = 0.5 * (dot(n, seen.v) + seen.width * across)
    return rise_time(dot(n, seen.r) - body.offset, rise, 0.5 * dot(n, seen.pull))


def _reach_of_slab(body, seen):
    x, u, a = body.off(seen.r), body.along(seen.v), 0.5 * body.along(seen.pull)
    width = seen.width * (1.0 if seen.axis is None else abs(body.along(seen.axis)))
    # To the wall on the one side and on the other; of a plate the particle is on one side.
    up = rise_time(body.side * (x - body.radius), 0.5 * (body.side * u + width), body.side * a)
    down = rise_time(body.side * (-x - body.radius), 0.5 * (-body.side * u + width), -body.side * a)
    outside = select(x > 0.0, up, down)
    return select(body.side > 0.0, min(up, down), outside)


def _reach_of_sphere(body, seen):
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
