"""Carry particles that rest in a corner of three walls, some of which move, while all three walls press.

The places and velocities follow from the three walls alone. So the length of a step depends only on how fast the
motion of the walls changes; the forces follow from the acceleration. Before one of them lets go, another wall may
strike the particle.
"""

import math

from ..contact import crossing, events
from ..contact import laws as wall_laws
from ..contact.events import ARRIVED, CAREFUL, EVENT
from ..contact.hold import Three
from ..contact.path import StepPath
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import outlined, select
from ..kernel.limits import EPSILON
from ..kernel.record import Record
from ..kernel.vector import ZERO, Vec, absolute, cross, dot, norm, put, square, total

# The phase of a particle that these walls do not carry.
NOT_CARRIED = -1
# Three walls hold no point if their unit normals span a volume below this.
_FLATTEST = 1e-6
# A relative speed below this fraction of the particle's own speed is zero if no wall loses energy.
_NO_SPEED = 1e-13
# Sweeps to move a point onto three walls; flat walls need one.
_SWEEPS = 20
# The round-off of the velocity of a corner, relative to the sum of the speeds of its walls, if they are orthogonal.
_NO_SLIP = 8.0 * EPSILON
# The factor that shortens a step after which a wall does not press, and the most cuts of a step to another wall.
_RETRY, _MOST_TRIES = 0.25, 100


class Corner(Record):
    """The effect of three walls on a particle that moves with them, at one instant."""

    holds: bool  # whether all walls press
    u: Vec  # velocity of the particle
    load: Vec  # force of each wall, per mass
    power: Vec  # power of each wall by its motion, per mass
    heat: float  # power lost to friction, per mass


_NONE = Corner(False, ZERO, ZERO, ZERO, 0.0)
_NO_WALLS = Three(-1.0, -1.0, -1.0)


# --- One corner ------------------------------------------------------------------------------------------


def _solved(a, b, c, x, y, z):
    """Return the vector that has the products x, y and z with a, b and c; infinite or NaN if these are in a plane."""
    bc = cross(b, c)
    return (x * bc + y * cross(c, a) + z * cross(a, b)) / dot(a, bc)


def _parts(a, b, c, w):
    """Return the coefficients (x, y, z) of w = x a + y b + z c."""
    bc = cross(b, c)
    return Vec(dot(w, bc), dot(w, cross(c, a)), dot(w, cross(a, b))) / dot(a, bc)


@outlined
def _normals(walls, active, r):
    return tuple(walls.unit_normal(wall, r) for wall in active)


def _force(friction, wall, n, slip, none):
    """Return the direction of the force of a wall, -(n + mu s/|s|), without its sign; a slip up to `none` is zero.

    A wall that moves with the particle needs no friction, since the normals of the three walls hold the particle.
    """
    if friction is None:
        return n
    speed, slips = norm(slip), norm(slip) > none
    return n + select(slips, wall_laws.of_wall(friction, wall) / select(slips, speed, 1.0), 0.0) * slip


@outlined
def _corner(laws, walls, gravity, active, r, least):
    """Return the `Corner` of three walls at a point on them; it holds if each wall presses by more than `least`."""
    a, b, c = _normals(walls, active, r)
    volume = abs(dot(a, cross(b, c)))
    if not volume > _FLATTEST:
        return _NONE
    v, w, x = tuple(walls.velocity(wall, r) for wall in active)
    u, pull = _solved(a, b, c, dot(a, v), dot(b, w), dot(c, x)), accelerated(gravity, ZERO, 1.0)
    # The pull that remains in the frame of the particle
    rest = _solved(a, b, c, *(walls.outward_acceleration(wall, r, u, pull) for wall in active))
    friction = laws.friction
    # Between walls of one body every slip is round-off, in an arbitrary direction.
    none = _NO_SLIP * (norm(v) + norm(w) + norm(x)) / volume
    slips = zip(active, (a, b, c), (u - v, u - w, u - x), strict=True)
    p, q, s = tuple(_force(friction, *one, none) for one in slips)
    load = _parts(p, q, s, rest)
    holds = (load.x > least) & (load.y > least) & (load.z > least)
    power = Vec(-load.x * dot(p, v), -load.y * dot(q, w), -load.z * dot(s, x))
    heat = load.x * dot(p, u - v) + load.y * dot(q, u - w) + load.z * dot(s, u - x)
    return Corner(holds, u, load, power, heat)


@outlined
def _find(laws, walls, gravity, r, near, least):
    """Return `Three` walls that hold a particle at a point, from those within `near` of it, or `_NO_WALLS`."""
    number = walls.numbers_near(r)
    count = 0
    for i in range(number.size):
        if walls.distance(number[i], r) >= -near:
            number[count] = number[i]
            count += 1
    for i in range(count):
        for j in range(i):
            for k in range(j):
                active = Three(number[i], number[j], number[k])
                corner = _corner(laws, walls, gravity, active, r, least)
                if corner.holds:
                    return active
    return _NO_WALLS


@outlined
def _settled(walls, active, r):
    """Move a point near three walls onto them; return the point and whether it is on them."""
    least = 4.0 * EPSILON * total(absolute(r))
    for _sweep in range(_SWEEPS):
        a, b, c = _normals(walls, active, r)
        # Distances to walls continued beyond their edges: the facets of a mesh end in the corner.
        d, e, f = tuple(dot(n, r - walls.project(wall, r)) for wall, n in zip(active, (a, b, c), strict=True))
        if max(abs(d), abs(e), abs(f)) <= least:
            return r, True
        r = r - _solved(a, b, c, d, e, f)
    return r, False


@outlined
def _ahead(walls, now, active, r, u, remaining, h):
    """Return a place near three walls after a time h: the first wall carries it, and along this wall it moves straight.

    If the walls belong to one body, the place is on them, however they turn.
    """
    carried = walls.during(remaining, remaining - h).carry(active.first, r)
    return carried + h * (u - now.velocity(active.first, r))


# --- During the motion with the walls --------------------------------------------------------------------


@outlined
def is_carried(method, walls, gravity, p):
    """Whether three walls, some of which move, carry a particle that is slow in their corner."""
    now = walls.at(p.remaining)
    active = _find(method.laws, now, gravity, p.r, events.TOUCH * method.size, events.weightless(method, gravity, p))
    if active.first < 0.0:
        return False
    u = _corner(method.laws, now, gravity, active, p.r, 0.0).u
    part = events.GRAZING if method.laws.loses else _NO_SPEED
    return square(p.v - u) <= part * part * events.own_speed2(p)


@outlined
def carry(method, walls, gravity, state, i, p):
    """Carry a particle; return its next phase, or `NOT_CARRIED`."""
    if not is_carried(method, walls, gravity, p):
        return NOT_CARRIED
    laws, near, least = method.laws, events.TOUCH * method.size, events.weightless(method, gravity, p)
    shortest = 2.0 * events.GRAZING * method.size / math.sqrt(events.own_speed2(p))
    r, remaining, now = p.r, p.remaining, walls.at(p.remaining)
    active = _find(laws, now, gravity, r, near, least)
    start, h, phase, used, tries = _corner(laws, now, gravity, active, r, 0.0), p.remaining, CAREFUL, 0.0, 0
    while remaining > 0.0 and tries <= _MOST_TRIES:
        h = min(h, remaining, now.shortest_time_scale())
        way = (walls, now, active, r, start.u, remaining)
        middle, _there = _settled(walls.at(remaining - 0.5 * h), active, _ahead(*way, 0.5 * h))
        r1, there = _settled(walls.at(remaining - h), active, _ahead(*way, h))
        half = _corner(laws, walls.at(remaining - 0.5 * h), gravity, active, middle, 0.0)
        end = _corner(laws, walls.at(remaining - h), gravity, active, r1, 0.0)
        if not (there and half.holds and end.holds):
            h *= _RETRY
            if h < shortest:
                break
            continue
        path = StepPath(r, start.u, r1, end.u, h)
        none = crossing.near(method, r)
        if crossing.meets(now, walls.at(remaining - h), active, path, none):
            found = crossing.arrival(walls, active, path, none, remaining)
            if found.time == 0.0:
                phase = EVENT if used > 0.0 else phase
                state.contacts.met[i] = found.wall
                break
            if found.time < 1.0:
                # Ends the step where the other wall is, which the particle then meets at once.
                h *= found.time
                tries += 1
                continue
        if used == 0.0:
            _stop(now, gravity, state, i, p, active, start.u)
        _book(walls, gravity, state, i, active, (start, half, end), (r1, h, remaining == h))
        used += h
        remaining = 0.0 if remaining == h else remaining - h
        r, now, start, h, tries = r1, walls.at(remaining), end, h / _RETRY, 0
    if used == 0.0:
        return NOT_CARRIED
    put(state.position, 0, i, r)
    put(state.velocity, 0, i, start.u)
    state.contacts.sliding[i] += used
    state.contacts.remaining[i] = remaining
    return phase if remaining > 0.0 else ARRIVED


@outlined
def _stop(now, gravity, state, i, p, active, u):
    """Book the impulses and the energy with which the walls stop a velocity relative to them."""
    a, b, c = _normals(now, active, p.r)
    taken, mass = _parts(a, b, c, p.v - u), state.mass[i]
    given = _push(now, state, i, active, taken, Vec(
        -taken.x * dot(a, u), -taken.y * dot(b, u), -taken.z * dot(c, u)
    ))  # fmt: skip
    after = 0.5 * square(u) + potential(gravity, p.r)
    state.dissipated[i] += (0.5 * p.twice - after + given) * mass
    state.energy[i] = after


@outlined
def _book(walls, gravity, state, i, active, corners, end):
    """Book a step by Simpson's rule; `end` is (place at its end, length, whether the frame ends with it)."""
    start, half, last = corners
    r1, h, _ends = end
    sixth = h * (1.0 / 6.0)
    load = sixth * (start.load + 4.0 * half.load + last.load)
    work = sixth * (start.power + 4.0 * half.power + last.power)
    heat = sixth * (start.heat + 4.0 * half.heat + last.heat)
    after = 0.5 * square(last.u) + potential(gravity, r1)
    # The energy has more digits than the work of the walls: the wall with the most work takes the remainder.
    rest = after - state.energy[i] + heat - (work.x + work.y + work.z)
    x, y, z = abs(work.x), abs(work.y), abs(work.z)
    first, second = (x >= y) & (x >= z), (y > x) & (y >= z)
    work = work + Vec(select(first, rest, 0.0), select(second, rest, 0.0), select(first | second, 0.0, rest))
    _push(walls, state, i, active, load, work)
    state.dissipated[i] += heat * state.mass[i]
    state.energy[i] = after


@outlined
def _push(walls, state, i, active, load, work):
    """Book impulses and works per mass of three walls; return the sum of the works."""
    behind, mass = walls.length(), state.mass[i]
    for wall, given, done in zip(active, load, work, strict=True):
        row = walls.row(wall)
        state.impulse[row, i] += given * mass
        state.impulse[behind + row, i] += done * mass
    return work.x + work.y + work.z
