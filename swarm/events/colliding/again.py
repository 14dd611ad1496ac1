"""All that is next for a ball, and its place in the queue."""

from .aim import find_partner, find_wall, forget_wall, tell_partner
from .cells import until_exit
from .queue import requeue


def aim_again(box, flock, i, now):
    """Find all that is next for a ball with a velocity that has changed."""
    until_exit(box.grid, box.pull, flock, i, now)
    forget_wall(box, flock, i)
    find_wall(box, flock, i, now)
    find_partner(box, flock, i, now)


def queue_both(flock, i):
    """Bring a ball to its place in the queue, and its partner too if `tell_partner` has changed the partner's event."""
    requeue(flock, i)
    partner = tell_partner(flock, i)
    if partner >= 0:
        requeue(flock, partner)
