"""The contact step of `Impact`, a chord of the surface."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..contact.reflection import Energy, chord_end, chord_step, chord_turn
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import kept, select
from ..kernel.vector import square
from . import contract

# A particle gets nowhere in this part of a crossing.
_INSTANT = 1e-9


class Instants(contract.MethodNumbers):
    """A method that steps to the instant of impact, with the fields of `Lasting`."""

    def constants(self, mass, energy, scale2):
        # Twice the energy per mass, 1/(2 |v|^2) where that is constant, and the speed of this particle that is slow:
        # not by its velocity at the start of the frame, on whose ends no contact may depend
        twice_energy = 2.0 * energy
        moving = twice_energy > 0.0
        half_inverse = select(moving, 0.5 / select(moving, twice_energy, 1.0), 0.0)
        slow = (self.shortest_flight * scale2 + self.shortest_length * math.sqrt(scale2)) / self.size
        return twice_energy, half_inverse, slow

    def own(self, first, second, third):
        return ImpactOwn(Energy(first, second), third)

    def instant(self, v):
        speed2 = square(v) + self.fall2
        return _INSTANT * self.size / math.sqrt(select(speed2 > 0.0, speed2, np.inf))

    holds = True

    def land(self, chain, gravity, lane, hit):
        t = select(hit.time < lane.left, hit.time, lane.left)
        return contract.Flight(
            lane.r + displacement(gravity, lane.v, t),
            accelerated(gravity, lane.v, t),
            lane.left - t,
            select((hit.time <= lane.left) & (hit.wall >= 0.0), hit.wall, -1.0),
        )


class ImpactOwn(NamedTuple):
    """What a lane keeps: its energy, and twice the speed [m/s] away from a wall below which a contact may last."""

    energy: Energy
    slow: float


class Chord(Instants):
    """What kernels know of `Impact` with a contact step: `Lasting`, no laws, and the step."""

    size: float
    bend: float
    fall2: float
    shortest_flight: float
    shortest_length: float
    sliding_tolerance: float
    laws: Any
    contact_step: float  # h [s]

    holds = True

    def most_sweeps(self, chain):
        return chain.chord_sweeps()

    def guess(self, chain, gravity, lane, wall):
        h = _step(self, lane)
        return chain.chord_guess(wall, lane.r, displacement(gravity, lane.v, h)), (wall >= 0.0) & (h > 0.0)

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


def _step(method, lane):
    """The length of the contact step, which the end of the frame cuts."""
    return select(method.contact_step < lane.left, method.contact_step, lane.left)
