"""One stage of a step: the multipliers of all that holds a body, by Newton's method, in all lanes at once.

The system of the ties is factored once for several corrections, which are cheap; each shrinks errors by some
(h omega)^2. Each lane stops by itself, so that its bits do not depend on its neighbours.
"""

from ...kernel.jit import inlined, select
from . import contract, hold, ties

# Most corrections, and after how many the system is factored again.
_MOST, _AGAIN = 40, 5
# After this correction a lane that needs more goes on in the next pass: a step after a blow takes five corrections, and
# 31 lanes would wait for each. Later corrections are one of 80 in free steps.
_SOON = 1
# In a stage this short, as a part of dt, links turn by less than round-off: what a correction would correct is the
# round-off of places, over h a velocity.
_BRIEF = 1e-8


@inlined
def solve(body, chain, rule, lanes, paces):
    """The end r1, v1 of a stage from (ra, va) with the steps pace.h; pace.done is False where none is found.

    Points that are led must be in r1 already. Lanes that are done at the start are left out.
    """
    tied, touching = body
    pace = paces[0]
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
            _turn(body, chain, rule, lanes, paces, i, lanes.ra)
    if tied.ends.shape[0] > 1:
        # Where the multipliers are guessed well, D is the only error, and with one tie none: it follows once more.
        _push(body, lanes, paces, 0)
        ties.follow(tied, lanes, pace)
    for turn in range(_MOST + 1):
        # D follows the multipliers before they are corrected: together, the second makes up again for the first.
        _push(body, lanes, paces, more)
        ties.follow(tied, lanes, pace)
        if more > 0:
            for i in range(count):
                if _is_held(touching, pace, i):
                    _turn(body, chain, rule, lanes, paces, i, lanes.r1)
        _push(body, lanes, paces, more)
        if turn == _MOST or _all(pace.done):
            break
        ties.residual(tied, lanes, pace, turn, rule)
        if turn % _AGAIN == 0 or guides > 0:
            ties.assemble(tied, lanes, pace)
            if guides > 0:
                for i in range(count):
                    if not pace.done[i]:
                        hold.guide(body, chain, lanes, pace, i)
            ties.factor(tied.start, lanes.a)
        if more > 0:
            for i in range(count):
                pace.residue[i] = hold.worst(touching, lanes, pace, rule, i)
        ties.substitute(tied.start, lanes.a, lanes.f)
        if more > 0:
            for i in range(count):
                if _is_held(touching, pace, i):
                    contract.correct(rule.walls, body, chain, rule, lanes, paces, i, turn)
        ties.correct(lanes, pace)
        if alone and turn <= _SOON:
            for i in range(count):
                late = (turn == _SOON) & (pace.held[i] == 0) & (not pace.done[i])
                pace.waits[i] = select(late, pace.waits[i] + 1, select(pace.done[i], 0, pace.waits[i]))
                pace.done[i] = pace.done[i] | late
        if _all(pace.done):
            _push(body, lanes, paces, more)
            break
    ties.arrive(tied, rule.gravity, lanes, pace)


@inlined
def _turn(body, chain, rule, lanes, paces, i, r1):
    """Directions of guides and contacts."""
    pace, held = paces
    hold.turn_guides(body, chain, lanes, i, r1)
    contract.turn(rule.walls, body, chain, lanes, held, pace, i, r1)


@inlined
def _is_held(touching, pace, i):
    """Whether more than ties is to be solved in a lane."""
    return (not pace.done[i]) and (touching.guides > 0 or pace.held[i] > 0)


@inlined
def _push(body, lanes, paces, more):
    """r1 = p - (h^2/2) W (sum lambda D + sum p b d)"""
    pace, held = paces
    ties.accelerate(body[0], lanes)
    if more > 0:
        for i in range(pace.h.size):
            if body[1].guides > 0 or pace.held[i] > 0:
                hold.push(body, lanes, held, pace, i)
    ties.move(lanes, pace)


@inlined
def _all(done):
    """Whether every lane is done."""
    undone = 0
    for i in range(done.size):
        undone += select(done[i], 0, 1)
    return undone == 0
