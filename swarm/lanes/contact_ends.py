"""Laws of walls in methods with contacts that take time: a law acts where a contact ends.

Over its steps the contact has reversed the normal velocity of the particle, as a wall without laws does. The laws then
act as at an impact on a rigid wall at which the particle arrives with that velocity reversed again. So restitution,
temperatures and all other laws, and the energy that they take, are those of `Impact` for any penalty. Friction is
Coulomb's, with the whole impulse of the contact, including the part that carries a weight.

In an edge another wall may have given a part of the speed away b. After an arrival with the speed a the impulses of
this wall, I, and of other walls, O, leave b = I + O - a. So this wall has given at most
    c = min(b, I),                                                                                        (1)
of b, and its laws act as at a rigid wall that goes away with x = b - c, at which the particle arrives with c. With
v = v' - x n the energy |v|^2 changes by
        -2 x n.dv                                                                                             (2)
more than |v'|^2. The impulse is I - 2 c + (c + c'), where c' is the speed away that the laws leave: it never pulls.
"""

import math

import numpy as np

from ..contact.reflection import given, relative, rub, wall_velocity
from ..contact.wall_impact import Arriving, book_energy, impact_on_wall
from ..kernel.arrays import index, scratch
from ..kernel.gravity import potential
from ..kernel.jit import outlined, select
from ..kernel.vector import dot, norm, square
from .accounts import add_work
from .escape import cut_contact, detain, foot_on, leave_contacts, wall_of_row
from .watching.log import Struck

# The fraction of its speed before a step that round-off leaves to a particle that friction stops.
_STOPPED = 1e-9


def counts_by_impulse(method):
    """Whether a contact counts as an impact when its impulse begins; otherwise the method decides, from the gap."""
    return method.steps_into_walls and method.laws_at_ends is not None


def end_contacts(method, walls, gravity, share, lanes, i, before, pushed):
    """Add the impulse of a wall, `pushed` = (wall, impulse per mass), to a lane; apply its laws if the contact ends.

    `before` is the velocity at the start of the step.
    """
    if method.laws_at_ends is None:
        return
    wall, impulse = pushed
    if wall >= 0.0:
        state, row, p = share.state, index(walls.row(wall)), index(lanes.particle[i])
        if counts_by_impulse(method) and impulse > 0.0 and not _lasts(state, row, p):
            lanes.lane(i).hits += 1.0
        state.pressed[row, p] += impulse
        if _lasts(state, row, p):
            _end(method, walls, gravity, share, lanes, i, before, wall)


def impulses_before(method, walls, lanes, i):
    """Return the impulses of the walls on a lane before its hard pass."""
    if method.laws_at_ends is None and not method.steps_into_walls:
        return None
    kept = scratch(walls.length(), np.float64)
    for s in range(walls.length()):
        kept[s] = lanes.impulse[s, i]
    return kept


def count_hard_contacts(method, walls, share, lanes, i, start, kept):
    """Count the contacts that begin in a hard pass of steps into walls; the lane was `start` before."""
    if not method.steps_into_walls:
        return
    flier, p, faced = lanes.lane(i), index(lanes.particle[i]), lanes.faced(walls, i)
    before, after = method.at_start(faced, start.remaining), method.at_start(faced, flier.remaining)
    for s in range(walls.length()):
        wall, pushes = wall_of_row(walls, s, start.r), lanes.impulse[s, i] > kept[s]
        if counts_by_impulse(method):
            begins = pushes and not _lasts(share.state, s, p)
        else:
            # The midpoint rule may end outside before it feels a force.
            begins = pushes or method.is_outside(after, wall, flier.r)
            begins = begins and not method.is_outside(before, wall, start.r)
        if begins:
            flier.hits += 1.0
            if share.counts is not None:
                share.counts.add(wall, 1.0)


def end_hard_contacts(method, walls, gravity, share, lanes, i, before, kept):
    """Call `end_contacts` for all walls after a hard pass."""
    if method.laws_at_ends is None:
        return
    state, p = share.state, index(lanes.particle[i])
    for s in range(walls.length()):
        state.pressed[s, p] += lanes.impulse[s, i] - kept[s]
    for s in range(walls.length()):
        # A wall that absorbs the particle ends its other contacts.
        if _lasts(state, s, p):
            _end(method, walls, gravity, share, lanes, i, before, wall_of_row(walls, s, lanes.lane(i).r))


def _lasts(state, row, p):
    """Whether a particle is in a contact with the wall of a row, which has given it an impulse."""
    return state.pressed[row, p] + state.rubbed[row, p] > 0.0


@outlined
def _end(method, walls, gravity, share, lanes, i, before, wall):
    flier, p, row = lanes.lane(i), index(lanes.particle[i]), index(walls.row(wall))
    state, v = share.state, flier.v
    now = method.at_start(lanes.faced(walls, i), flier.remaining)
    r = foot_on(now, wall, flier.r)
    n, u = now.unit_normal(wall, r), wall_velocity(method.moving, now, wall, r)
    away, pressed = -dot(relative(u, v), n), state.pressed[row, p]
    if method.is_outside(now, wall, flier.r):
        if away <= _STOPPED * norm(before) and dot(relative(u, before), n) < 0.0:
            # If a weight makes the contact last, friction acts each time the particle turns back, and where friction at
            # another wall stops the particle.
            state.rubbed[row, p] += pressed
            state.pressed[row, p] = 0.0
            _drag(method, walls, share, lanes, i, (wall, n, u, pressed))
        return
    if away <= 0.0 and not method.steps_into_walls:
        # A loop that has not converged has left it on its way out: the next step is another contact.
        _drag(method, walls, share, lanes, i, (wall, n, u, pressed))
        cut_contact(method, now, share, lanes, i, row)
        return
    whole = state.rubbed[row, p] + pressed
    state.pressed[row, p] = state.rubbed[row, p] = 0.0
    _act(method, walls, now, gravity, share, lanes, i, (wall, r, n, u, max(away, 0.0), pressed, whole))


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
    time, mass = share.moment - method.seconds(flier.remaining), share.state.mass[p]
    # The arrival at a rigid wall, (1)
    c = min(b, impulse)
    before = flier.v + 2.0 * c * n
    if laws.loses or laws.send_off:
        impulse += _send(method, walls, now, gravity, share, lanes, i, at) - 2.0 * c
    if share.log is not None:
        struck = Struck(lanes.particle[i], wall, time, r, before, flier.v, impulse * mass)
        share.log.hit(share.state.image, share.log.with_slip(laws, now, struck))


def _send(method, walls, now, gravity, share, lanes, i, at):
    """Apply the laws of an impact; return the impulse per mass of a rigid wall."""
    wall, r, n, u, b, pressed, impulse = at
    state, flier, p, laws = share.state, lanes.lane(i), index(lanes.particle[i]), method.laws_at_ends
    c, v, mass = min(b, impulse), flier.v, state.mass[p]
    x = b - c
    # v' of (2), and the velocity of its arrival
    apart = v + x * n
    before = apart + 2.0 * c * n
    turned = given(u, apart - before)
    # The number of contacts that ended before this one: all counted ones without this one and those that last.
    number = state.impacts[p] + np.int64(flier.hits) - 1
    for s in range(walls.length()):
        number -= np.int64(_lasts(state, s, p))
    random = share.seeding.of_impact(p, number, laws)
    arriving = Arriving(r, before, square(before) + 2.0 * potential(gravity, r), mass)
    bounce = impact_on_wall(laws._replace(friction=None), now, gravity, wall, arriving, random)
    bounce = _rubbed(laws, wall, n, u, bounce, max(pressed + (bounce.impulse - 2.0 * c), 0.0))
    bounce = _put_back(laws, bounce, x, n, apart)
    # From the velocities: the energy that a step must keep has round-off.
    change = square(bounce.v) - square(v)
    flier.v = bounce.v
    flier.twice += change
    if not method.dissipates:
        state.energy[p] += 0.5 * change
    row = index(now.row(wall))
    lanes.impulse[row, i] += bounce.impulse - 2.0 * c
    add_work(walls, lanes.impulse, i, wall, 0.5 * (bounce.work - turned))
    heat = book_energy(state, (row, p, p), mass, bounce)
    if share.counts is not None:
        share.counts.give(wall, heat, bounce.wait)
    if state.absorbed_time is not None and bounce.wait > 0.0:
        _keep(method, walls, share, lanes, i, wall, bounce.wait)
    return bounce.impulse


def _put_back(laws, bounce, x, n, apart):
    """Add the speed away x, given by other walls, to a `Bounce`; (2) is lost, or heat of the law that has acted."""
    more = -2.0 * x * dot(n, bounce.v - apart)
    is_heat = bounce.is_sent & (bounce.heat != 0.0 if laws.may_dissipate else laws.give_heat)
    lost, heat = bounce.lost - select(is_heat, 0.0, more), bounce.heat + select(is_heat, more, 0.0)
    return bounce._replace(v=bounce.v - x * n, lost=lost, heat=heat)


def _rubbed(laws, wall, n, u, bounce, impulse):
    """Subtract from a `Bounce` what friction takes from the slip, unless a law has sent the particle off."""
    if laws.friction is None or bounce.is_sent:
        return bounce
    w = relative(u, bounce.v)
    v, lost = rub(laws, wall, n, w, impulse)
    work = given(u, v - w)
    return bounce._replace(
        v=bounce.v + (v - w), twice_energy=bounce.twice_energy - lost + work,
        work=bounce.work + work, lost=bounce.lost + lost,
    )  # fmt: skip


def _keep(method, walls, share, lanes, i, wall, wait):
    """Let a lane wait on a wall for whole steps, or be absorbed by it."""
    flier, p = lanes.lane(i), index(lanes.particle[i])
    if method.steps_into_walls and wait < math.inf:
        wait = math.ceil(wait / method.dt) * method.dt
    # Another wall may keep it waiting beyond the end of the frame already.
    wait += max(share.state.starts[p] - share.moment, 0.0)
    if detain(share, p, wall, method.seconds(flier.remaining), wait):
        flier.remaining = flier.remaining - (wait / method.dt if method.steps_into_walls else wait)
    else:
        if wait == math.inf:
            leave_contacts(method, walls, share, lanes, i)
        flier.remaining = 0.0
    lanes.marked[i] = not (flier.remaining > 0.0)
