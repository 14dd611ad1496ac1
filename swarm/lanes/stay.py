"""What rests where walls move: it goes with its wall as long as friction, or a balance of forces, holds it there.

Until then another wall may come, and strike it.
"""

from typing import NamedTuple

from ..contact import crossing, hold
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..contact.events import ARRIVED, EDGE, EVENT, HELD
from ..contact.projection import ALLOWED
from ..kernel.gravity import accelerated, potential
from ..kernel.jit import by_type, by_type_outlined, outlined
from ..kernel.vector import ZERO, column, norm, put, square
from ..methods import contract as methods
from ..surfaces import fold as walls
from ..surfaces.moving import at, during
from .compose import KEEP, LEFT, PRESS, SCALE2, SLOWEST, TWICE, WALL, A, R, V, push, work

# Halvings of the interval in which a wall lets a particle go that rests on it.
_HALVINGS = 60
# So many paces it stays at a time, and is asked again: a frame may have millions of them, and between them halts count.
# (Rejected: a halt in any of them. What is carried in two parts is rounded twice.)
_MOST_PACES = 128.0
# A lane goes on to stay.
AGAIN = -1
# Steps in the search for another wall that comes: where none is met after so many, it is too near to be told.
_MOST_STEPS = 10_000


class Clear(NamedTuple):
    """Until when no other wall is met, and the wall that is met then, or -1."""

    time: float
    wall: float


@by_type
def phase_of(kind):
    """The phase of particles that one wall holds, or two."""
    return HELD


phase_of.register(hold.Two, lambda kind: EDGE)


@by_type_outlined
def stay(moving, kind, method, chain, gravity, state, lanes, i):
    """What a lane does that moves with its walls as long as friction, or a balance of forces, holds it there."""
    return phase_of(kind)


@stay.register(wall_laws.Moves)
def _(moving, kind, method, chain, gravity, state, lanes, i):
    rows, left, first = lanes.rows, lanes.rows[LEFT, i], lanes.rows[WALL, i]
    r, v = column(rows, R, i), column(rows, V, i)
    now = at(chain, left)
    u, slowest = walls.velocity(now, first, r), SLOWEST * rows[SCALE2, i]
    moves_on = square(v - u) > slowest or _rubs(kind, methods.laws(method), now, lanes, i, r, slowest)
    if moves_on or not _rests(kind, method, now, gravity, lanes, i, r):
        return phase_of(kind)
    pace, low, high, met, paces = walls.shortest_pace(now), 0.0, 0.0, -1.0, 0.0
    pressed, pressed_second = 0.0, 0.0
    while low < left and met < 0.0 and paces < _MOST_PACES:
        step = min(pace, left - low)
        clear = _clear(kind, method, chain, lanes, i, low, left if low + step >= left else low + step)
        high = clear.time
        middle = 0.5 * (low + high)
        if not (
            _rests_later(kind, method, chain, gravity, lanes, i, middle)
            and _rests_later(kind, method, chain, gravity, lanes, i, high)
        ):
            break
        # Simpson's rule for what presses
        one, two, three = (
            _press_later(kind, method, chain, gravity, lanes, i, low),
            _press_later(kind, method, chain, gravity, lanes, i, middle),
            _press_later(kind, method, chain, gravity, lanes, i, high),
        )
        pressed += (one.n + 4.0 * two.n + three.n) * ((high - low) / 6.0)
        pressed_second += (one.m + 4.0 * two.m + three.m) * ((high - low) / 6.0)
        low, met, paces = high, clear.wall, paces + 1.0
    end, start, goes_on = low, low, paces == _MOST_PACES and met < 0.0
    if low < left and met < 0.0 and not goes_on:
        for _k in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if _rests_later(kind, method, chain, gravity, lanes, i, middle):
                low = middle
            else:
                high = middle
        end = high
        one, two = (
            _press_later(kind, method, chain, gravity, lanes, i, start),
            _press_later(kind, method, chain, gravity, lanes, i, low),
        )
        pressed += 0.5 * (one.n + two.n) * (end - start)
        pressed_second += 0.5 * (one.m + two.m) * (end - start)
    after = left - end
    r1 = walls.carry(during(chain, left, after), first, r)
    then = at(chain, after)
    v1 = walls.velocity(then, first, r1)
    twice = square(v1) + 2.0 * potential(gravity, r1)
    given = twice - rows[TWICE, i]
    rows[TWICE, i], rows[LEFT, i], rows[KEEP, i] = twice, after, 0.0
    put(rows, R, i, r1)
    put(rows, V, i, v1)
    push(chain, state, lanes, i, pressed, pressed_second)
    work(moving, chain, state, lanes, i, given, 0.0)
    state.contacts.sliding[lanes.particle[i]] += end
    if goes_on or not after > 0.0:
        return AGAIN if after > 0.0 else ARRIVED
    if met >= 0.0:
        state.contacts.met[lanes.particle[i]] = met
        put(rows, R, i, walls.settle(then, met, r1))
        return EVENT
    held = kind.of_lane(first, rows[WALL + 1, i])
    force = slides.force(methods.laws(method), held, then, gravity, r1, v1)
    put(rows, A, i, force.acceleration)
    rows[PRESS, i], rows[PRESS + 1, i] = force.n, force.m
    return phase_of(kind)


@by_type
def _rubs(kind, laws, now, lanes, i, r, slowest):
    """Whether the second wall has friction and slips on a lane that moves with the first one."""
    return False


@_rubs.register(hold.Two)
def _(kind, laws, now, lanes, i, r, slowest):
    second = lanes.rows[WALL + 1, i]
    slip = column(lanes.rows, V, i) - walls.velocity(now, second, r)
    return wall_laws.of_wall(wall_laws.friction(laws), second) > 0.0 and square(slip) > slowest


@outlined
def _clear(kind, method, chain, lanes, i, low, high):
    """`Clear` of a lane that moves with its first wall, from one time to another."""
    rows, left = lanes.rows, lanes.rows[LEFT, i]
    held = kind.of_lane(rows[WALL, i], rows[WALL + 1, i])
    time, step, met = low, high - low, -1.0
    for _k in range(_MOST_STEPS):
        end = high if time + step >= high else time + step
        start, then = at(chain, left - time), at(chain, left - end)
        path, near = _way(chain, lanes, i, time, end), crossing.near(method, column(rows, R, i))
        if not crossing.meets(start, then, held, path, near):
            if end == high:
                return Clear(high, -1.0)
            time, step = end, 2.0 * step
            continue
        found = crossing.arrival(chain, held, path, near, left - time)
        met = found.wall
        if found.time == 0.0 or not time < end:
            break
        step = (end - time) * min(found.time, 0.5)
    # A path that no wall is found on, however short, is clear of them.
    return Clear(time, met) if met >= 0.0 else Clear(high, -1.0)


@outlined
def _way(chain, lanes, i, start, end):
    """The way of a lane that moves with its first wall, from one time to another."""
    rows, left, first = lanes.rows, lanes.rows[LEFT, i], lanes.rows[WALL, i]
    r = column(rows, R, i)
    r0 = walls.carry(during(chain, left, left - start), first, r)
    r1 = walls.carry(during(chain, left, left - end), first, r)
    v0, v1 = walls.velocity(at(chain, left - start), first, r0), walls.velocity(at(chain, left - end), first, r1)
    return crossing.Path(r0, v0, r1, v1, end - start)


@outlined
def _rests(kind, method, now, gravity, lanes, i, r):
    """Whether a lane that moves with its first wall goes on to do so from here."""
    force, acceleration = _force_at_rest(kind, method, now, gravity, lanes, i, r)
    pull = norm(accelerated(gravity, ZERO, 1.0)) + norm(acceleration)
    pressed = not kind.lets_go(force.n, force.m)
    return pressed and pull > 0.0 and norm(force.acceleration - acceleration) <= ALLOWED * pull


@outlined
def _force_at_rest(kind, method, now, gravity, lanes, i, r):
    """The force on a lane at r that moves with its first wall, and the acceleration of that."""
    first = lanes.rows[WALL, i]
    held = kind.of_lane(first, lanes.rows[WALL + 1, i])
    u = walls.velocity(now, first, r)
    return slides.force(methods.laws(method), held, now, gravity, r, u), walls.acceleration(now, first, r)


@outlined
def _rests_later(kind, method, chain, gravity, lanes, i, t):
    rows = lanes.rows
    left, r = rows[LEFT, i], column(rows, R, i)
    r1 = walls.carry(during(chain, left, left - t), rows[WALL, i], r)
    return _rests(kind, method, at(chain, left - t), gravity, lanes, i, r1)


@outlined
def _press_later(kind, method, chain, gravity, lanes, i, t):
    rows = lanes.rows
    left, r = rows[LEFT, i], column(rows, R, i)
    r1 = walls.carry(during(chain, left, left - t), rows[WALL, i], r)
    force, _acceleration = _force_at_rest(kind, method, at(chain, left - t), gravity, lanes, i, r1)
    return force
