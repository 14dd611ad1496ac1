"""Laws of walls in methods with contacts that take time: they act where a contact ends.

Over its steps the contact has reversed the normal velocity of the particle, as a wall without laws does. The laws then
act as at an impact on a rigid wall at which the particle arrives with that velocity reversed again. So restitution,
temperatures and all other laws, and the energy that they take, are those of `Impact` for any penalty. Friction is
Coulomb's, with the whole impulse of the contact, also the part that carries a weight.
"""

import math

import numpy as np

from ..contact.reflection import given, relative, rub, wall_velocity
from ..contact.wall_impact import Arriving, RandomSource, book_energy, impact_on_wall
from ..kernel.arrays import index, scratch
from ..kernel.gravity import potential
from ..kernel.jit import outlined
from ..kernel.vector import dot, norm, square
from .accounts import add_work
from .escape import detain
from .watching.log import Struck

# Newton steps onto a wall, from the end of a step.
_SWEEPS = 5
# Of its speed before a step, what friction leaves by round-off of a particle that it stops.
_STOPPED = 1e-9
# An impulse of this part of the speed away has reversed the particle: one that begins at rest has all of it, to
# round-off, of which a shallow contact has much.
_REVERSED = 0.999


def end_contacts(method, walls, gravity, share, lanes, i, before, pushed):
    """Add what a wall (number, impulse per mass) has given a lane in a step, and let its laws act at the contact's end.

    The velocity `before` is that at the start of the step.
    """
    if method.laws_at_ends is None:
        return
    _wall, impulse = pushed
    if impulse > 0.0:
        _end(method, walls, gravity, share, lanes, i, (before, *pushed))


def impulses_before(method, walls, lanes, i):
    """The impulses of the walls on a lane before its hard pass."""
    if method.laws_at_ends is None:
        return None
    kept = scratch(walls.length(), np.float64)
    for s in range(walls.length()):
        kept[s] = lanes.impulse[s, i]
    return kept


def end_hard_contacts(method, walls, gravity, share, lanes, i, before, kept):
    """`end_contacts` with all walls after a hard pass."""
    if method.laws_at_ends is None:
        return
    for s in range(walls.length()):
        pushed = _wall_of_row(walls, s, lanes.lane(i).r), lanes.impulse[s, i] - kept[s]
        end_contacts(method, walls, gravity, share, lanes, i, before, pushed)


def _wall_of_row(walls, row, r):
    """The wall of a row; in a field the member that a point is deepest in, or nearest to."""
    if len(walls.fields()) == 0:
        return float(row)
    return _deepest_of_row(walls, row, r)


@outlined
def _deepest_of_row(walls, row, r):
    number, found, most = walls.numbers_near(r), -1.0, -math.inf
    for k in range(number.size):
        depth = walls.distance(number[k], r)
        if walls.row(number[k]) == row and depth > most:
            found, most = number[k], depth
    return found


@outlined
def _end(method, walls, gravity, share, lanes, i, step):
    before, wall, impulse = step
    flier, p, row = lanes.lane(i), index(lanes.particle[i]), index(walls.row(wall))
    state = share.state
    state.pressed[row, p] += impulse
    now, v = method.at_start(lanes.faced(walls, i), flier.remaining), flier.v
    # Some walls have exact normals on the wall only.
    r = flier.r
    for _sweep in range(_SWEEPS):
        r = now.project(wall, r)
    n, u = now.unit_normal(wall, r), wall_velocity(method.moving, now, wall, r)
    away, pressed = -dot(relative(u, v), n), state.pressed[row, p]
    b = max(away, 0.0)
    if now.distance(wall, flier.r) > 0.0 and (away <= 0.0 or method.lasts_outside(now, wall, flier.r)):
        if away <= _STOPPED * norm(before) and dot(relative(u, before), n) < 0.0:
            # In a contact that a weight makes last, friction acts each time that the particle turns back, and where
            # friction at another wall stops it.
            state.rubbed[row, p] += pressed
            state.pressed[row, p] = 0.0
            _drag(method, walls, share, lanes, i, (wall, n, u, pressed))
        return
    whole = state.rubbed[row, p] + pressed
    state.pressed[row, p] = state.rubbed[row, p] = 0.0
    # An impulse that has not reversed the particle is the rest of a contact that has ended.
    if whole >= _REVERSED * b:
        _act(method, walls, now, gravity, share, lanes, i, (wall, r, n, u, b, pressed, whole))


def _drag(method, walls, share, lanes, i, at):
    """Apply friction in a contact that lasts."""
    wall, n, u, pressed = at
    laws, state, flier, p = method.laws_at_ends, share.state, lanes.lane(i), index(lanes.particle[i])
    if laws.friction is None:
        return
    w = relative(u, flier.v)
    turned, lost = rub(laws, wall, n, w, pressed)
    work = given(u, turned - w)
    flier.v = flier.v + (turned - w)
    flier.twice += work - lost
    if not method.dissipates:
        state.energy[p] += 0.5 * (work - lost)
    add_work(walls, lanes.impulse, i, wall, 0.5 * work)
    state.dissipated[p] += 0.5 * lost * state.mass[p]


def _act(method, walls, now, gravity, share, lanes, i, at):
    """Apply the laws of a wall where a contact ends.

    `at` is (wall, place, normal, velocity, speed away, impulse since friction last acted, impulse).
    """
    wall, r, n, _u, b, _pressed, impulse = at
    flier, p, laws = lanes.lane(i), index(lanes.particle[i]), method.laws_at_ends
    mass = share.state.mass[p]
    # As it would arrive at a rigid wall
    before = flier.v + 2.0 * b * n
    if laws.loses or laws.send_off:
        impulse += _send(method, walls, now, gravity, share, lanes, i, at) - 2.0 * b
    if share.log is not None:
        time = share.moment - method.seconds(flier.remaining)
        struck = Struck(lanes.particle[i], wall, time, r, before, flier.v, impulse * mass)
        share.log.hit(share.state.image, share.log.with_slip(laws, now, struck))


def _send(method, walls, now, gravity, share, lanes, i, at):
    """Let the laws act: the impulse per mass of a rigid wall."""
    wall, r, n, u, b, pressed, _impulse = at
    state, flier, p, laws = share.state, lanes.lane(i), index(lanes.particle[i]), method.laws_at_ends
    v, mass = flier.v, state.mass[p]
    before = v + 2.0 * b * n
    turned = given(u, v - before)
    # Of the impacts before this one, which has been counted.
    number = state.impacts[p] + np.int64(flier.hits) - 1
    random = RandomSource(share.seed, share.first).of_impact(p, number, laws)
    arriving = Arriving(r, before, square(before) + 2.0 * potential(gravity, r), mass)
    bounce = impact_on_wall(laws._replace(friction=None), now, gravity, wall, arriving, random)
    bounce = _rubbed(laws, wall, n, u, bounce, bounce.impulse + max(pressed - 2.0 * b, 0.0))
    # Of the velocities themselves: what a step is to keep is known to round-off.
    change = square(bounce.v) - square(v)
    flier.v = bounce.v
    flier.twice += change
    if not method.dissipates:
        state.energy[p] += 0.5 * change
    row = index(now.row(wall))
    lanes.impulse[row, i] += bounce.impulse - 2.0 * b
    add_work(walls, lanes.impulse, i, wall, 0.5 * (bounce.work - turned))
    heat = book_energy(state, (row, p, p), mass, bounce)
    if share.counts is not None:
        share.counts.give(wall, heat, bounce.wait)
    if state.absorbed is not None and bounce.wait > 0.0:
        _keep(method, share, lanes, i, wall, bounce.wait)
    return bounce.impulse


def _rubbed(laws, wall, n, u, bounce, impulse):
    """A `Bounce` less what friction takes of the slip, but of what a law has sent off."""
    if laws.friction is None or bounce.is_sent:
        return bounce
    w = relative(u, bounce.v)
    v, lost = rub(laws, wall, n, w, impulse)
    work = given(u, v - w)
    return bounce._replace(
        v=bounce.v + (v - w), twice_energy=bounce.twice_energy - lost + work,
        work=bounce.work + work, lost=bounce.lost + lost,
    )  # fmt: skip


def _keep(method, share, lanes, i, wall, wait):
    """A lane waits on a wall for whole steps, or is absorbed by it."""
    flier, p = lanes.lane(i), index(lanes.particle[i])
    if method.steps_into_walls and wait < math.inf:
        wait = math.ceil(wait / method.dt) * method.dt
    if detain(share, p, wall, method.seconds(flier.remaining), wait):
        flier.remaining = flier.remaining - (wait / method.dt if method.steps_into_walls else wait)
    else:
        flier.remaining = 0.0
    lanes.marked[i] = not (flier.remaining > 0.0)
