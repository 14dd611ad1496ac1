"""The beginnings and ends of lasting contacts, one particle at a time: its state after it meets a wall."""

import math

from ..kernel.gravity import accelerated
from ..kernel.jit import outlined
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, dot, norm, square
from ..surfaces.presence.absence import are_one
from ..surfaces.time_of_impact import flights
from . import hold, sliding, touching
from .hold import One, Two
from .laws import NONE
from .projection import ALLOWED
from .reflection import energy_of, exact, relative, wall_velocity

# The phases of a particle: it flies, slides along one wall or an edge, has arrived, or is at a wall where its phase is
# to be decided; or it is left to `careful`.
PHASES = 6
FLYING, HELD, EDGE, ARRIVED, EVENT, CAREFUL = range(PHASES)
# A particle that leaves a wall slower than this fraction of its own speed slides: its hops are 1e-4 of a crossing long.
GRAZING = 5e-5
# An impulse below this fraction of the speed is round-off of a particle at its wall, and no impact.
NO_IMPACT = 1e-12
# A speed across the walls up to this fraction of a particle's own speed counts as 0: its square is round-off of the
# energy.
_NO_HOP = 1e-7
# Fractions of an acceleration and of a time that count as 0.
_PRESSED, _INSTANT = 1e-12, 1e-9
# Walls nearer to each other's tangent plane than this sine have no edge to slide along.
_SHARPEST = 1e-7
# Walls within this fraction of the size of the scene hold a particle together.
TOUCH = 1e-10


class Particle(Record):
    """A particle in contact: `twice` is twice the energy per mass, and scale2 is the square of its own speed."""

    r: Vec
    v: Vec
    remaining: float
    twice: float
    scale2: float


class Next(Record):
    """The state of a particle after an event: phase, velocity along the walls, speed across them, energy, walls.

    `impulse` is the impulse of the wall, `wait` the time of the hops that are left out.
    """

    phase: int
    v: Vec
    keep: float
    twice: float
    wall: float
    other: float = -1.0
    impulse: float = 0.0
    wait: float = 0.0


def own_speed2(p):
    """Return the square of a particle's own speed: the larger of its scale and its motion."""
    return max(p.scale2, square(p.v))


def weightless(rules, gravity, p):
    """Return an acceleration that counts as 0 for this particle: round-off of gravity, and of the pull of bent walls.

    The size does not enter: for a floor, or a slot between two planes, it depends on their places, not on the pull.
    """
    return _PRESSED * (norm(accelerated(gravity, ZERO, 1.0)) + own_speed2(p) / rules.bend)


def _loses(rules, wall):
    return 1.0 - rules.laws.restitution_of(wall) > 0.0


# Each is compiled once in a kernel, and not at each call: half of the time to compile.


@outlined
def _normal(walls, wall, r):
    return walls.unit_normal(wall, r)


@outlined
def _press(walls, wall, r, v, pull):
    return walls.outward_acceleration(wall, r, v, pull)


@outlined
def _bounce(rules, walls, gravity, wall, p):
    return exact(rules.laws, walls, gravity, wall, p.r, p.v, energy_of(p.twice))


# --- From flight -----------------------------------------------------------------------------------------


@outlined
def enter(rules, walls, gravity, wall, p):
    """Return `Next` of a particle that leaves this wall so slowly that it is back at once."""
    n, u = _normal(walls, wall, p.r), wall_velocity(rules.laws.moving, walls, wall, p.r)
    v, twice, impulse = p.v, p.twice, 0.0
    if dot(relative(u, v), n) > 0.0:
        bounce = _bounce(rules, walls, gravity, wall, p)
        v, twice, impulse = bounce.v, bounce.twice_energy, bounce.impulse
    away = -dot(relative(u, v), n)
    along = v + away * n
    flies = Next(FLYING, v, 0.0, twice, wall, impulse=impulse)
    pull, speed2 = accelerated(gravity, ZERO, 1.0), own_speed2(p)
    press = _press(walls, wall, p.r, along, pull)
    if not press > weightless(rules, gravity, p) or rules.laws.thermal_of(wall).is_hot():
        return flies
    hop = 2.0 * max(away, 0.0) / press
    short = hop < rules.shortest_flight if rules.shortest_flight > 0.0 else away <= GRAZING * math.sqrt(speed2)
    if not short:
        return flies
    following = flights.first_hit(walls, gravity, p.r, v)
    is_other = following.wall >= 0.0 and not are_one(walls, wall, following.wall, p.r)
    if is_other and following.time < hop:
        at = accelerated(gravity, v, following.time)
        other = wall_velocity(rules.laws.moving, walls, following.wall, p.r)
        towards = dot(_normal(walls, following.wall, p.r), relative(other, at))
        if towards <= GRAZING * math.sqrt(speed2):
            edge = _on_edge(
                rules, walls, gravity, Two(wall, following.wall), Particle(p.r, v, p.remaining, twice, p.scale2)
            )
            if edge.phase == EDGE:
                return Next(EDGE, edge.v, edge.keep, edge.twice, wall, following.wall, impulse)
        if following.time <= _INSTANT * rules.size / math.sqrt(speed2):
            return Next(CAREFUL, v, 0.0, twice, wall, impulse=impulse)
        return flies
    if not _loses(rules, wall):
        keep = _kept(away, p)
        return Next(HELD, along, keep, _twice_held(u, v, twice, along, keep), wall, impulse=impulse)
    # Chattering: hops of hop, e hop, e^2 hop, ... take hop/(1 - e) together. In this time the wall gives the particle
    # less impulse than one that slides by `away`, which the caller books, and friction gives less in proportion.
    slip = relative(u, along)
    e, speed = rules.laws.restitution_of(wall), norm(slip)
    spared = rules.laws.friction_of(wall) * away
    # `away` may be below 0 by round-off, and a particle that friction has stopped has no direction.
    faster = along + (spared / speed) * slip if speed > abs(spared) else along
    twice += square(faster) - square(along) - away * away if u is None else square(faster) - square(v)
    return Next(HELD, faster, 0.0, twice, wall, -1.0, impulse, hop / (1.0 - e))


def _kept(across, p):
    """Return the speed across its walls that a particle keeps while it slides."""
    return across if across > _NO_HOP * math.sqrt(own_speed2(p)) else 0.0


def _twice_held(drift, v, twice, along, keep):
    """Return twice the energy per mass of a particle that keeps a speed across its walls instead of all of v.

    In the frame of moving walls it is the energy before: the rest is the work of the walls.
    """
    return twice if drift is None else twice + square(along) + keep * keep - square(v)


@outlined
def _on_edge(rules, walls, gravity, two, p):
    """Return `Next` of a particle in an edge: it slides there if both walls press on it."""
    drift = hold.drift(rules.laws.moving, two, walls, p.r)
    taken = two.split_at(walls, drift, p.r, p.v)
    across2, kept2 = _across2(drift, p.v, taken)
    stays = Next(FLYING, p.v, 0.0, p.twice, two.first)
    least = weightless(rules, gravity, p)
    if square(hold.edge(taken.n, taken.m)) < _SHARPEST * _SHARPEST:
        return stays
    n, m = two.presses(walls, p.r, taken.along, accelerated(gravity, ZERO, 1.0))
    if not (n > least and m > least):
        return stays
    if _loses(rules, two.first) or _loses(rules, two.second):
        return Next(EDGE, taken.along, 0.0, p.twice - across2, two.first, two.second)
    keep = _kept(math.sqrt(kept2), p)
    twice = _twice_held(drift, p.v, p.twice, taken.along, keep)
    return Next(EDGE, taken.along, keep, twice, two.first, two.second)


def _across2(drift, v, taken):
    """Return the loss of |v|^2 without the velocity across the walls, and the square of this velocity."""
    if drift is not None:
        return square(v) - square(taken.along), square(v - taken.along)
    across2 = max(square(v) - square(taken.along), 0.0)
    return across2, across2


# --- While it slides -------------------------------------------------------------------------------------


@outlined
def meet(rules, active, walls, gravity, wall, p):
    """Return `Next` of a sliding particle at another wall."""
    bounce = _bounce(rules, walls, gravity, wall, p)
    p, impulse = Particle(p.r, bounce.v, p.remaining, bounce.twice_energy, p.scale2), bounce.impulse
    moving = rules.laws.moving
    away = -dot(_normal(walls, wall, p.r), relative(wall_velocity(moving, walls, wall, p.r), p.v))
    slow = GRAZING * math.sqrt(own_speed2(p))
    drift = hold.drift(moving, active, walls, p.r)
    taken = active.split_at(walls, drift, p.r, p.v)
    flies = Next(FLYING, p.v, 0.0, p.twice, active.first, impulse=impulse)
    if max(abs(taken.b), abs(taken.c)) > slow:
        return flies
    if away <= slow:
        found = _at_rest_there(active, rules, walls, gravity, wall, p)
        if found.phase != FLYING:
            return Next(found.phase, found.v, found.keep, found.twice, found.wall, found.other, impulse)
    across2, kept2 = _across2(drift, p.v, taken)
    keep = _kept(math.sqrt(kept2), p)
    twice = _twice_held(drift, p.v, p.twice, taken.along, keep)
    if _loses(rules, active.first):
        keep, twice = 0.0, p.twice - across2
    return Next(EDGE if active.second >= 0.0 else HELD, taken.along, keep, twice, active.first, active.second, impulse)


def _at_rest_there(active, rules, walls, gravity, wall, p):
    """Return `Next` of a particle too slow to leave the other wall: in the edge, or on that wall alone."""
    if isinstance(active, Two):
        return Next(CAREFUL, p.v, 0.0, p.twice, wall)
    edge = _on_edge(rules, walls, gravity, Two(active.first, wall), p)
    if edge.phase == EDGE:
        return edge
    pull, n = accelerated(gravity, ZERO, 1.0), _normal(walls, wall, p.r)
    moving = rules.laws.moving
    u = wall_velocity(moving, walls, wall, p.r)
    away = -dot(n, relative(u, p.v))
    along = p.v + away * n
    if not _press(walls, wall, p.r, along, pull) > weightless(rules, gravity, p):
        return edge
    drawn = sliding.force(NONE, One(wall), walls, gravity, p.r, along).acceleration
    if dot(_normal(walls, active.first, p.r), drawn) > 0.0:
        return edge
    keep = _kept(away, p)
    twice = _twice_held(u, p.v, p.twice, along, keep)
    if _loses(rules, wall):
        keep, twice = 0.0, p.twice - (away * away if moving is None else square(p.v) - square(along))
    return Next(HELD, along, keep, twice, wall)


@outlined
def careful(rules, walls, gravity, wall, p, impulse):
    """Make a short step of a particle that several walls hold; return its `Landing`, and add to impulse[:, 0]."""
    shortest = 2.0 * GRAZING * rules.size / math.sqrt(own_speed2(p))
    contacts = touching.ImpactSettings(None, rules.laws, shortest, TOUCH * rules.size)
    return touching.impact(
        contacts, walls, gravity, wall, touching.ParticleMoment(p.r, p.v, p.remaining), energy_of(p.twice), impulse, 0
    )


@outlined
def settles(rules, walls, gravity, p, active):
    """Whether a slow particle is where several walls carry its weight together; see `are_carried` for `active`."""
    slow = square(p.v) <= GRAZING * GRAZING * own_speed2(p)
    return slow and touching.are_carried(walls, gravity, p.r, p.v, TOUCH * rules.size, active)


def rests(gravity, force):
    """Whether a particle without speed stays at rest."""
    return norm(force.acceleration) <= ALLOWED * norm(accelerated(gravity, ZERO, 1.0))


@outlined
def off_the_wall(walls, wall, r, v, u):
    """Return a velocity along a wall that lets the particle go, with a part away from it of more than round-off.

    u is the velocity of the wall, or None.
    """
    n = _normal(walls, wall, r)
    b, least = dot(relative(u, v), n), 4.0 * EPSILON * norm(v)
    return v - (b + least) * n if abs(b) <= least else v
