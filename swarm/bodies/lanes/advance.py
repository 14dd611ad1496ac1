"""The kernel of bodies: every lane tries a step, which is cut at the time of impact, where the wall strikes."""

import math

import numpy as np

from ...common.status import Status
from ...kernel.arrays import next_of, scratch
from ...kernel.jit import long_kernel, select
from ...kernel.vector import column
from ...lanes.watching.log import is_full
from . import following, impact, impact_time, prescribed
from .body_arrays import PACES, BodyLanes, HeldContacts, LaneNumbers, arrays_of_held, shapes_of_lanes
from .newton import BRIEF, solve
from .passages import Passages, look_back
from .penalty_contact import SoftContacts
from .persistent_contact import HardContacts
from .through import have_ends

# The rest of a frame up to which one step covers it, in units of the step.
_SAME = 1.0 + 1e-9
# The trials after which a body is stuck: a bracket takes a hundred at most.
_STUCK = 2000
# The most times that a step is put off; after these it has no solution.
_WAITS = 20
# The forces of lasting contacts are guessed from the step before, except after each `_AFRESH` steps. There a run can be
# halted, as these forces are not part of its state.
_AFRESH = 32


@long_kernel
def advance_bodies(body, walls, rule, state, ticket, size, halt):
    """Advance all bodies that this thread draws; return the status and the number of a body.

    `walls` are the walls of the scene, the same walls followed by those of the guides and cavities of the body, and the
    openings, or None.
    """
    points, rows, count = state.position.shape[1], state.guess.shape[1], rule.lanes
    shapes = shapes_of_lanes(points, rows, rows if rule.loop else 0, count)
    lanes = BodyLanes(*(scratch(shape, np.float64) for shape in shapes))
    pace = LaneNumbers(*(scratch(count, kind) for kind in PACES))
    active = HeldContacts(*(scratch(shape, kind) for shape, kind in arrays_of_held(count, rule.most)))
    passages = None if walls[2] is None else Passages(walls[2], state.free, state.escape_time)
    kind = HardContacts if rule.walls is None else SoftContacts
    contacts = kind(*body, walls[1], rule, lanes, pace, active, passages)
    c = scratch((3, count), np.float64)
    for i in range(count):
        pace.body[i] = -1
    begin, end, passes = 0, 0, 0
    while True:
        halted = Status.INTERRUPTED if passes >= halt[0] else Status.DONE
        halted = Status.LOG_FULL if is_full(state.watchers.log) else halted
        if halted != Status.DONE:
            begin, end = -1, -1
            _stop(contacts, state)
        live = 0
        for i in range(count):
            while pace.body[i] < 0 and begin >= 0:
                if begin == end:
                    begin = next_of(ticket) * size
                    end = min(begin + size, state.remaining.size)
                    if begin >= end:
                        begin, end = -1, -1
                        break
                if state.remaining[begin] > 0.0:
                    _load(contacts, state, i, begin)
                begin += 1
            live += pace.body[i] >= 0
        if live == 0:
            return halted, 0
        passes += 1
        _try(contacts, state)
        _look(contacts, walls[0], c)
        for i in range(count):
            pace.action[i] = _judge(contacts, i)
            if pace.body[i] >= 0 and (pace.action[i] == impact_time.FAILED or pace.stuck[i] > _STUCK):
                status = Status.UNSOLVED if pace.action[i] == impact_time.FAILED else Status.STALLED
                status = Status.UNCONVERGED if pace.loose[i] and rule.strict else status
                number = pace.body[i]
                for k in range(count):
                    if pace.body[k] >= 0:
                        _store(contacts, state, k)
                return status, number
        if contacts.passages is not None and have_ends(contacts.walls):
            for i in range(count):
                if pace.body[i] >= 0 and (pace.action[i] == impact_time.COMMIT or pace.action[i] == impact_time.STRIKE):
                    contacts.come_back(i)
        _commit(contacts, state)
        for i in range(count):
            if pace.action[i] != impact_time.AGAIN:
                _finish(contacts, state, i)
                if pace.remaining[i] <= 0.0:
                    _store(contacts, state, i)


def _judge(contacts, i):
    """Return the action of a lane after its trial."""
    rule, pace = contacts.rule, contacts.pace
    pace.fresh[i] = False
    if pace.body[i] < 0 or 0 < pace.waits[i] <= _WAITS:
        return impact_time.AGAIN
    pace.solved[i] = pace.solved[i] and pace.waits[i] == 0
    pace.waits[i] = 0
    if pace.loose[i]:
        return impact_time.FAILED if rule.strict else impact_time.COMMIT
    if pace.active[i] > 0 and pace.solved[i] and not pace.whole[i] and contacts.is_mixed(i):
        pace.whole[i] = True
        return impact_time.AGAIN
    if pace.out[i] or pace.wall[i] >= 0 or not pace.solved[i]:
        return contacts.judge(i)
    return impact_time.COMMIT


def _finish(contacts, state, i):
    """Book a step, or carry out a blow, and begin the next step of a lane."""
    lanes, pace = contacts.lanes, contacts.pace
    number, action = pace.body[i], pace.action[i]
    if action != impact_time.STRIKE_NOW:
        state.steps[number] += 1
        state.work[number] += pace.work[i]
        # Brief steps do not reset the count: a body at rest on an elastic wall would bounce by round-off 10^12 times.
        if pace.step[i] >= BRIEF * contacts.rule.dt:
            pace.stuck[i] = 0
        if contacts.rule.loop:
            state.sweeps[number] += pace.turns[i]
            state.unconverged[number] += pace.loose[i]
        if pace.lasts[i]:
            contacts.end(state, i)
    if action != impact_time.COMMIT:
        contacts.strike(state, i)
        for a in range(lanes.recent.shape[0]):
            lanes.older[a, i] = math.nan
    if contacts.passages is not None:
        look_back(contacts, i)
    if contacts.rule.period is not None:
        following.come_into_cell(contacts, state, i)
    _begin_step(pace, i)


def _begin_step(pace, i):
    """Set a lane to the start of a step."""
    pace.fresh[i], pace.whole[i] = True, False
    pace.trial[i], pace.low[i], pace.high[i], pace.wall[i] = 0.0, 0.0, math.inf, -1


def _load(contacts, state, i, number):
    """Load a body into a lane."""
    lanes, pace = contacts.lanes, contacts.pace
    pace.body[i], pace.remaining[i], pace.stuck[i] = number, state.remaining[number], 0
    pace.point[i], pace.waits[i] = -1, 0
    pace.lasts[i], pace.active[i] = state.lasting[number] == 1, 0
    _begin_step(pace, i)
    for row in range(lanes.r.shape[0]):
        q, x = row // 3, row % 3
        lanes.r[row, i], lanes.v[row, i] = state.position[x, q, number], state.velocity[x, q, number]
    for a in range(lanes.f.shape[0]):
        lanes.recent[a, i], lanes.before[a, i] = state.guess[0, a, number], state.guess[1, a, number]
        lanes.older[a, i] = state.guess[2, a, number]


def _store(contacts, state, i):
    """Store the body of a lane as it is at the start of its step, and free the lane."""
    lanes, pace = contacts.lanes, contacts.pace
    number = pace.body[i]
    state.remaining[number] = pace.remaining[i]
    state.lasting[number] = 1 if pace.lasts[i] else 0
    for row in range(lanes.r.shape[0]):
        q, x = row // 3, row % 3
        state.position[x, q, number], state.velocity[x, q, number] = lanes.r[row, i], lanes.v[row, i]
    for a in range(lanes.f.shape[0]):
        state.guess[0, a, number], state.guess[1, a, number] = lanes.recent[a, i], lanes.before[a, i]
        state.guess[2, a, number] = lanes.older[a, i]
    pace.body[i] = -1


def _stop(contacts, state):
    """Store the bodies that can go on with the same bits from their positions and velocities alone."""
    pace = contacts.pace
    for i in range(pace.body.size):
        number = pace.body[i]
        if number >= 0 and pace.stuck[i] == 0 and (not pace.lasts[i] or state.steps[number] % _AFRESH == 0):
            _store(contacts, state, i)


# --- A trial of all lanes --------------------------------------------------------------------------------


def _try(contacts, state):
    """Compute the step of every lane, to r1 and v1."""
    rule, lanes, pace = contacts.rule, contacts.lanes, contacts.pace
    count, stages, elapsed = pace.h.size, rule.stages.size, 0.0
    _begin_trial(contacts, state)
    for stage in range(stages):
        part, ends = rule.stages[stage], stage == stages - 1
        for a in range(lanes.f.shape[0]):
            for i in range(count):
                # This guess is exact for linear growth, and for round-off that alternates from step to step.
                more = lanes.before[a, i] - lanes.older[a, i]
                share = 0.5 + 0.5 * pace.step[i] / rule.dt
                known = (stages == 1) & (more == more)
                guess = lanes.recent[a, i] + select(known, share * more, 0.0)
                lanes.multiplier[a, i] = select(pace.waits[i] > 0, lanes.multiplier[a, i], guess)
        for i in range(count):
            pace.begun[i] = 0.0 if pace.whole[i] else elapsed * pace.step[i]
        elapsed += part
        for i in range(count):
            pace.h[i] = pace.step[i] if pace.whole[i] else part * pace.step[i]
        prescribed.lead(contacts, state, elapsed)
        for i in range(count):
            pace.done[i] = (pace.body[i] < 0) | (pace.whole[i] & (stage < stages - 1))
        if rule.loop:
            contacts.begin_loop()
        while True:
            solve(contacts)
            for i in range(count):
                pace.solved[i] = pace.solved[i] & pace.done[i]
            if not rule.loop or contacts.again() == 0:
                break
        for i in range(count):
            if pace.active[i] > 0 and (not pace.whole[i] or ends):
                contacts.book(i)
        prescribed.book(contacts, ends)
        if not ends:
            for row in range(lanes.r.shape[0]):
                for i in range(count):
                    if not pace.whole[i]:
                        lanes.ra[row, i], lanes.va[row, i] = lanes.r1[row, i], lanes.v1[row, i]


def _begin_trial(contacts, state):
    """Set the lengths of the steps of a trial, and the start of its first stage."""
    rule, lanes, pace = contacts.rule, contacts.lanes, contacts.pace
    for i in range(pace.h.size):
        whole = select(pace.remaining[i] <= _SAME * rule.dt, pace.remaining[i], rule.dt)
        step = select(pace.trial[i] > 0.0, pace.trial[i], whole)
        pace.step[i] = select(pace.body[i] >= 0, step, 0.0)
        pace.work[i] = 0.0
    for i in range(pace.h.size):
        if pace.body[i] >= 0 and pace.lasts[i]:
            if (pace.fresh[i] or not pace.solved[i]) and state.steps[pace.body[i]] % _AFRESH == 0:
                pace.active[i] = 0
            contacts.begin(i)
            contacts.forget(i)
        pace.solved[i] = True
    for row in range(lanes.r.shape[0]):
        for i in range(pace.h.size):
            lanes.ra[row, i], lanes.va[row, i] = lanes.r[row, i], lanes.v[row, i]
            lanes.r1[row, i] = lanes.r[row, i]


def _look(contacts, scene, c):
    """Find the lanes that end with a point outside; c is room for the places of one point."""
    touching, r1, pace = contacts.touching, contacts.lanes.r1, contacts.pace
    count = pace.out.size
    for i in range(count):
        pace.out[i] = False
    for k in range(touching.points):
        plain = touching.plain[k]
        for x in range(3):
            for i in range(count):
                c[x, i] = r1[3 * plain + x, i] if plain >= 0 else 0.0
        if plain < 0:
            for q in range(touching.coefficients.shape[1]):
                b = touching.coefficients[k, q]
                if b != 0.0:
                    for x in range(3):
                        for i in range(count):
                            c[x, i] += b * r1[3 * q + x, i]
        for i in range(count):
            spot = contacts.in_cell(k, column(c, 0, i), column(c, 0, i))
            out = scene.at(pace.remaining[i] - pace.step[i]).outside(-1.0, spot)
            pace.out[i] = pace.out[i] | (out & (not contacts.is_free(k, i)))
        if have_ends(contacts.walls):
            for i in range(count):
                if pace.body[i] >= 0 and not pace.out[i] and not contacts.is_free(k, i):
                    pace.out[i] = contacts.passed(k, column(c, 0, i), contacts.rule.room, i).wall >= 0.0
    # Cavities that points carry are checked one by one: each has one surface, never thousands of walls.
    for k in range(touching.points + touching.guides, touching.plain.size):
        wall = float(touching.walls + k - touching.points)
        for i in range(count):
            pace.out[i] = pace.out[i] | (contacts.walls_then(i).distance(wall, touching.place(r1, k, i)) > 0.0)


def _commit(contacts, state):
    """Make the trial the step in lanes with the action COMMIT or STRIKE."""
    if state.watchers.counters is not None:
        following.count_steps(contacts, state)
    lanes, pace, count = contacts.lanes, contacts.pace, contacts.pace.out.size
    for i in range(count):
        pace.done[i] = (pace.action[i] == impact_time.COMMIT) | (pace.action[i] == impact_time.STRIKE)
        remaining = pace.remaining[i] - pace.step[i]
        pace.remaining[i] = select(pace.done[i], select(remaining > 0.0, remaining, 0.0), pace.remaining[i])
    for row in range(lanes.r.shape[0]):
        for i in range(count):
            lanes.r[row, i] = select(pace.done[i], lanes.r1[row, i], lanes.r[row, i])
            lanes.v[row, i] = select(pace.done[i], lanes.v1[row, i], lanes.v[row, i])
    for i in range(count):
        # The multiplier of a short step is nothing but round-off over h^2.
        pace.done[i] = pace.done[i] & (pace.step[i] > impact.SHORT * contacts.rule.dt)
    for a in range(lanes.f.shape[0]):
        for i in range(count):
            new, g, old = lanes.multiplier[a, i], lanes.recent[a, i], lanes.before[a, i]
            known = lanes.older[a, i] == lanes.older[a, i]
            lanes.recent[a, i] = select(pace.done[i], new, g)
            lanes.before[a, i] = select(pace.done[i], select(known, g, new), old)
            lanes.older[a, i] = select(pace.done[i], select(known, old, new), lanes.older[a, i])
