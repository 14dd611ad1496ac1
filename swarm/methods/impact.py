"""Impact: from impact to impact, with the converged multiplier of the conserving scheme."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from .. import checks
from ..contact.reflection import CHORD_NEEDS, Energy, exact, loses_energy
from ..contact.sliding import NEEDS as SLIDING_NEEDS
from ..contact.sliding import Contacts
from ..errors import SceneError
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import kept, select
from ..kernel.vector import square
from ..particles import Particles
from ..scene import Scene
from ..surfaces import flights
from . import base, contract
from .chord import Chord, after_short_flight

# Walls within this part of the scene's size hold a sliding particle together.
_TOUCH = 1e-10


@dataclass(frozen=True)
class Impact(base.Method):
    """Exact flight to the impact instant, then the converged contact step, and on: the default method.

    At the impact the particle is on the surface (State I), where the augmented Lagrangian scheme with g1 = 0 is
    a reflection about the discrete gradient D(r0, r1):  v1 = v0 - 2 (v0.n) n,  r1 = r0 + h (v0 + v1)/2.

    Args:
        contact_step: length h of the contact step [s], >= 0 and at most the crossing time size/|v|. 0 is the exact
            elastic reflection; h > 0 slides along a chord of the surface, as the paper's scheme does.
        shortest_flight: where flights are shorter [s], time after time (grazing, whispering gallery, resting, a cusp),
            the particle slides along its walls in steps of this length, so its cost is bounded.
            None: 1e-4 of the crossing time, which costs a tangential launch 1e4 steps a crossing and its speed
            along the wall a relative error (h |v|/R)^2/12 of 8e-10. Under gravity G the crossing time is
            size/sqrt(|v|^2 + |G| size).

    Raises:
        SceneError: an argument is out of its range.

    Conserves: the energy to round-off that does not grow (each particle knows its energy); never leaves the walls by
    more than round-off. Where surfaces have a restitution below 1, energy and dissipated energy together.
    Order: exact for contact_step = 0, otherwise first order in h at an impact; sliding and rolling contacts, which take
    steps of the shortest flight, are of second order in it.
    Cost: one square root and one division a flight of a sphere; see `python -m bench throughput`.
    Source: García Orden & Ortega 2007, eqs. (7), (8) in the limit V -> 0.

    >>> Impact(contact_step=-1.0)
    Traceback (most recent call last):
    swarm.errors.SceneError: contact_step must be 0 or more, got -1
    """

    contact_step: float = 0.0
    shortest_flight: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "contact_step", checks.at_least("contact_step", self.contact_step, 0.0))
        if self.shortest_flight is not None:
            object.__setattr__(self, "shortest_flight", checks.positive("shortest_flight", self.shortest_flight))

    def check(self, scene: Scene, particles: Particles) -> None:
        base.check_crossing("contact_step", self.contact_step, scene, particles)
        base.check_crossing("shortest_flight", self.shortest_flight, scene, particles)
        if self.contact_step > 0.0 and scene.restitution() is not None:
            raise SceneError(
                f"contact_step must be 0 where a surface has a restitution below 1, got {self.contact_step:g}: "
                "the contact step conserves the energy"
            )

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        chord = CHORD_NEEDS if self.contact_step > 0.0 else ()
        return *flights.of_flights(scene.gravity is not None), *SLIDING_NEEDS, *chord

    def time_of_impact(self) -> float:
        return self.contact_step

    def is_rigid(self) -> bool:
        return True

    def seldom_hard(self, scene: Scene) -> bool:
        # In one smooth cavity only what grazes is: one launch in 1e9, if none is aimed.
        return len(scene.owners()) == 1 and not scene.surfaces[0].is_solid() and scene.gravity is None

    def numbers(self, scene: Scene) -> "Reflection | Chord":
        size = scene.finite_size()
        length = base.SHORTEST * size if self.shortest_flight is None else 0.0
        pull = 0.0 if scene.gravity is None else math.hypot(*scene.gravity)
        given = self.shortest_flight or 0.0, length, _TOUCH * size, pull * size
        if self.contact_step > 0.0:
            return Chord(*given, self.contact_step)
        return Reflection(*given, scene.restitution())


class Reflection(NamedTuple):
    """What kernels know of the method with the exact reflection; one of the shortest flight's two numbers is 0."""

    shortest_flight: float  # [s]
    shortest_length: float  # of a flight [m]
    touch: float  # distance within which walls hold a sliding particle [m]
    fall2: float  # |G| size, the square of a speed
    restitution: Any  # None or one e a wall


class ImpactOwn(NamedTuple):
    """What a lane keeps: its energy, and its shortest flight [s]."""

    energy: Energy
    shortest: float


# --- One pass --------------------------------------------------------------------------------------------


@contract.constants.register(Reflection)
@contract.constants.register(Chord)
def _(method, mass, energy, v):
    # Twice the energy per mass, 1/(2 |v|^2) where that is constant, and the shortest flight of this particle
    twice_energy = 2.0 * energy
    moving = twice_energy > 0.0
    half_inverse = select(moving, 0.5 / select(moving, twice_energy, 1.0), 0.0)
    speed2 = square(v) + method.fall2
    moving = speed2 > 0.0
    shortest = method.shortest_flight + method.shortest_length / math.sqrt(select(moving, speed2, 1.0))
    return twice_energy, half_inverse, select(moving, shortest, 0.0)


@contract.own.register(Reflection)
@contract.own.register(Chord)
def _(method, first, second, third):
    return ImpactOwn(Energy(first, second), third)


@contract.dissipates.register(Reflection)
def _(method):
    return loses_energy(method.restitution)


@contract.land.register(Reflection)
@contract.land.register(Chord)
def _(method, chain, gravity, lane, hit):
    t = select(hit.time < lane.left, hit.time, lane.left)
    # A flight shorter than the shortest ends in a contact that may graze; not the first one, cut by the frame's begin.
    short = (hit.time < lane.own.shortest) & (lane.hits > 0.0)
    wall = select(short, contract.HARD - hit.wall, hit.wall)
    return contract.Flight(
        lane.r + displacement(gravity, lane.v, t),
        accelerated(gravity, lane.v, t),
        lane.left - t,
        select((hit.time <= lane.left) & (hit.wall >= 0.0), wall, -1.0),
    )


@contract.contact.register(Reflection)
def _(method, chain, gravity, lane, wall, solution):
    bounce = exact(method.restitution, chain, gravity, wall, lane.r, lane.v, lane.own.energy)
    hit = wall >= 0.0
    return contract.Contact(
        lane.r,
        select(hit, bounce.v, kept(lane.v)),
        lane.left,
        wall,
        select(hit, bounce.impulse, 0.0),
        select(hit, 1.0, 0.0),
        select(hit, bounce.twice_energy, lane.own.energy.twice),
    )


# --- Short flights ---------------------------------------------------------------------------------------


@contract.hard_pass.register(Reflection)
def _(method, chain, gravity, lane, wall, lanes, i):
    contacts = Contacts(None, method.restitution, lane.own.shortest, method.touch)
    return after_short_flight(contacts, chain, gravity, lane, wall, lanes, i)
