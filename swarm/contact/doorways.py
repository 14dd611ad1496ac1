"""Open walls between the rooms of a union: what comes to one does not leave the union, it goes on in the other room."""

from ..kernel.gravity import accelerated
from ..kernel.jit import outlined, select
from ..kernel.vector import ZERO, dot, norm, square
from ..surfaces.presence.openings import Doorway, is_open
from ..surfaces.presence.rooms import gaps_in

# Of the slack, how far beyond its wall a particle goes on: it is in the other room alone then.
_THROUGH = 2.0
# The part of a velocity, or of gravity, that does not press on a wall.
_PRESSED = 1e-9


def closeness(walls):
    """A distance from an opening that counts as 0 for a flight: round-off of where rooms meet, 0 without unions."""
    return 2.0 * _depth(walls) if len(walls.unions) > 0 else 0.0


def _depth(walls):
    """How deep in the other room a particle goes on."""
    return _THROUGH * walls.slack if walls.inset is None else walls.inset


def leads_on(walls, wall, r):
    """Whether another room of its union is on the other side of a wall, at a place on it."""
    found = False
    for rooms in walls.joined():
        gaps = gaps_in(rooms, _beyond(walls, wall, r))
        for k, room in enumerate(rooms):
            is_of = (wall >= room[0][0]) & (wall <= room[-1][0])
            for j, gap in enumerate(gaps):
                found = (is_of & (gap <= walls.slack)) | found if j != k else found
    return found


def lets_through(openings, walls, wall, r, near):
    """Whether a wall is open at a place on it, or nearer to what is than that."""
    exits = tuple(one for one in openings if not isinstance(one, Doorway))
    doorways = tuple(one for one in openings if isinstance(one, Doorway))
    found = is_open(exits, wall, r, near)
    return found | (is_open(doorways, wall, r, near) & leads_on(walls, wall, r)) if doorways else found


def _beyond(walls, wall, r):
    """The other side of a wall at a place on it."""
    return walls.project(wall, r) + _depth(walls) * walls.unit_normal(wall, r)


def through(walls, gravity, wall, motion):
    """A particle (r, v) that is at an open wall, on its other side, with the same energy."""
    r, v = motion
    there, speed2 = _beyond(walls, wall, r), square(v)
    gained = dot(accelerated(gravity, ZERO, 1.0), there - r)
    return there, v + (select(speed2 > abs(gained), gained / select(speed2 > 0.0, speed2, 1.0), 0.0)) * v


@outlined
def is_pressed(walls, gravity, wall, r, v):
    """Whether a particle that is at a wall moves into it, or is pulled into it."""
    n, pull = walls.unit_normal(wall, r), accelerated(gravity, ZERO, 1.0)
    return dot(n, v) > _PRESSED * norm(v) or dot(n, pull) > _PRESSED * norm(pull)
