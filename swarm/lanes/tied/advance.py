"""The kernel of bodies: every lane tries its step, is cut where it meets a wall, and is struck there."""

import math

import numpy as np

from ...kernel.jit import inlined, kernel, next_of, scratch, select
from ...kernel.vector import Vec
from ...status import Status
from ...surfaces import fold as walls
from . import blow, hold
from .arrays import Held, Lanes, Pace
from .ties import solve

# A step longer than the frame that is left by this part is the last of it.
_SAME = 1.0 + 1e-9
# Trials after which a body is stuck: brackets take a hundred at most.
_STUCK = 2000
# A step from impact to impact this short, as a part of a whole one, is a bounce on the way to rest.
_SHORT = 1.0 / 16.0
# After so many blows without a step the contacts last.
_LASTS = 20


@kernel
def advance_bodies(body, chain, rule, state, ticket, size, halt):  # noqa: PLR0915  the lanes are made here
    """Advance all bodies that this thread draws: (status, number of the body)."""
    ties, touching = body
    points, rows, count = state.position.shape[1], ties.ends.shape[0], rule.lanes
    lanes = Lanes(
        scratch((points, 3, count), np.float64), scratch((points, 3, count), np.float64),
        scratch((points, 3, count), np.float64), scratch((points, 3, count), np.float64),
        scratch((points, 3, count), np.float64), scratch((points, 3, count), np.float64),
        scratch((points, 3, count), np.float64), scratch((points, 3, count), np.float64),
        scratch((points, 3, count), np.float64),
        scratch((rows, 3, count), np.float64), scratch((rows, 3, count), np.float64),
        scratch((rows, 3, count), np.float64), scratch((rows, rows, count), np.float64),
        scratch((rows, count), np.float64), scratch((rows, count), np.float64),
        scratch((rows, count), np.float64), scratch((rows, count), np.float64),
        scratch((rows, count), np.float64),
    )  # fmt: skip
    pace = Pace(
        scratch(count, np.float64), scratch(count, np.float64), scratch(count, np.float64),
        scratch(count, np.float64), scratch(count, np.float64), scratch(count, np.float64),
        scratch(count, np.float64), scratch(count, np.float64), scratch(count, np.float64),
        scratch(count, np.bool_), scratch(count, np.bool_), scratch(count, np.bool_), scratch(count, np.bool_),
        scratch(count, np.int64), scratch(count, np.int64), scratch(count, np.int64), scratch(count, np.int64),
        scratch(count, np.int64), scratch(count, np.int64), scratch(count, np.bool_),
    )  # fmt: skip
    held = Held(
        scratch((count, blow.MOST_CONTACTS, 2), np.int64), scratch((count, blow.MOST_CONTACTS, 3, 3), np.float64),
        scratch((count, 3 * blow.MOST_CONTACTS), np.float64),
    )  # fmt: skip
    c = scratch((3, count), np.float64)
    for i in range(count):
        pace.body[i] = -1
    begin, end, passes = 0, 0, 0
    while True:
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
                    _load(state, lanes, pace, i, begin)
                begin += 1
            live += pace.body[i] >= 0
        if live == 0:
            return Status.DONE, 0
        if passes >= halt[0]:
            for i in range(count):
                if pace.body[i] >= 0:
                    _store(state, lanes, pace, i)
            return Status.INTERRUPTED, 0
        passes += 1
        for i in range(count):
            if pace.held[i] > 0 and pace.fresh[i]:
                hold.begin(touching, chain, rule, lanes, pace, held, i)
        _try(ties, rule, lanes, pace)
        _look(touching, chain, lanes, pace, c)
        for i in range(count):
            pace.action[i] = blow.COMMIT if pace.body[i] >= 0 else blow.AGAIN
            pace.fresh[i] = False
            settles = pace.held[i] > 0 and pace.solved[i]
            if settles and not hold.press(ties, touching, chain, rule, lanes, (pace, held), i):
                pace.stuck[i] += 1
                pace.action[i] = blow.AGAIN
            elif pace.body[i] >= 0 and (pace.out[i] or pace.wall[i] >= 0 or not pace.solved[i]):
                pace.action[i] = blow.judge(touching, chain, rule, lanes, pace, i, 2.0 * hold.tolerated(rule, pace, i))
            if pace.body[i] >= 0 and (pace.action[i] == blow.FAILED or pace.stuck[i] > _STUCK):
                status = Status.UNSOLVED if pace.action[i] == blow.FAILED else Status.STALLED
                number = pace.body[i]
                for j in range(count):
                    if pace.body[j] >= 0:
                        _store(state, lanes, pace, j)
                return status, number
        _commit(lanes, pace, rule.dt)
        for i in range(count):
            action = pace.action[i]
            if action != blow.AGAIN:
                number = pace.body[i]
                if action != blow.STRIKE_NOW:
                    state.steps[number] += 1
                    pace.stuck[i] = 0
                if pace.held[i] > 0 and action != blow.STRIKE_NOW:
                    hold.end(touching, lanes, pace, held, state, i)
                if action != blow.COMMIT:
                    short = action == blow.STRIKE_NOW or pace.step[i] < _SHORT * rule.dt
                    state.short[number] = state.short[number] + 1 if short else 0
                    blows = blow.strike(ties, touching, chain, rule, lanes, state, i, number)
                    if (action == blow.STRIKE_NOW and blows == 0) or pace.stuck[i] > _LASTS:
                        pace.held[i] = 1
                    for a in range(rows):
                        lanes.before[a, i] = lanes.recent[a, i]
                pace.fresh[i] = True
                pace.trial[i], pace.low[i], pace.high[i], pace.wall[i] = 0.0, 0.0, math.inf, -1
                if pace.left[i] <= 0.0:
                    _store(state, lanes, pace, i)
                    pace.body[i] = -1


@inlined
def _load(state, lanes, pace, i, number):
    """Take a body into a lane."""
    pace.body[i], pace.left[i], pace.stuck[i] = number, state.left[number], 0
    pace.trial[i], pace.low[i], pace.high[i], pace.wall[i], pace.point[i] = 0.0, 0.0, math.inf, -1, -1
    pace.held[i], pace.fresh[i] = state.lasting[number], True
    for q in range(lanes.r.shape[0]):
        for x in range(3):
            lanes.r[q, x, i], lanes.v[q, x, i] = state.position[x, q, number], state.velocity[x, q, number]
            lanes.load[q, x, i] = 0.0
    for a in range(lanes.f.shape[0]):
        lanes.recent[a, i], lanes.before[a, i] = state.guess[0, a, number], state.guess[1, a, number]


@inlined
def _store(state, lanes, pace, i):
    """Give the body of a lane back, as it is at the start of its step."""
    number = pace.body[i]
    state.left[number] = pace.left[i]
    state.lasting[number] = 1 if pace.held[i] > 0 else 0
    for q in range(lanes.r.shape[0]):
        for x in range(3):
            state.position[x, q, number], state.velocity[x, q, number] = lanes.r[q, x, i], lanes.v[q, x, i]
    for a in range(lanes.f.shape[0]):
        state.guess[0, a, number], state.guess[1, a, number] = lanes.recent[a, i], lanes.before[a, i]


@inlined
def _try(ties, rule, lanes, pace):
    """The step of every lane, to r1 and v1."""
    points, count = lanes.r.shape[0], lanes.r.shape[2]
    for i in range(count):
        whole = select(pace.left[i] <= _SAME * rule.dt, pace.left[i], rule.dt)
        step = select(pace.trial[i] > 0.0, pace.trial[i], whole)
        pace.step[i] = select(pace.body[i] >= 0, step, 0.0)
        pace.solved[i] = True
    for q in range(points):
        for x in range(3):
            for i in range(count):
                lanes.ra[q, x, i], lanes.va[q, x, i] = lanes.r[q, x, i], lanes.v[q, x, i]
                lanes.r1[q, x, i] = lanes.r[q, x, i]
    single = rule.stages.size == 1
    for stage in range(rule.stages.size):
        part = rule.stages[stage]
        for a in range(lanes.f.shape[0]):
            for i in range(count):
                g = lanes.recent[a, i]
                lanes.multiplier[a, i] = g + select(single, g - lanes.before[a, i], 0.0)
        for i in range(count):
            pace.h[i] = part * pace.step[i]
            pace.done[i] = pace.body[i] < 0
        solve(ties, rule.gravity, rule.noise, lanes, pace)
        for i in range(count):
            pace.solved[i] = pace.solved[i] & pace.done[i]
        if stage + 1 < rule.stages.size:
            for q in range(points):
                for x in range(3):
                    for i in range(count):
                        lanes.ra[q, x, i], lanes.va[q, x, i] = lanes.r1[q, x, i], lanes.v1[q, x, i]


@inlined
def _look(touching, chain, lanes, pace, c):
    """Which lanes end with a point outside."""
    count = pace.out.size
    for i in range(count):
        pace.out[i] = False
    for k in range(touching.plain.size):
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
            pace.out[i] = pace.out[i] | walls.outside(chain, -1.0, Vec(c[0, i], c[1, i], c[2, i]))


@inlined
def _commit(lanes, pace, whole):
    """Take the trial as the step where it is one."""
    count = pace.out.size
    for i in range(count):
        pace.done[i] = (pace.action[i] == blow.COMMIT) | (pace.action[i] == blow.STRIKE)
        left = pace.left[i] - pace.step[i]
        pace.left[i] = select(pace.done[i], select(left > 0.0, left, 0.0), pace.left[i])
    for q in range(lanes.r.shape[0]):
        for x in range(3):
            for i in range(count):
                lanes.r[q, x, i] = select(pace.done[i], lanes.r1[q, x, i], lanes.r[q, x, i])
                lanes.v[q, x, i] = select(pace.done[i], lanes.v1[q, x, i], lanes.v[q, x, i])
    for i in range(count):
        # In a short step round-off over h^2 is all that a multiplier is.
        pace.done[i] = pace.done[i] & (pace.step[i] > _SHORT * whole)
    for a in range(lanes.f.shape[0]):
        for i in range(count):
            g = lanes.recent[a, i]
            lanes.recent[a, i] = select(pace.done[i], lanes.multiplier[a, i], g)
            lanes.before[a, i] = select(pace.done[i], g, lanes.before[a, i])
