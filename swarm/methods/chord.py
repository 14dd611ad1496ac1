"""The contact step of `Impact`, a chord of the surface."""

from typing import Any, NamedTuple

from ..contact.reflection import chord_end, chord_step, chord_turn
from ..kernel.gravity import displacement
from ..kernel.jit import inlined, kept, select
from ..surfaces import fold as walls
from . import contract


class Chord(NamedTuple):
    """What kernels know of `Impact` with a contact step: `Lasting`, no laws, and the step."""

    size: float
    bend: float
    fall2: float
    shortest_flight: float
    shortest_length: float
    sliding_tolerance: float
    laws: Any
    contact_step: float  # h [s]


@inlined
def _step(method, lane):
    """The length of the contact step, which the end of the frame cuts."""
    return select(method.contact_step < lane.left, method.contact_step, lane.left)


@contract.most_sweeps.register(Chord)
def _(method, chain):
    return walls.chord_sweeps(chain)


@contract.guess.register(Chord)
def _(method, chain, gravity, lane, wall):
    h = _step(method, lane)
    return walls.chord_guess(chain, wall, lane.r, displacement(gravity, lane.v, h)), (wall >= 0.0) & (h > 0.0)


@contract.improve.register(Chord)
def _(method, chain, gravity, lane, wall, solution, multiplier):
    p = displacement(gravity, lane.v, _step(method, lane))
    better, more = chord_step(chain, wall, lane.r, p, solution.kappa)
    return select(solution.unsolved, better, solution.kappa), solution.unsolved & more, contract.NO_RECORD


@contract.turn.register(Chord)
def _(method, chain, gravity, lane, wall, kappa):
    return chord_turn(chain, gravity, wall, lane.r, lane.v, _step(method, lane), kappa)


@contract.contact.register(Chord)
def _(method, chain, gravity, lane, wall, solution):
    h, turned = _step(method, lane), solution.turned
    r, v, stays = chord_end(chain, gravity, wall, lane.r, lane.v, turned.v, h, lane.own.energy)
    hit = wall >= 0.0
    chord = hit & stays & (turned.impulse > lane.own.slow) & (not solution.unsolved)
    return contract.Contact(
        select(chord, r, kept(lane.r)),
        select(chord, v, kept(lane.v)),
        lane.left - select(chord, h, 0.0),
        wall,
        select(chord, turned.impulse, 0.0),
        select(chord, 1.0, 0.0),
        lane.own.energy.twice,
        hit & (not chord),
    )
