"""The time of impact at which the step of a body is cut, found by secants in a bracket."""

import math

from ...kernel.jit import outlined
from ...kernel.vector import dot
from .contacts import NEAR, count_at, wall_at

# The action of a lane after a trial.
AGAIN, COMMIT, STRIKE, STRIKE_NOW, FAILED = 0, 1, 2, 3, 4
# As parts of a whole step: a bracket of the time of impact narrower than `_NARROW` is a point, and a body that comes
# back to a wall within `_SHORTEST` does not leave the wall.
_NARROW, _SHORTEST = 1e-13, 1e-4
# A guess by the velocity is good if less than this part of the gap remains.
_CLOSER = 0.25
# The trials after which the bracket is halved each time.
_QUICK = 40
# The part of a whole step down to which a step is halved while its ties have no solution.
_HALVED = 2.0**-20


def halve(bodies, i):
    """Halve a step with ties that have no solution; return AGAIN, or FAILED if it is too short."""
    pace = bodies.pace
    pace.trial[i] = 0.5 * pace.step[i]
    pace.low[i], pace.high[i], pace.wall[i] = 0.0, math.inf, -1
    return AGAIN if pace.step[i] > _HALVED * bodies.rule.dt else FAILED


@outlined
def look(bodies, i, larger):
    """Find the time at which a step that ends outside is cut; return the action of the lane.

    Lasting contacts may end outside by `larger`.
    """
    touching, walls, rule, lanes, pace = bodies.touching, bodies.walls_then(i), bodies.rule, bodies.lanes, bodies.pace
    tau = pace.step[i]
    pace.stuck[i] += 1
    if not pace.solved[i]:
        return halve(bodies, i)
    # The forces of lasting contacts leave larger gaps.
    room = rule.room if pace.active[i] == 0 else larger
    worst, first, point, wall = -math.inf, tau, -1, -1
    for k in range(touching.plain.size):
        if bodies.is_free(k, i):
            continue
        end, met = touching.place(lanes.r1, k, i), touching.span(k)
        c = bodies.in_cell(k, end, end)
        near, ahead = count_at(walls, met, c), bodies.passed(k, end, room, i)
        for j in range(near + int(ahead.wall >= 0.0)):
            w = wall_at(walls, met, j, c) if j < near else int(ahead.wall)
            gap = walls.distance(float(w), c) if j < near else ahead.gap
            if not gap <= room or not _rests(bodies, k, w, i):
                worst = max(worst, gap)
            if not gap <= room and not _stays(bodies, k, w, gap, i):
                rate = dot(walls.unit_normal(float(w), c), bodies.slip(walls, w, c, touching.place(lanes.v1, k, i)))
                time = tau - gap / rate if rate > 0.0 else 0.0
                if wall < 0 or time < first:
                    first, point, wall = time, k, w
    if wall < 0:
        return _inside(rule, pace, i, worst)
    again, low = pace.wall[i] >= 0, pace.low[i]
    pace.point[i], pace.wall[i] = point, wall
    if tau - low <= _NARROW * rule.dt:
        # The bracket is a point: the trial at its lower end, farther inside than round-off, is then the impact.
        pace.high[i], pace.trial[i] = tau, low
        return STRIKE_NOW if low == 0.0 else AGAIN
    if low == 0.0 and tau <= _SHORTEST * rule.dt:
        # The contact is at the wall, and does not leave it.
        start = bodies.walls_now(i).distance(float(wall), _start(bodies, point, i))
        if start >= -NEAR * rule.room:
            return STRIKE_NOW
    closer = pace.high[i] < math.inf and worst < _CLOSER * pace.outside[i]
    if pace.high[i] < math.inf and again:
        pace.inside[i] *= _weight(worst, pace.outside[i])
    pace.high[i], pace.outside[i] = tau, worst
    # The first guess follows from the velocity at the end. It is useless if this velocity has a component along the
    # ties. If the last guess was good, a step back twice as long ends just inside.
    beyond = 2.0 * first - tau
    if low < first < tau and not again:
        pace.trial[i] = first
    elif low == 0.0 and closer and 0.0 < beyond < tau:
        pace.trial[i] = beyond
    else:
        pace.trial[i] = _between(rule, pace, i)
    return AGAIN


def _rests(bodies, k, wall, i):
    """Whether a contact lasts, so that its gap says nothing about the time of another impact."""
    pace, name, lasts = bodies.pace, bodies.active.name, False
    if not bodies.touching.dissipates(wall) or (k == pace.point[i] and wall == pace.wall[i]):
        return False
    for a in range(pace.active[i]):
        lasts = lasts or (name[i, a, 0] == k and name[i, a, 1] == wall)
    return lasts


def _stays(bodies, k, wall, gap, i):
    """Whether a contact is as far outside as at the start of the step, as short steps do not bring it back."""
    if bodies.pace.active[i] == 0 or not bodies.touching.dissipates(wall):
        return False
    start = bodies.walls_now(i).distance(float(wall), _start(bodies, k, i))
    return gap - start <= bodies.rule.room


def _start(bodies, k, i):
    """The place of a contact point at the start of the step, among the walls at its end."""
    return bodies.in_cell(k, bodies.touching.place(bodies.lanes.r, k, i), bodies.touching.place(bodies.lanes.r1, k, i))


def _inside(rule, pace, i, gap):
    """Return the action after a trial that ends inside: a step, a step to the impact, or a lower end of the bracket."""
    wall, tau = pace.wall[i], pace.step[i]
    if wall < 0:
        return COMMIT
    if gap >= -rule.room or pace.high[i] - tau <= _NARROW * rule.dt:
        return STRIKE
    if pace.low[i] > 0.0:
        pace.outside[i] *= _weight(gap, pace.inside[i])
    pace.low[i], pace.inside[i] = tau, gap
    pace.trial[i] = _between(rule, pace, i)
    return AGAIN


def _weight(gap, before):
    """The weight of an end of the bracket that is kept when the other one moves again (Anderson and Bjorck)."""
    weight = 1.0 - gap / before
    return weight if weight > 0.0 else 0.5


def _between(rule, pace, i):
    """The next time to try in the bracket: by the secant, half of round-off inside for the worst contact."""
    low, high = pace.low[i], pace.high[i]
    inside, outside = pace.inside[i] + 0.5 * rule.room, pace.outside[i] + 0.5 * rule.room
    time = low - (high - low) * inside / (outside - inside)
    halves = low == 0.0 or pace.stuck[i] > _QUICK or not low < time < high
    return 0.5 * (low + high) if halves else time
