"""Advance the particles of a block to the end of a frame, many at once, each in a lane.

One pass does one flight and one contact for every live lane, in loops without branches, which LLVM vectorises. A lane
retires when its particle reaches the end of the frame, and takes the next particle, or that of the last live lane.
The result does not depend on the lane or the block of a particle.
"""

import math

from ..common.status import Status
from ..contact.events import FLYING
from ..kernel.arrays import index
from ..kernel.jit import kernel, outlined
from ..kernel.record import Record
from ..kernel.vector import put
from ..methods import contract as methods
from ..surfaces.in_motion.moving import Aimed, Carried
from ..surfaces.time_of_impact import aim
from .accounts import add_to_rows, add_work
from .contact_ends import count_hard_contacts, counts_by_impulse, end_contacts, end_hard_contacts, impulses_before
from .escape import face_lanes, let_out_lanes, step_out, step_out_lanes
from .flight import aims, go
from .hit_member import of_lane, pick, picks
from .periodic import return_lanes, return_stepped, return_stepped_lanes
from .sending import send_off
from .solve import count_sweeps, keep_failure, solution, solve
from .table import LANES, LOOK, marked_lanes, with_distances
from .watching import log as impact_log

# The most impacts of one particle in one frame. Beyond them a cusp gives an error after seconds, not hours.
MOST_HITS = 1e8
# A number of passes that no call of `advance_block` reaches.
NEVER = 2**63 - 1


class Hard(Record):
    """The argument of kernels with hard contacts, which double the code to compile and are rare in a smooth cavity."""

    most_hits: float


@kernel
def advance_block(method, walls, gravity, hard, share, lanes):
    """Advance the particles that a thread draws to the end of a frame; return (status, particle, drawn).

    The status is DONE or the failure of `particle`, the first that failed; `drawn` is the number of draws. The contents
    of `lanes` are overwritten. Particles that have arrived are skipped. Three other statuses ask for another call:
        INTERRUPTED   after `share.halt[0]` passes, a number that another thread may change at any time; `particle` is
                      the number of live lanes, and the next call takes `lanes.left_behind` as `share.halted`;
        HARD_CONTACT  at the first hard contact in a call without `hard`: a kernel with `hard` goes on from there;
        LOG_FULL      the next call goes on with an empty log and the same lanes.
    """
    lanes, state, picked = with_distances(lanes), share.state, picks(method, walls)
    place, live, passes = impact_log.gone_on(share.log)
    while live < LANES:
        place = share.following(FLYING, place)
        if place.is_end():
            break
        lanes.load(method, walls, share, place.i, index(live))
        lanes.lane(live).looked_particle = -1.0
        place, live = place.after(), live + 1
    while live > 0:
        status = _halts(share, lanes, place, live, passes)
        if status != Status.DONE.value:
            return status, live, place.drawn
        passes += 1
        some_arrived, some_hard, some_wrong = _pass(method, walls, gravity, share, lanes, picked, live)
        if some_wrong or some_hard or passes % LOOK == 0:
            status, lane = _rare(hard, method, walls, gravity, share, lanes, live, some_hard)
            if status != Status.DONE.value:
                keep_failure(state.multipliers, lanes, lane)
                return status, lanes.particle[lane], place.drawn
        count_sweeps(state.multipliers, lanes, live)
        if not (some_arrived or some_hard):
            continue
        # From the last: then every lane behind one that has arrived is still under way and may take its place.
        for k in range(marked_lanes(lanes, live) - 1, -1, -1):
            lane = index(lanes.order[k])
            lanes.retire(method, walls, share, lane)
            place = share.following(FLYING, place)
            if place.i < place.stop:
                lanes.load(method, walls, share, place.i, lane)
                place = place.after()
            else:
                live -= 1
                lanes.move(walls, share.counters, live, lane)
    return Status.DONE.value, 0, place.drawn


def _halts(share, lanes, place, live, passes):
    """Return the status with which the call ends before the next pass, or DONE."""
    if passes >= share.halt[0]:
        lanes.leave(live)
        if share.counters is not None:
            for k in range(live):
                share.counters.retire(share.state, lanes, index(lanes.particle[k]), k)
        return Status.INTERRUPTED.value
    if impact_log.is_full(share.log):
        impact_log.keep_going(share.log, place, live, passes)
        return Status.LOG_FULL.value
    return Status.DONE.value


@outlined
def _rare(hard, method, walls, gravity, share, lanes, live, some_hard):
    """Look for failed lanes, or make the contacts of hard lanes; return (the worst status, its lane)."""
    if not some_hard:
        return _look(method, walls, share.state, lanes, live)
    if hard is None:
        return Status.HARD_CONTACT.value, 0
    return _hard_passes(hard, method, walls, gravity, share, lanes, live)


@outlined
def _look(method, walls, state, lanes, live):
    """Find a particle with too many impacts, or without progress since the last look; return (status, its lane).

    In a narrow wedge a finite number of impacts have no time between them: they are no failure up to a largest number.
    In a gap of zero width a particle returns to its state at the last look (`goes_round`). In a cusp thinner than
    round-off the largest number of impacts would not turn it round (`hardly_turns`); if it loses energy, it may rest.
    """
    # Walls that close on a particle hit it without end. The smaller limit keeps this to seconds with safe steps too.
    most_hits = 0.1 * MOST_HITS if isinstance(walls, Carried) else MOST_HITS
    for i in range(live):
        lane, p, status = lanes.lane(i), float(lanes.particle[i]), Status.DONE.value
        if method.laws.own is not None and math.isnan(lane.remaining):
            # The state holds the arguments of the law.
            return Status.SENT_WRONG.value, i
        if method.holds and lane.hits > most_hits:
            status = Status.STALLED.value
        elif lane.stands(method, p) and lane.looked_hits == lane.hits:
            status = Status.TIMELESS.value
        elif method.holds and (
            lane.goes_round(p) or (not method.laws.change_energy and lane.hardly_turns(p, most_hits))
        ):
            status = Status.STALLED.value
        if status != Status.DONE.value:
            put(state.position, 0, lanes.particle[i], lane.r)
            if state.contacts is not None:
                state.contacts.remaining[lanes.particle[i]] = lane.remaining
            return status, i
        lane.look(p)
    return Status.DONE.value, 0


@outlined
def _hard_passes(hard, method, walls, gravity, share, lanes, live):
    """Make the contacts of the hard lanes one by one; return (the worst status, its lane)."""
    worst, where = 0, 0
    for i in range(live):
        if lanes.wall[i] <= methods.HARD:
            lane, wall = lanes.given(method, i), methods.HARD - lanes.wall[i]
            kept = impulses_before(method, walls, lanes, i)
            contact, status = method.hard_pass(lanes.faced(walls, i), gravity, lane, wall, lanes, i)
            _put_contact(method, lanes, i, contact)
            _count_contacts(method, share, lanes, i, i + 1)
            if status == Status.DONE.value:
                count_hard_contacts(method, walls, share, lanes, i, lane, kept)
                end_hard_contacts(method, walls, gravity, share, lanes, i, lane.v, kept)
                if lanes.stand is not None:
                    step_out(method, walls, share, lanes, i)
            return_stepped(method, walls, share, lanes, i)
            if share.counts is not None:
                share.counts.add(wall, contact.hits)
            if lanes.lane(i).hits > hard.most_hits:
                status = Status.STALLED.value
            if status > worst:
                worst, where = status, i
    if worst == Status.TOO_DEEP.value:
        # The message of the error names the place and the velocity.
        put(share.state.position, 0, lanes.particle[where], lanes.lane(where).r)
        put(share.state.velocity, 0, lanes.particle[where], lanes.lane(where).v)
    return worst, where


def _pass(method, walls, gravity, share, lanes, picked, live):
    """Fly all lanes and make their contacts; return whether (a lane has arrived, a lane is hard, a law has failed)."""
    state, watches, counters = share.state, share.watchers.of_impacts(), share.counters
    if counters is not None:
        counters.keep_before(method, gravity, lanes, live)
    go(method, walls, gravity, lanes, live)
    if counters is not None:
        counters.count_flights(method, gravity, share, lanes, live)
    return_lanes(method, walls, gravity, state, lanes, live)
    if state.openings is not None:
        at_openings = face_lanes if method.steps_into_walls else let_out_lanes
        at_openings(state.openings, method, walls, gravity, share, lanes, live)
    if method.solves is not None:
        solve(method, walls, gravity, state.multipliers, lanes, live)
    for watch in watches:
        watch.keep_before(lanes, live)
    pick(walls, lanes, picked, live)
    some_wrong = False
    if method.laws.send_off:
        some_wrong = send_off(method, walls, gravity, share, lanes, picked, live)
    if counters is not None and method.contacts_take_time:
        counters.keep_before(method, gravity, lanes, live)
    some_arrived, some_hard = _make_contacts(method, walls, gravity, share, lanes, picked, live)
    _count_contacts(method, share, lanes, 0, live)
    some_arrived = step_out_lanes(method, walls, share, lanes, live) | some_arrived
    for watch in watches:
        watch.add_rows(method, walls, state, lanes, live)
    return_stepped_lanes(method, walls, share, lanes, live)
    return some_arrived, some_hard, some_wrong


def _count_contacts(method, share, lanes, first, after):
    """Count the crossings of these lanes in their contacts, where contacts take time."""
    if share.counters is not None and method.contacts_take_time:
        for i in range(index(first), index(after)):
            share.counters.count_contact(method, share, lanes, i)


def _make_contacts(method, walls, gravity, share, lanes, picked, live):
    """Make the contact of every lane; return whether (a lane has arrived, a lane is hard)."""
    some_arrived, some_hard, watches = False, False, share.watchers.of_impacts()
    at_once = method.lands and isinstance(walls, Aimed)
    # A hit has the waves of its own wall; a contact that looks around or moves the hit needs those of all walls.
    are_known = aims(walls, gravity) and walls.inset is None and not method.looks_around
    if at_once and not are_known:
        for i in range(index(live)):
            aim.put_angles(walls, lanes.course, i, lanes.lane(i).remaining)
        for i in range(index(live)):
            aim.put_waves(walls, lanes.course, i, False)
    for i in range(index(live)):
        lane, found = lanes.given(method, i), solution(method, lanes, i)
        here = lanes.faced(of_lane(walls, picked, i), i)
        here = method.walls_of(aim.with_waves(here, lanes.course, i) if at_once else here, lane.remaining)
        contact = method.contact(here, gravity, lane, lanes.wall[i], found)
        arrived, hard = _put_contact(method, lanes, i, contact), (contact.wall <= methods.HARD) & (not method.holds)
        add_to_rows(walls, lanes.impulse, 0, i, contact.wall, contact.impulse)
        add_work(walls, lanes.impulse, i, contact.wall, contact.work)
        lanes.wall[i] = contact.wall
        for watch in watches:
            watch.note(lanes, i, contact.impulse)
        end_contacts(method, walls, gravity, share, lanes, i, lane.v, (contact.wall, contact.impulse))
        arrived = arrived if method.laws_at_ends is None else arrived | lanes.marked[i]
        some_arrived, some_hard = some_arrived | arrived, some_hard | hard
    return some_arrived, some_hard


def _put_contact(method, lanes, i, contact):
    """Write the place, velocity, impacts and energy of a contact to its lane; return whether the lane has arrived."""
    lane = lanes.lane(i)
    lane.put_end(contact)
    if not counts_by_impulse(method):
        lane.hits += contact.hits
    if method.dissipates:
        lane.twice = contact.twice_energy
    lanes.marked[i] = contact.lasts | (not (contact.remaining > 0.0))
    return contact.lasts | (not (contact.remaining > 0.0))
