"""Particles that reach a wall where it is open: they have escaped, and nothing is left of their frames."""

from ..contact import crossing
from ..contact.passing import hit_wall, open_wall_at, open_wall_of
from ..kernel.jit import by_type, by_type_outlined, index, inlined
from ..kernel.vector import column, put
from ..surfaces.moving import at
from ..surfaces.openings import Openings, is_open
from . import compose
from . import log as impact_log
from .arrays import LEFT, R, V
from .marks import marked_lanes


@inlined
def _escape(share, p, wall, r, v, left):
    """Particle p has escaped, with so much of its frame left: it stays where and as fast as it is."""
    share.state.escape_time[p] = share.moment - left
    impact_log.add_escape(share.log, share.state, p, impact_log.Struck(r, v, v, wall, left, 0.0))


@by_type
def let_out_lanes(openings, method, chain, share, lanes, live):
    """The lanes whose flight has ended on a wall where it is open, if no closed one is at the same place."""


@let_out_lanes.register(Openings)
def _(openings, method, chain, share, lanes, live):
    rows = lanes.rows
    for i in range(index(live)):
        lanes.marked[i] = is_open(openings, lanes.wall[i], column(rows, R, i), 0.0)
    for k in range(marked_lanes(lanes, live)):
        lane = index(lanes.order[k])
        r, v = column(rows, R, lane), column(rows, V, lane)
        wall = hit_wall(openings, method, at(chain, rows[LEFT, lane]), (r, v), lanes.wall[lane], 0.0)
        if not is_open(openings, wall, r, 0.0):
            lanes.wall[lane] = wall
            continue
        _escape(share, index(lanes.particle[lane]), lanes.wall[lane], r, v, rows[LEFT, lane])
        rows[LEFT, lane], lanes.wall[lane] = 0.0, -1.0


@by_type_outlined
def is_at_opening(openings, kind, method, chain, state, lanes, i):
    """Whether a lane that slides is where a wall that holds it is open: it is at that wall then, as if it flew."""
    return False


@is_at_opening.register(Openings)
def _(openings, kind, method, chain, state, lanes, i):
    rows, r = lanes.rows, column(lanes.rows, compose.R, i)
    held = kind.of_lane(rows[compose.WALL, i], rows[compose.WALL + 1, i])
    wall = open_wall_of(openings, method, chain, held, r, crossing.near(method, r))
    if wall < 0.0:
        return False
    state.contacts.met[lanes.particle[i]] = wall
    put(rows, compose.V, i, compose.with_kept(kind, chain, lanes, i))
    rows[compose.KEEP, i] = 0.0
    return True


@by_type_outlined
def met_wall(openings, method, chain, wall, r, v):
    """The wall that a particle meets that is at this one: where this is open, a closed one at the same place."""
    return wall


@met_wall.register(Openings)
def _(openings, method, chain, wall, r, v):
    return hit_wall(openings, method, chain, (r, v), wall, crossing.near(method, r))


@by_type_outlined
def let_out_of(openings, method, share, p, wall, r, left):
    """Whether a particle at a wall has escaped, since it is open there, with so much of the frame left."""
    return False


@let_out_of.register(Openings)
def _(openings, method, share, p, wall, r, left):
    if not is_open(openings, wall, r, crossing.near(method, r)):
        return False
    _escape(share, p, wall, r, column(share.state.velocity, 0, p), left)
    return True


@by_type_outlined
def let_out_at(openings, method, chain, share, p, r, left):
    """The same of one that all walls within a small distance hold."""
    return False


@let_out_at.register(Openings)
def _(openings, method, chain, share, p, r, left):
    wall = open_wall_at(openings, method, chain, r, crossing.near(method, r))
    if wall < 0.0:
        return False
    _escape(share, p, wall, r, column(share.state.velocity, 0, p), left)
    return True
