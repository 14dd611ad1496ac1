"""The log of impacts of balls: a row for each on a wall, and one for each collision, of the smaller number."""

import numpy as np

from ...contact.reflection import relative, wall_velocity
from ...kernel.arrays import index
from ...kernel.vector import ZERO, dot
from .clock import moment_of
from .rows import NOBODY
from .window import walls_at


def note_wall(box, books, clock, met, motion, impulse):
    """A row for the impact (ball, time, wall) of a ball (place, velocity before and after)."""
    if box.log is None:
        return
    i, now, wall = met
    if box.log.has(i):
        r, before, _after = motion
        slip = ZERO
        if box.log.slip is not None:
            walls = walls_at(box, i, now)
            n, w = walls.unit_normal(wall, r), relative(wall_velocity(box.laws.moving, walls, wall, r), before)
            slip = w - dot(w, n) * n
        _add(box.log, books, moment_of(clock, now), (i, wall, NOBODY), motion, impulse, slip)


def note_pair(box, books, clock, pair, motion, impulse):
    """A row for the collision (ball, partner, time), where one of both has rows."""
    if box.log is None:
        return
    one, other, now = pair
    if box.log.has(one) or box.log.has(other):
        _add(box.log, books, moment_of(clock, now), (one, -1.0, other), motion, impulse, ZERO)


def _add(log, books, moment, met, motion, impulse, slip):
    k = index(log.filled[0])
    log.filled[0] += 1
    i, wall, partner = met
    log.time[k] = max(log.begin, moment)
    log.particle[k], log.wall[k], log.partner[k] = np.int32(i), np.int32(wall), np.int32(partner)
    for rows, vector in zip((log.position, log.velocity_before, log.velocity_after), motion, strict=True):
        rows[k, 0], rows[k, 1], rows[k, 2] = vector
    log.impulse[k] = impulse
    if log.slip is not None:
        log.slip[k, 0], log.slip[k, 1], log.slip[k, 2] = slip
    if log.image is not None:
        for axis in range(3):
            log.image[k, axis] = np.int32(books.image[axis, index(i)])


def has_room(log):
    """Whether there is room for the rows of an event."""
    return log.filled[0] < log.time.size
