"""What the walls of a scene do to a body in its steps: rigid ones in hold.py, springs in soft.py.

The first argument is `rule.walls`, None or `Soft`, which chooses the definition.
"""

from ...kernel.jit import by_type, by_type_outlined


@by_type_outlined
def begin(kind, body, chain, rule, lanes, paces, i):
    """The contacts of a lane at the start of a trial, and how they press."""
    raise NotImplementedError


@by_type_outlined
def turn(kind, body, chain, lanes, held, pace, i, r1):
    """Directions of the contacts of a lane: the discrete gradient of each gap from the start of the stage to r1."""
    raise NotImplementedError


@by_type_outlined
def correct(kind, body, chain, rule, lanes, paces, i, number):
    """Correct the forces of contacts, and f, the corrections of ties and guides, for it; whether these are the last."""
    raise NotImplementedError


@by_type
def again(kind, body, chain, rule, lanes, paces):
    """Update the multipliers of lanes whose loop goes on, and count these; the stage of the others is done."""
    raise NotImplementedError


@by_type_outlined
def judge(kind, touching, chain, rule, lanes, paces, i):
    """What becomes of a lane whose trial ends outside, has no solution, or looks for the time of an impact."""
    raise NotImplementedError


@by_type_outlined
def end(kind, body, chain, lanes, paces, state, i):
    """Book what the walls did in a step; whether contacts last."""
    raise NotImplementedError


@by_type_outlined
def strike(kind, body, chain, rule, lanes, paces, state, i):
    """What happens at the instant of an impact; contacts may last from there."""
    raise NotImplementedError
