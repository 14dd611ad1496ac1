"""One stage of a step: the multipliers of all that holds a body, by Newton's method, in all lanes at once.

The system of the ties is factored once for several corrections, which are cheap; each shrinks errors by some
(h omega)^2. Each lane stops by itself, so that its bits do not depend on its neighbours.
"""

from ...kernel.jit import select
from . import guides as guides_of
from . import hold, ties

# Most corrections, and after how many the system is factored again.
_MOST, _AGAIN = 40, 5
# After this correction a lane that needs more goes on in the next pass: a step after a blow takes five corrections, and
# 31 lanes would wait for each. Later corrections are one of 80 in free steps.
_SOON = 1
# In a stage this short, as a part of dt, links turn by less than round-off: what a correction would correct is the
# round-off of places, over h a velocity.
_BRIEF = 1e-8


def solve(contacts):
    """The end r1, v1 of a stage from (ra, va) with the steps pace.h; pace.done is False where none is found.

    Points that are led must be in r1 already. Lanes that are done at the start are left out.
    """
    body, chain, rule, lanes, pace, _held = contacts
    tied, touching = body
    count, guides = pace.h.size, touching.guides
    alone = rule.stages.size == 1 and guides == 0 and not rule.loop
    ties.launch(tied, rule.gravity, lanes, pace)
    more = guides
    is_rigid = guides == 0 and tied.links == tied.ends.shape[0]
    for i in range(count):
        brief = is_rigid & (pace.held[i] == 0) & (abs(pace.h[i]) < _BRIEF * rule.dt)
        pace.done[i] = pace.done[i] | brief
        more += pace.held[i] > 0
        if _is_held(touching, pace, i):
            _turn(contacts, i, lanes.ra)
    if tied.ends.shape[0] > 1:
        # Where the multipliers are guessed well, D is the only error, and with one tie none: it follows once more.
        _push(contacts, 0)
        ties.follow(tied, lanes, pace)
    for turn in range(_MOST + 1):
        # D follows the multipliers before they are corrected: together, the second makes up again for the first.
        _push(contacts, more)
        ties.follow(tied, lanes, pace)
        if more > 0:
            for i in range(count):
                if _is_held(touching, pace, i):
                    _turn(contacts, i, lanes.r1)
        _push(contacts, more)
        if turn == _MOST or _all(pace.done):
            break
        ties.residual(tied, lanes, pace, turn, rule)
        if turn % _AGAIN == 0 or guides > 0:
            ties.assemble(tied, lanes, pace)
            if guides > 0:
                for i in range(count):
                    if not pace.done[i]:
                        guides_of.guide(body, chain, lanes, pace, i)
            ties.factor(tied.start, lanes.a)
        if more > 0:
            for i in range(count):
                pace.residue[i] = guides_of.worst(touching, lanes, pace, rule, i)
        ties.substitute(tied.start, lanes.a, lanes.f)
        if more > 0:
            for i in range(count):
                if _is_held(touching, pace, i):
                    contacts.correct(i, turn)
        ties.correct(lanes, pace)
        if alone and turn <= _SOON:
            for i in range(count):
                late = (turn == _SOON) & (pace.held[i] == 0) & (not pace.done[i])
                pace.waits[i] = select(late, pace.waits[i] + 1, select(pace.done[i], 0, pace.waits[i]))
                pace.done[i] = pace.done[i] | late
        if _all(pace.done):
            _push(contacts, more)
            break
    ties.arrive(tied, rule.gravity, lanes, pace)


def _turn(contacts, i, r1):
    """Directions of guides and contacts."""
    guides_of.turn(contacts.body, contacts.chain, contacts.lanes, i, r1)
    contacts.turn(i, r1)


def _is_held(touching, pace, i):
    """Whether more than ties is to be solved in a lane."""
    return (not pace.done[i]) and (touching.guides > 0 or pace.held[i] > 0)


def _push(contacts, more):
    """r1 = p - (h^2/2) W (sum lambda D + sum p b d)"""
    body, _chain, _rule, lanes, pace, held = contacts
    ties.accelerate(body[0], lanes)
    if more > 0:
        for i in range(pace.h.size):
            if body[1].guides > 0 or pace.held[i] > 0:
                hold.push(body, lanes, held, pace, i)
    ties.move(lanes, pace)


def _all(done):
    """Whether every lane is done."""
    undone = 0
    for i in range(done.size):
        undone += select(done[i], 0, 1)
    return undone == 0
