"""Particles that reach a wall where it is open: they have escaped, and nothing is left of their frames."""

from ..contact import crossing, events
from ..contact.passing import is_let_out, open_wall
from ..kernel.jit import by_type, by_type_outlined, index, inlined
from ..kernel.vector import column
from ..surfaces.openings import Openings, is_open
from .arrays import LEFT, R
from .fly import marked_lanes


@inlined
def _escape(share, p, left):
    """Particle p has escaped, with so much of its frame left: it stays where and as fast as it is."""
    share.state.escape_time[p] = share.moment - left


@by_type
def let_out_lanes(openings, share, lanes, live):
    """The lanes whose flight has ended on a wall where it is open."""


@let_out_lanes.register(Openings)
def _(openings, share, lanes, live):
    rows = lanes.rows
    for i in range(index(live)):
        lanes.marked[i] = is_open(openings, lanes.wall[i], column(rows, R, i), 0.0)
    for k in range(marked_lanes(lanes, live)):
        lane = index(lanes.order[k])
        _escape(share, index(lanes.particle[lane]), rows[LEFT, lane])
        rows[LEFT, lane], lanes.wall[lane] = 0.0, -1.0


@by_type_outlined
def let_out_held(openings, method, share, p, held, r, left):
    """Whether a particle that walls hold has escaped, with so much of the frame left."""
    return False


@let_out_held.register(Openings)
def _(openings, method, share, p, held, r, left):
    if not is_let_out(openings, held, r, crossing.near(method, r)):
        return False
    _escape(share, p, left)
    return True


@by_type_outlined
def let_out_at(openings, method, chain, share, p, r, left):
    """The same of one that all walls within a small distance hold."""
    return False


@let_out_at.register(Openings)
def _(openings, method, chain, share, p, r, left):
    if open_wall(openings, chain, r, events.TOUCH * method.size, crossing.near(method, r)) < 0.0:
        return False
    _escape(share, p, left)
    return True
