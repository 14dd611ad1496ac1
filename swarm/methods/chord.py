"""The contact step of `Impact`, a chord of the surface."""

from typing import Any, NamedTuple

from ..contact.reflection import chord_end, chord_step, chord_turn
from ..kernel.gravity import displacement
from ..kernel.jit import inlined, kept, select
from ..surfaces import fold as walls
from . import contract


class Chord(contract.MethodNumbers):
    """What kernels know of `Impact` with a contact step: `Lasting`, no laws, and the step."""

    size: float
    bend: float
    fall2: float
    shortest_flight: float
    shortest_length: float
    sliding_tolerance: float
    laws: Any
    contact_step: float  # h [s]

    def most_sweeps(self, chain):
        return walls.chord_sweeps(chain)

    def guess(self, chain, gravity, lane, wall):
        h = _step(self, lane)
        return walls.chord_guess(chain, wall, lane.r, displacement(gravity, lane.v, h)), (wall >= 0.0) & (h > 0.0)

    def improve(self, chain, gravity, lane, wall, solution, multiplier):
        p = displacement(gravity, lane.v, _step(self, lane))
        better, more = chord_step(chain, wall, lane.r, p, solution.kappa)
        return select(solution.unsolved, better, solution.kappa), solution.unsolved & more, contract.NO_RECORD

    def turn(self, chain, gravity, lane, wall, kappa):
        return chord_turn(chain, gravity, wall, lane.r, lane.v, _step(self, lane), kappa)

    def contact(self, chain, gravity, lane, wall, solution):
        h, turned = _step(self, lane), solution.turned
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


@inlined
def _step(method, lane):
    """The length of the contact step, which the end of the frame cuts."""
    return select(method.contact_step < lane.left, method.contact_step, lane.left)
