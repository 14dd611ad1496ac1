"""What rests on walls that move: it goes with them as long as friction, or a balance of forces, holds it there."""

from ..contact import hold
from ..contact import laws as wall_laws
from ..contact import sliding as slides
from ..contact.events import ARRIVED, EDGE, HELD
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
    u = walls.velocity(now, first, r)
    if square(v - u) > SLOWEST * rows[SCALE2, i] or not _rests(kind, method, now, gravity, lanes, i, r):
        return phase_of(kind)
    pace, low, high = walls.pace(now, first), 0.0, 0.0
    pressed, pressed_second = 0.0, 0.0
    while low < left:
        step = min(pace, left - low)
        high = left if low + step >= left else low + step
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
        low = high
    end = low
    if low < left:
        start = low
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
    push(state, lanes, i, pressed, pressed_second)
    work(moving, state, lanes, i, given, 0.0)
    state.contacts.sliding[lanes.particle[i]] += end
    if not after > 0.0:
        return ARRIVED
    held = hold.of_lane(kind, first, rows[WALL + 1, i])
    force = slides.force(methods.laws(method), held, then, gravity, r1, v1)
    put(rows, A, i, force.acceleration)
    rows[PRESS, i], rows[PRESS + 1, i] = force.n, force.m
    return phase_of(kind)


@outlined
def _rests(kind, method, now, gravity, lanes, i, r):
    """Whether a lane that moves with its first wall goes on to do so from here."""
    force, acceleration = _force_at_rest(kind, method, now, gravity, lanes, i, r)
    pull = norm(accelerated(gravity, ZERO, 1.0)) + norm(acceleration)
    pressed = not hold.lets_go(kind, force.n, force.m)
    return pressed and pull > 0.0 and norm(force.acceleration - acceleration) <= ALLOWED * pull


@outlined
def _force_at_rest(kind, method, now, gravity, lanes, i, r):
    """The force on a lane at r that moves with its first wall, and the acceleration of that."""
    first = lanes.rows[WALL, i]
    held = hold.of_lane(kind, first, lanes.rows[WALL + 1, i])
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
