"""The contact step of `Impact`, a chord of the surface, and what follows short flights."""

from typing import NamedTuple

from ..contact.reflection import chord_end, chord_step, chord_turn
from ..contact.sliding import Contacts, Moving, impact
from ..kernel.gravity import displacement
from ..kernel.jit import inlined, kept, select
from ..status import Status
from ..surfaces import fold as walls
from . import contract


class Chord(NamedTuple):
    """What kernels know of `Impact` with a contact step; one of the shortest flight's two numbers is 0."""

    shortest_flight: float  # [s]
    shortest_length: float  # of a flight [m]
    touch: float  # distance within which walls hold a sliding particle [m]
    fall2: float  # |G| size, the square of a speed
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
    chord = hit & stays & (turned.impulse > 0.0) & (not solution.unsolved)
    return contract.Contact(
        select(chord, r, kept(lane.r)),
        select(chord, v, kept(lane.v)),
        lane.left - select(chord, h, 0.0),
        select(hit & (not chord), contract.HARD - wall, wall),
        select(chord, turned.impulse, 0.0),
        select(chord, 1.0, 0.0),
        lane.own.energy.twice,
    )


# --- Short flights ---------------------------------------------------------------------------------------


@contract.hard_pass.register(Chord)
def _(method, chain, gravity, lane, wall, lanes, i):
    contacts = Contacts(method.contact_step, None, lane.own.shortest, method.touch)
    return after_short_flight(contacts, chain, gravity, lane, wall, lanes, i)


@inlined
def after_short_flight(contacts, chain, gravity, lane, wall, lanes, i):
    """The impact of one particle that may graze, rest or be in a corner, as `hard_pass`."""
    moving = Moving(lane.r, lane.v, lane.left)
    end = impact(contacts, chain, gravity, wall, moving, lane.own.energy, lanes.impulse, i)
    return contract.Contact(end.r, end.v, lane.left - end.used, wall, 0.0, 1.0, end.twice_energy), Status.DONE.value
