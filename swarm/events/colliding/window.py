"""Walls that move or become absent: their description in a window, and the hits of balls on them in it.

Windows are no frames. At the start of each window, all balls look for their next wall again.
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

# Entries of a window: its end [s of the epoch] and its length [s], the number of instants up to its end, its end [s].
END, SPAN, PASSED, MOMENT, WINDOW = 0, 1, 2, 3, 4
# In place of the number of a wall: no wall is known yet; the ball has left the walls; from `HELD` on downwards a wall
# holds the ball.
UNKNOWN, OUT, HELD = -2.0, -3.0, -4.0


def walls_at(box, i, now):
    """The walls that the centre of a ball meets at a time."""
    walls = box.walls.grown(box.kinds.radius_of(i))
    return walls if box.window is None else walls.at(box.window[END] - now)


def next_hit(box, flock, i, now):
    """Return the next `Hit` of a ball on a wall; if walls move, only before the ends of its cell and of the window."""
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
    """Return the first `Hit` of a flight within `longest` [s], with `remaining` [s] of the window left."""
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
    """A bound of the way of a wall towards a place within a time `half` [s]."""
    way: Any = 0.0
    if half is not None and isinstance(wall, Posed):
        drive = wall.drive
        way = (drive.fastest + drive.angular_speed() * (wall.arm_length(r) + drive.fastest * half)) * half
    return way
