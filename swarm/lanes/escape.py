"""The ends of particles at walls that are open there, or that absorb or detain them."""

import math

from ..contact import crossing
from ..contact.absence import closeness, hit_wall, lets_out, lets_through, open_wall_of, through
from ..contact.energy import contact_energy
from ..contact.events import ARRIVED, FLYING
from ..kernel.arrays import index
from ..kernel.jit import outlined, select
from ..kernel.vector import norm, put
from ..methods.contract import HARD, wall_of
from ..state import absorb
from ..surfaces.presence.openings import is_open
from ..surfaces.presence.rooms import leads_on
from .table import marked_lanes
from .watching.crossings import ParticleMoment
from .watching.log import Struck

# Newton steps from the end of a step onto a wall.
_SWEEPS = 5


def escape(share, p, wall, r, v, remaining):
    """Book that particle p escapes when `remaining` is left of its frame; it keeps its place and velocity."""
    share.state.escape_time[p] = share.moment - remaining
    if share.counters is not None:
        share.counters.settle(share, p, ParticleMoment(r, v, remaining))
    share.watchers.hit(share.state.image, Struck(p, wall, share.moment - remaining, r, v, v, 0.0))


def detain(share, p, wall, remaining, wait):
    """Return whether particle p goes on in this frame after a wait at a wall, or book its absorption or later start."""
    if wait < remaining:
        return True
    if wait == math.inf:
        absorb(share.state, p, wall, share.moment - remaining)
    else:
        share.state.starts[p] = share.moment - remaining + wait
    return False


def let_out_lanes(openings, method, walls, gravity, share, lanes, live):
    """Let lanes out that have flown to an open wall, if no closed wall is at the same place.

    A lane with another room behind the wall goes into that room, and its flight goes on in the next pass.
    """
    near = closeness(walls)
    for i in range(index(live)):
        lanes.marked[i] = is_open(openings, wall_of(lanes.wall[i]), lanes.lane(i).r, near)
    for k in range(marked_lanes(lanes, live)):
        i = index(lanes.order[k])
        flier = lanes.lane(i)
        r, v = flier.r, flier.v
        now = walls.at(flier.remaining)
        wall = hit_wall(openings, method, now, (r, v), wall_of(lanes.wall[i]), near)
        if not lets_through(openings, now, wall, r, near):
            lanes.wall[i] = select(lanes.wall[i] <= HARD, HARD - wall, wall)
            continue
        if leads_on(now, wall, r):
            (flier.r, flier.v), lanes.wall[i] = through(now, gravity, wall, (r, v)), -1.0
            continue
        _escape_lane(share, lanes, i, wall, flier.remaining)


def _escape_lane(share, lanes, i, wall, remaining):
    """End the frame of a lane that escapes when `remaining` is left of it [s], and book the escape."""
    flier, p, counters = lanes.lane(i), index(lanes.particle[i]), share.counters
    if counters is not None:
        counters.retire(share.state, lanes, p, i)
    escape(share, p, wall, flier.r, flier.v, remaining)
    if counters is not None:
        counters.load(share.state, lanes, p, i)
    flier.remaining, lanes.wall[i] = 0.0, -1.0


# --- Steps into walls ------------------------------------------------------------------------------------


def face_lanes(openings, method, walls, gravity, share, lanes, live):
    """Set the walls that are open to each lane in its step: those open at its foot on them at the start of the step."""
    for i in range(index(live)):
        for k, _wall in enumerate(walls.each):
            lanes.stand[k, i] = 1.0
        if lanes.wall[i] != -1.0:
            _face(openings, method, walls, gravity, share, lanes, i)


@outlined
def _face(openings, method, walls, gravity, share, lanes, i):
    lane, near, lost, some_open = lanes.given(method, i), closeness(walls), 0.0, False
    now = method.at_start(walls, lane.remaining)
    for k, wall in enumerate(now.each):
        if lets_out(openings, method, now, float(k), wall.project(lane.r), near):
            lanes.stand[k, i], some_open = 0.0, True
            if method.laws_at_ends is not None:
                cut_contact(method, now, share, lanes, i, k)
            # The energy that the contact has stored is lost.
            lost += method.law.stored_energy(wall.gap_of(wall.inner(lane.r)))
    if some_open:
        _lose(method, share, lanes, i, lost)
        lanes.wall[i] = method.touched(lanes.faced(walls, i), gravity, lane)


def _lose(method, share, lanes, i, lost):
    """Book a loss of energy [J] of a lane."""
    state, p = share.state, index(lanes.particle[i])
    state.dissipated[p] += lost
    lane = lanes.lane(i)
    lane.twice -= 2.0 * lost / state.mass[p]
    if not method.dissipates:
        # Otherwise the energy is booked with the work of the walls, when the lane retires.
        state.energy[p] -= lost / state.mass[p]


def step_out_lanes(method, walls, share, lanes, live):
    """Let lanes out that have stepped through an open wall; return whether there was one."""
    found = False
    if lanes.stand is None:
        return found
    for i in range(index(live)):
        # A hard lane has not taken its step yet.
        if lanes.wall[i] > HARD:
            found = step_out(method, walls, share, lanes, i) | found
    return found


@outlined
def step_out(method, walls, share, lanes, i):
    """Let a lane out if it has stepped through an open wall; lose energy stored in others; return whether it has."""
    flier, out = lanes.lane(i), -1.0
    for k, wall in enumerate(method.at_start(walls, flier.remaining).each):
        if lanes.stand[k, i] == 0.0 and wall.level_of(wall.inner(flier.r)) > 0.0:
            out = float(k)
    if out < 0.0:
        return False
    leave_contacts(method, walls, share, lanes, i)
    _escape_lane(share, lanes, i, out, method.seconds(flier.remaining))
    lanes.marked[i] = True
    return True


# --- Contacts that do not end by themselves --------------------------------------------------------------


@outlined
def leave_contacts(method, walls, share, lanes, i):
    """End the contacts of a lane that leaves: their stored energy is lost, and each contact has a row in the log."""
    now, r = method.at_start(lanes.faced(walls, i), lanes.lane(i).remaining), lanes.lane(i).r
    _lose(method, share, lanes, i, contact_energy(method.law, now, 1.0, r))
    if method.laws_at_ends is not None:
        for k in range(walls.length()):
            cut_contact(method, now, share, lanes, i, k)


@outlined
def cut_contact(method, now, share, lanes, i, row):
    """End a contact without its laws, at a wall that is open there or when the lane leaves."""
    state, lane, p = share.state, lanes.lane(i), lanes.particle[i]
    if share.log is not None:
        time = share.moment - method.seconds(lane.remaining)
        log_cut_contact(share.log, method.laws_at_ends, now, state, row, (p, lane.r, lane.v, time))
    state.pressed[row, index(p)] = state.rubbed[row, index(p)] = 0.0


def log_cut_contact(log, laws, now, state, row, at):
    """Log a contact that laws do not end, with its impulse so far; `at` is (particle, place, velocity, time)."""
    p, r, v, time = at
    i = index(p)
    impulse = (state.pressed[row, i] + state.rubbed[row, i]) * state.mass[i]
    if impulse > 0.0:
        wall = wall_of_row(now, row, r)
        log.hit(state.image, log.with_slip(laws, now, Struck(p, wall, time, foot_on(now, wall, r), v, v, impulse)))


def foot_on(now, wall, r):
    """Return the contact point on a wall of a point near it: some walls have exact normals only on the wall."""
    for _sweep in range(_SWEEPS):
        r = now.project(wall, r)
    return r


def wall_of_row(walls, row, r):
    """Return the wall of a row; in a field the member that the point is deepest in, or nearest to."""
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


# --- Particles that slide --------------------------------------------------------------------------------


@outlined
def is_at_opening(slide, now, i):
    """Whether a wall that holds a sliding lane is open there; then set the lane to meet it as after a flight."""
    lanes, lane = slide.lanes, slide.lanes.lane(i)
    near = crossing.near(slide.method, lane.r)
    wall = open_wall_of(lanes.openings, slide.method, now, slide.active(lane), lane.r, near)
    if wall < 0.0:
        return False
    slide.state.contacts.met[lanes.particle[i]] = wall
    lane.v = slide.with_kept(now, lane)
    lane.keep = 0.0
    return True


@outlined
def let_out(walls, gravity, share, i, wall, r, v, remaining):
    """Let particle i escape through an open wall, or fly into the room behind it with its kept speed."""
    state, contacts = share.state, share.state.contacts
    if not leads_on(walls, wall, r):
        escape(share, i, wall, r, v, remaining)
        end_frame(share, i)
        return
    first, second, keep = contacts.walls[0, i], contacts.walls[1, i], contacts.keep[i]
    if keep > 0.0 and first >= 0.0:
        n = walls.unit_normal(first, r)
        n = n + walls.unit_normal(second, r) if second >= 0.0 else n
        v = v - (keep / norm(n)) * n
    r, v = through(walls, gravity, wall, (r, v))
    put(state.position, 0, i, r)
    put(state.velocity, 0, i, v)
    contacts.remaining[i], contacts.keep[i], contacts.step[i] = remaining, 0.0, 0.0
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    contacts.phase[i] = FLYING
    share.hand_over(i, FLYING)


def end_frame(share, i):
    """End the frame of particle i, which no wall holds."""
    contacts = share.state.contacts
    contacts.remaining[i], contacts.keep[i] = 0.0, 0.0
    contacts.walls[0, i], contacts.walls[1, i] = -1.0, -1.0
    contacts.phase[i] = FLYING
    share.hand_over(i, ARRIVED)
