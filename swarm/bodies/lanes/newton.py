"""One stage of a step: the multipliers of ties, guides and contacts by Newton's method, in all lanes together.

The system of the ties is factored once for several corrections, which are cheap; each one shrinks errors by some
(h omega)^2. Each lane stops independently, so that its bits do not depend on its neighbours.
"""

from ...kernel.jit import select
from . import sticking

# The most corrections, and the corrections after which the system is factored again.
_MOST, _AGAIN = 40, 5
# After this correction a lane that needs more goes on in the next pass: a step after a blow takes five corrections, for
# which 31 lanes would wait. In free steps, one correction of 80 is a later one.
_SOON = 1
# In a stage shorter than this part of dt, links turn by less than round-off: a correction would turn the round-off of
# places, divided by h, into a velocity.
BRIEF = 1e-8


def solve(contacts):
    """Compute the end r1, v1 of a stage of length pace.h from (ra, va); pace.done is False if none is found.

    Led points must be in r1 already. Lanes that are done at the start are left out.
    """
    ties, rule, lanes, pace = contacts.ties, contacts.rule, contacts.lanes, contacts.pace
    count, more = pace.h.size, contacts.touching.guides
    has_guides = more > 0
    alone = rule.stages.size == 1 and not has_guides and not rule.loop
    contacts.launch()
    is_rigid = ties.links == ties.ends.shape[0]
    for i in range(count):
        brief = is_rigid & (pace.active[i] == 0) & (abs(pace.h[i]) < BRIEF * rule.dt)
        if contacts.touching.is_dissipative and is_rigid and not pace.done[i]:
            brief = sticking.leave_out(contacts, i)
        pace.brief[i] = brief
        pace.done[i] = pace.done[i] | brief
        more += pace.active[i] > 0
        if _is_held(contacts, i):
            _turn(contacts, i, lanes.ra)
    if ties.ends.shape[0] > 1:
        # With a good guess of the multipliers, D is the only error (with one tie it has no error): D follows once more.
        _push(contacts, 0)
        contacts.follow()
    for turn in range(_MOST + 1):
        # D follows the multipliers before they are corrected: done together, the correction would undo the change.
        _push(contacts, more)
        contacts.follow()
        if more > 0:
            for i in range(count):
                if _is_held(contacts, i):
                    _turn(contacts, i, lanes.r1)
        _push(contacts, more)
        if turn == _MOST or _all(pace.done):
            break
        contacts.residual(turn)
        if turn % _AGAIN == 0 or has_guides:
            contacts.assemble()
            if has_guides:
                for i in range(count):
                    if not pace.done[i]:
                        contacts.guide(i)
            _factor(ties.start, lanes.a)
        if more > 0:
            for i in range(count):
                pace.residue[i] = contacts.worst(i)
        _substitute(ties.start, lanes.a, lanes.f)
        if more > 0:
            for i in range(count):
                if _is_held(contacts, i):
                    contacts.correct(i, turn)
        contacts.correct_ties()
        if alone and turn <= _SOON:
            for i in range(count):
                late = (turn == _SOON) & (pace.active[i] == 0) & (not pace.done[i])
                pace.waits[i] = select(late, pace.waits[i] + 1, select(pace.done[i], 0, pace.waits[i]))
                pace.done[i] = pace.done[i] | late
        if _all(pace.done):
            _push(contacts, more)
            break
    contacts.arrive()


def _turn(contacts, i, r1):
    """Set the directions of guides and contacts."""
    contacts.turn_guides(i, r1)
    contacts.turn(i, r1)


def _is_held(contacts, i):
    """Whether guides or contacts are to be solved in a lane."""
    return (not contacts.pace.done[i]) and (contacts.touching.guides > 0 or contacts.pace.active[i] > 0)


def _push(contacts, more):
    """Compute r1 = p - (h^2/2) W (sum lambda D + sum p b d)."""
    contacts.accelerate()
    if more > 0:
        for i in range(contacts.pace.h.size):
            if contacts.touching.guides > 0 or contacts.pace.active[i] > 0:
                contacts.push(i)
    contacts.move()


def _all(done):
    """Whether every lane is done."""
    undone = 0
    for i in range(done.size):
        undone += select(done[i], 0, 1)
    return undone == 0


def _factor(start, a):
    """Factor A = L U in place, with 1/U on the diagonal; entries before `start` of a row, and of its column, are 0."""
    count = a.shape[2]
    for row in range(a.shape[0]):
        first = start[row]
        for column in range(first, row):
            for k in range(max(first, start[column]), column):
                for i in range(count):
                    a[column, row, i] -= a[column, k, i] * a[k, row, i]
                for i in range(count):
                    a[row, column, i] -= a[row, k, i] * a[k, column, i]
            for i in range(count):
                a[row, column, i] *= a[column, column, i]
        for k in range(first, row):
            for i in range(count):
                a[row, row, i] -= a[row, k, i] * a[k, row, i]
        for i in range(count):
            a[row, row, i] = 1.0 / a[row, row, i]


def _substitute(start, a, f):
    """Compute f = A^-1 f, where A is factored."""
    count = f.shape[1]
    for row in range(f.shape[0]):
        for k in range(start[row], row):
            for i in range(count):
                f[row, i] -= a[row, k, i] * f[k, i]
    for row in range(f.shape[0] - 1, -1, -1):
        for k in range(row + 1, f.shape[0]):
            if start[k] <= row:
                for i in range(count):
                    f[row, i] -= a[row, k, i] * f[k, i]
        for i in range(count):
            f[row, i] *= a[row, row, i]
