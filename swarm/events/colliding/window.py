"""Walls that move, come and go: what is known of them until the end of a window, and when balls meet them until then.

From one window to the next, which are no frames, all balls look for their next wall again.
"""

import math
from typing import Any

from ...kernel.arrays import index
from ...kernel.jit import outlined, select
from ...surfaces.in_motion.posed import Posed
from ...surfaces.time_of_impact import flights, safe
from ...surfaces.time_of_impact.flights import Hit
from ...surfaces.time_of_impact.rising import flight_of
from .rows import FLOATS, LEAVES

# Of a window: its end and its length [s since the epoch], how many instants there were before its end, that end [s].
END, SPAN, PASSED, MOMENT, WINDOW = 0, 1, 2, 3, 4
# No wall is known yet; the ball is no more among the walls; from this number on downwards a wall holds it.
UNKNOWN, OUT, HELD = -2.0, -3.0, -4.0


def walls_at(box, i, now):
    """The walls that the centre of a ball meets, at a time."""
    walls = box.walls.grown(box.kinds.radius_of(i))
    return walls if box.window is None else walls.at(box.window[END] - now)


def next_hit(box, flock, i, now):
    """When a ball meets a wall next; of walls that move only before it leaves its cell and before the window ends."""
    r, v = flock.at(box.pull, i, now)
    if box.window is None:
        return flights.first_hit(box.walls.grown(box.kinds.radius_of(i)), box.pull, r, v)
    end = box.window[END]
    longest = min(flock.event[index(FLOATS * i + LEAVES)], end) - now
    hit = _hit_before(box.walls.grown(box.kinds.radius_of(i)), box.pull, r, v, end - now, longest)
    known = hit.time < longest
    return Hit(select(known, hit.time, math.inf), select(known, hit.wall, UNKNOWN))


@outlined
def _hit_before(walls, gravity, r, v, remaining, longest):
    """The first `Hit` of a flight before a time, with so much of the window left."""
    found = safe.closed_hit(walls.at(remaining), gravity, r, v)
    if walls.accelerate:
        soonest = min(found.time, longest)
        met = safe.march_moving(walls, flight_of(r, v, gravity, remaining), soonest)
        if met.wall >= 0.0 or met.time < soonest:
            return met
    return found


def middle_of(box):
    """The walls in the middle of a window, and half its length, or None if no wall moves."""
    if box.window is None:
        return box.walls, None
    half = 0.5 * box.window[SPAN]
    return box.walls.at(half), half


def swept(wall, r, half):
    """A bound of how much nearer to a place a wall may come within a time."""
    way: Any = 0.0
    if half is not None and isinstance(wall, Posed):
        drive = wall.drive
        way = (drive.fastest + drive.angular_speed() * (wall.arm_length(r) + drive.fastest * half)) * half
    return way
