"""The next events of a ball, and its place in the queue."""

import math

from ...kernel.arrays import index
from ...kernel.jit import outlined
from .cells import take_out, until_exit
from .next_collision import find_partner, find_wall, forget_wall, tell_partner
from .queue import requeue
from .rows import DUE, FLOATS, LEAVES, MEETS, NO_PARTNER, PARTNER, WHOLES
from .window import OUT


def aim_again(box, flock, i, now):
    """Find all next events of a ball after its velocity has changed."""
    until_exit(box.grid, box.pull, flock, i, now)
    forget_wall(flock, i)
    find_wall(box, flock, i, now)
    find_partner(box, flock, i, now)


def stay(box, flock, i, now):
    """Find the next event of a held ball: its release, or a collision with another ball before."""
    flock.event[index(FLOATS * i + LEAVES)], flock.event[index(FLOATS * i + DUE)] = math.inf, flock.time(i)
    find_partner(box, flock, i, now)


def queue_both(flock, i):
    """Bring a ball to its place in the queue, and its partner too if `tell_partner` has changed the partner's event."""
    requeue(flock, i)
    partner = tell_partner(flock, i)
    if partner >= 0:
        requeue(flock, partner)


@outlined
def vanish(box, flock, i):
    """Take out a ball that has left the scene: it stays where it is, and meets no other ball."""
    take_out(flock, i, box.grid.number(i, flock))
    for k in (MEETS, LEAVES, DUE):
        flock.event[index(FLOATS * i + k)] = math.inf
    flock.aim_at(i, OUT)
    flock.tag[index(WHOLES * i + PARTNER)] = NO_PARTNER
    requeue(flock, i)
