"""The kernel of bodies: every lane tries its step, is cut where it meets a wall, and is struck there."""

import math

import numpy as np

from ...kernel.arrays import next_of, scratch
from ...kernel.jit import long_kernel, select
from ...kernel.vector import Vec
from ...status import Status
from . import blow, hold, instant, lead
from .arrays import PACES, Held, Lanes, Pace
from .contacts import point_of
from .hold import HardContacts
from .soft import SoftContacts
from .stage import solve

# How many arrays of `Lanes` have a row for each point, for each tie with its direction, and for each tie.
_POINTS, _TIES, _ROWS = 8, 3, 6
# A step longer than the frame that is left by this part is the last of it.
_SAME = 1.0 + 1e-9
# Trials after which a body is stuck: brackets take a hundred at most.
_STUCK = 2000
# A step that is put off more often has no solution.
_WAITS = 20
# The forces of contacts that last are guessed from the step before, but each time after so many steps, where a run can
# be halted: they are not part of its state.
_AFRESH = 32


@long_kernel
def advance_bodies(body, chains, rule, state, ticket, size, halt):
    """Advance all bodies that this thread draws: (status, number of the body).

    `chains` are the walls of the scene, and those with the walls of the body's own guides and cavities after them.
    """
    points, rows, count = state.position.shape[1], state.guess.shape[1], rule.lanes
    offsets = rows if rule.loop else 0
    shapes = (*_POINTS * ((points, 3, count),), *_TIES * ((rows, 3, count),), (rows, rows, count))
    lanes = Lanes(*(scratch(shape, np.float64) for shape in (*shapes, *_ROWS * ((rows, count),), (offsets, count))))
    pace = Pace(*(scratch(count, kind) for kind in PACES))
    held = Held(
        scratch((count, rule.most, 2), np.int64), scratch((count, rule.most, 3, 3), np.float64),
        scratch((count, 3 * rule.most), np.float64), scratch((count, 3 * rule.most), np.float64),
        scratch((count, rule.most), np.float64), scratch((count, rule.most), np.int64),
        scratch(count, np.float64), scratch((count, rule.most), np.float64),
    )  # fmt: skip
    contacts = (HardContacts if rule.walls is None else SoftContacts)(body, chains[1], rule, lanes, pace, held)
    c = scratch((3, count), np.float64)
    for i in range(count):
        pace.body[i] = -1
    begin, end, passes = 0, 0, 0
    while True:
        halted = passes >= halt[0]
        if halted:
            begin, end = -1, -1
            _stop(state, lanes, pace)
        live = 0
        for i in range(count):
            while pace.body[i] < 0 and begin >= 0:
                if begin == end:
                    begin = next_of(ticket) * size
                    end = min(begin + size, state.left.size)
                    if begin >= end:
                        begin, end = -1, -1
                        break
                if state.left[begin] > 0.0:
                    _load(state, lanes, (pace, held), i, begin)
                begin += 1
            live += pace.body[i] >= 0
        if live == 0:
            return (Status.INTERRUPTED if halted else Status.DONE), 0
        passes += 1
        _try(contacts, state)
        _look(body[1], chains, lanes, pace, c)
        for i in range(count):
            pace.action[i] = _judge(contacts, i)
            if pace.body[i] >= 0 and (pace.action[i] == instant.FAILED or pace.stuck[i] > _STUCK):
                status = Status.UNSOLVED if pace.action[i] == instant.FAILED else Status.STALLED
                status = Status.UNCONVERGED if pace.loose[i] and rule.strict else status
                number = pace.body[i]
                _store_all(state, lanes, pace)
                return status, number
        _commit(lanes, pace, rule.dt)
        for i in range(count):
            if pace.action[i] != instant.AGAIN:
                _finish(contacts, state, i)
                if pace.left[i] <= 0.0:
                    _store(state, lanes, pace, i)
                    pace.body[i] = -1


def _judge(contacts, i):
    """What becomes of a lane after its trial."""
    rule, pace, held = contacts.rule, contacts.pace, contacts.held
    pace.fresh[i] = False
    if pace.body[i] < 0 or 0 < pace.waits[i] <= _WAITS:
        return instant.AGAIN
    pace.solved[i] = pace.solved[i] and pace.waits[i] == 0
    pace.waits[i] = 0
    if pace.loose[i]:
        return instant.FAILED if rule.strict else instant.COMMIT
    if pace.held[i] > 0 and pace.solved[i] and not pace.whole[i] and hold.is_mixed((pace, held), i, rule.stages.size):
        pace.whole[i] = True
        return instant.AGAIN
    if pace.out[i] or pace.wall[i] >= 0 or not pace.solved[i]:
        return contacts.judge(i)
    return instant.COMMIT


def _finish(contacts, state, i):
    """After a step, or a blow."""
    rule, lanes, pace = contacts.rule, contacts.lanes, contacts.pace
    number, action = pace.body[i], pace.action[i]
    if action != instant.STRIKE_NOW:
        state.steps[number] += 1
        state.work[number] += pace.work[i]
        pace.stuck[i] = 0
        if rule.loop:
            state.sweeps[number] += pace.turns[i]
            state.unconverged[number] += pace.loose[i]
        if pace.lasts[i]:
            contacts.end(state, i)
    if action != instant.COMMIT:
        contacts.strike(state, i)
        for a in range(lanes.recent.shape[0]):
            lanes.older[a, i] = math.nan
    pace.fresh[i], pace.whole[i] = True, False
    pace.trial[i], pace.low[i], pace.high[i], pace.wall[i] = 0.0, 0.0, math.inf, -1


def _load(state, lanes, paces, i, number):
    """Take a body into a lane."""
    pace, _held = paces
    pace.body[i], pace.left[i], pace.stuck[i] = number, state.left[number], 0
    pace.trial[i], pace.low[i], pace.high[i], pace.wall[i], pace.point[i] = 0.0, 0.0, math.inf, -1, -1
    pace.lasts[i], pace.held[i] = state.lasting[number] == 1, 0
    pace.fresh[i], pace.whole[i], pace.waits[i] = True, False, 0
    for q in range(lanes.r.shape[0]):
        for x in range(3):
            lanes.r[q, x, i], lanes.v[q, x, i] = state.position[x, q, number], state.velocity[x, q, number]
    for a in range(lanes.f.shape[0]):
        lanes.recent[a, i], lanes.before[a, i] = state.guess[0, a, number], state.guess[1, a, number]
        lanes.older[a, i] = state.guess[2, a, number]


def _store(state, lanes, pace, i):
    """Give the body of a lane back, as it is at the start of its step."""
    number = pace.body[i]
    state.left[number] = pace.left[i]
    state.lasting[number] = 1 if pace.lasts[i] else 0
    for q in range(lanes.r.shape[0]):
        for x in range(3):
            state.position[x, q, number], state.velocity[x, q, number] = lanes.r[q, x, i], lanes.v[q, x, i]
    for a in range(lanes.f.shape[0]):
        state.guess[0, a, number], state.guess[1, a, number] = lanes.recent[a, i], lanes.before[a, i]
        state.guess[2, a, number] = lanes.older[a, i]


def _stop(state, lanes, pace):
    """Give back the bodies that go on with the same bits from their positions and velocities alone."""
    for i in range(pace.body.size):
        number = pace.body[i]
        if number >= 0 and pace.stuck[i] == 0 and (not pace.lasts[i] or state.steps[number] % _AFRESH == 0):
            _store(state, lanes, pace, i)
            pace.body[i] = -1


def _store_all(state, lanes, pace):
    for i in range(pace.body.size):
        if pace.body[i] >= 0:
            _store(state, lanes, pace, i)


def _try(contacts, state):
    """The step of every lane, to r1 and v1."""
    body, _chain, rule, lanes, pace, held = contacts
    tied, paces = body[0], (pace, held)
    points, count, stages = lanes.r.shape[0], lanes.r.shape[2], rule.stages.size
    elapsed = 0.0
    for i in range(count):
        whole = select(pace.left[i] <= _SAME * rule.dt, pace.left[i], rule.dt)
        step = select(pace.trial[i] > 0.0, pace.trial[i], whole)
        pace.step[i] = select(pace.body[i] >= 0, step, 0.0)
        pace.work[i] = 0.0
    for i in range(count):
        if pace.body[i] >= 0 and pace.lasts[i]:
            if (pace.fresh[i] or not pace.solved[i]) and state.steps[pace.body[i]] % _AFRESH == 0:
                pace.held[i] = 0
            contacts.begin(i)
            hold.forget(held, i)
        pace.solved[i] = True
    for q in range(points):
        for x in range(3):
            for i in range(count):
                lanes.ra[q, x, i], lanes.va[q, x, i] = lanes.r[q, x, i], lanes.v[q, x, i]
                lanes.r1[q, x, i] = lanes.r[q, x, i]
    single = stages == 1
    for stage in range(stages):
        part = rule.stages[stage]
        for a in range(lanes.f.shape[0]):
            for i in range(count):
                # Exact for what grows steadily, and for round-off, whose part alternates from step to step.
                more = lanes.before[a, i] - lanes.older[a, i]
                share = 0.5 + 0.5 * pace.step[i] / rule.dt
                known = single & (more == more)
                guess = lanes.recent[a, i] + select(known, share * more, 0.0)
                lanes.multiplier[a, i] = select(pace.waits[i] > 0, lanes.multiplier[a, i], guess)
        for i in range(count):
            pace.h[i] = part * pace.step[i]
        elapsed += part
        for i in range(count):
            if pace.whole[i]:
                pace.h[i] = pace.step[i]
        lead.lead(tied, rule, state, lanes, pace, elapsed)
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
            if pace.held[i] > 0 and (not pace.whole[i] or stage == stages - 1):
                hold.book(body[1], lanes, paces, i)
        lead.book(body, lanes, paces, stage == stages - 1)
        if stage + 1 < stages:
            for q in range(points):
                for x in range(3):
                    for i in range(count):
                        if not pace.whole[i]:
                            lanes.ra[q, x, i], lanes.va[q, x, i] = lanes.r1[q, x, i], lanes.v1[q, x, i]


def _look(touching, chains, lanes, pace, c):
    """Which lanes end with a point outside."""
    count = pace.out.size
    for i in range(count):
        pace.out[i] = False
    for k in range(touching.points):
        plain = touching.plain[k]
        if plain >= 0:
            for x in range(3):
                for i in range(count):
                    c[x, i] = lanes.r1[plain, x, i]
        else:
            for x in range(3):
                for i in range(count):
                    c[x, i] = 0.0
            for q in range(lanes.r.shape[0]):
                b = touching.coefficients[k, q]
                if b != 0.0:
                    for x in range(3):
                        for i in range(count):
                            c[x, i] += b * lanes.r1[q, x, i]
        for i in range(count):
            pace.out[i] = pace.out[i] | chains[0].outside(-1.0, Vec(c[0, i], c[1, i], c[2, i]))
    # What a point carries is looked at one body after the other: a wall of thousands of bodies is none of theirs.
    for k in range(touching.points + touching.guides, touching.plain.size):
        wall = float(touching.walls + k - touching.points)
        for i in range(count):
            pace.out[i] = pace.out[i] | (chains[1].distance(wall, point_of(touching, lanes.r1, k, i)) > 0.0)


def _commit(lanes, pace, whole):
    """Take the trial as the step where it is one."""
    count = pace.out.size
    for i in range(count):
        pace.done[i] = (pace.action[i] == instant.COMMIT) | (pace.action[i] == instant.STRIKE)
        left = pace.left[i] - pace.step[i]
        pace.left[i] = select(pace.done[i], select(left > 0.0, left, 0.0), pace.left[i])
    for q in range(lanes.r.shape[0]):
        for x in range(3):
            for i in range(count):
                lanes.r[q, x, i] = select(pace.done[i], lanes.r1[q, x, i], lanes.r[q, x, i])
                lanes.v[q, x, i] = select(pace.done[i], lanes.v1[q, x, i], lanes.v[q, x, i])
    for i in range(count):
        # In a short step round-off over h^2 is all that a multiplier is.
        pace.done[i] = pace.done[i] & (pace.step[i] > blow.SHORT * whole)
    for a in range(lanes.f.shape[0]):
        for i in range(count):
            new, g, old = lanes.multiplier[a, i], lanes.recent[a, i], lanes.before[a, i]
            known = lanes.older[a, i] == lanes.older[a, i]
            lanes.recent[a, i] = select(pace.done[i], new, g)
            lanes.before[a, i] = select(pace.done[i], select(known, g, new), old)
            lanes.older[a, i] = select(pace.done[i], select(known, old, new), lanes.older[a, i])
