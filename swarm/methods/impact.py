"""Impact: from impact to impact, with the converged multiplier of the conserving scheme."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from .. import checks
from ..contact.reflection import CHORD_NEEDS, chord_end, chord_step, chord_turn, exact
from ..contact.sliding import NEEDS as SLIDING_NEEDS
from ..contact.sliding import impact
from ..errors import SceneError
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import by_type, kept, select
from ..particles import Particles
from ..scene import Scene
from ..status import Status
from ..surfaces import chain as walls
from ..surfaces import flights
from . import base

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

    def numbers(self, scene: Scene) -> "ImpactNumbers":
        size = scene.finite_size()
        length = base.SHORTEST * size if self.shortest_flight is None else 0.0
        pull = 0.0 if scene.gravity is None else math.hypot(*scene.gravity)
        step = self.contact_step or None
        return ImpactNumbers(step, scene.restitution(), self.shortest_flight or 0.0, length, _TOUCH * size, pull * size)


class ImpactNumbers(NamedTuple):
    """What kernels know of the method; one of shortest_flight and shortest_length is 0."""

    contact_step: Any  # None or h
    restitution: Any  # None or one e a wall
    shortest_flight: float
    shortest_length: float
    touch: float
    fall2: float  # |G| size, the square of a speed


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(ImpactNumbers)
def _(method, mass, energy, vx, vy, vz):
    # Twice the energy per mass, 1/(2 |v|^2) where that is constant, and the shortest flight of this particle
    twice_energy = 2.0 * energy
    moving = twice_energy > 0.0
    half_inverse = select(moving, 0.5 / select(moving, twice_energy, 1.0), 0.0)
    speed2 = vx * vx + vy * vy + vz * vz + method.fall2
    moving = speed2 > 0.0
    shortest = method.shortest_flight + method.shortest_length / math.sqrt(select(moving, speed2, 1.0))
    return twice_energy, half_inverse, select(moving, shortest, 0.0)


@base.seeks.register(ImpactNumbers)
def _(method):
    return True


@base.flight.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, time, surface, hits):
    hit = (time <= left) & (surface >= 0.0)
    t = select(time < left, time, left)
    dx, dy, dz = displacement(gravity, vx, vy, vz, t)
    vx, vy, vz = accelerated(gravity, vx, vy, vz, t)
    # A flight shorter than the shortest ends in a contact that may graze; not the first one, cut by the frame's begin.
    short = (time < k2) & (hits > 0.0)
    surface = select(hit, select(short, base.HARD - surface, surface), -1.0)
    return x + dx, y + dy, z + dz, vx, vy, vz, left - t, surface


@base.unknown.register(ImpactNumbers)
def _(method):
    return method.contact_step


@base.most_sweeps.register(ImpactNumbers)
def _(method, chain):
    return _sweeps(method.contact_step, chain)


@by_type
def _sweeps(contact_step, chain):
    return 0


@_sweeps.register(float)
def _(contact_step, chain):
    return walls.chord_sweeps(chain)


@base.guess.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface):
    return _guess(method.contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left)


@by_type
def _guess(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left):
    return 0.0, False


@_guess.register(float)
def _(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left):
    h = select(contact_step < left, contact_step, left)
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    return walls.chord_guess(chain, surface, x, y, z, px, py, pz), (surface >= 0.0) & (h > 0.0)


@base.improve.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa, unsolved, multiplier):
    kappa, more = _improve(method.contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, kappa, unsolved)
    return kappa, more, 0.0, 0.0, 0.0


@by_type
def _improve(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, kappa, unsolved):
    return kappa, False


@_improve.register(float)
def _(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, kappa, unsolved):
    h = select(contact_step < left, contact_step, left)
    px, py, pz = displacement(gravity, vx, vy, vz, h)
    better, more = chord_step(chain, surface, x, y, z, px, py, pz, kappa)
    return select(unsolved, better, kappa), unsolved & more


@base.turns.register(ImpactNumbers)
def _(method):
    return _turns(method.contact_step)


@by_type
def _turns(contact_step):
    return False


@_turns.register(float)
def _(contact_step):
    return True


@base.turn.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, surface, kappa):
    return _turn(method.contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, kappa)


@by_type
def _turn(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, kappa):
    return 0.0, 0.0, 0.0, 0.0


@_turn.register(float)
def _(contact_step, chain, gravity, surface, x, y, z, vx, vy, vz, left, kappa):
    h = select(contact_step < left, contact_step, left)
    return chord_turn(chain, gravity, surface, x, y, z, vx, vy, vz, h, kappa)


@base.dissipates.register(ImpactNumbers)
def _(method):
    return _dissipates(method.restitution)


@by_type
def _dissipates(restitution):
    return False


@_dissipates.register(walls.Chain)
def _(restitution):
    return True


@base.contact.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned):
    return _lane(
        method.contact_step, method.restitution, chain, gravity, surface, x, y, z, vx, vy, vz, left, k0, k1, unsolved,
        tx, ty, tz, turned,
    )  # fmt: skip


@by_type
def _lane(
    contact_step, restitution, chain, gravity, surface, x, y, z, vx, vy, vz, left, k0, k1, unsolved, tx, ty, tz, turned
):
    """The contact of one lane."""
    raise NotImplementedError


@_lane.register(type(None))
def _(
    contact_step, restitution, chain, gravity, surface, x, y, z, vx, vy, vz, left, k0, k1, unsolved, tx, ty, tz, turned
):
    wx, wy, wz, impulse, energy = exact(restitution, chain, gravity, surface, x, y, z, vx, vy, vz, k0, k1)
    hit = surface >= 0.0
    return (
        x,
        y,
        z,
        select(hit, wx, kept(vx)),
        select(hit, wy, kept(vy)),
        select(hit, wz, kept(vz)),
        left,
        surface,
        select(hit, impulse, 0.0),
        select(hit, 1.0, 0.0),
        select(hit, energy, k0),
    )


@_lane.register(float)
def _(
    contact_step, restitution, chain, gravity, surface, x, y, z, vx, vy, vz, left, k0, k1, unsolved, tx, ty, tz, turned
):
    h = select(contact_step < left, contact_step, left)
    ox, oy, oz, wx, wy, wz, stays = chord_end(chain, gravity, surface, x, y, z, vx, vy, vz, tx, ty, tz, h, k0, k1)
    hit = surface >= 0.0
    chord = hit & stays & (turned > 0.0) & (not unsolved)
    return (
        select(chord, ox, kept(x)),
        select(chord, oy, kept(y)),
        select(chord, oz, kept(z)),
        select(chord, wx, kept(vx)),
        select(chord, wy, kept(vy)),
        select(chord, wz, kept(vz)),
        left - select(chord, h, 0.0),
        select(hit & (not chord), base.HARD - surface, surface),
        select(chord, turned, 0.0),
        select(chord, 1.0, 0.0),
        k0,
    )


# --- Short flights ---------------------------------------------------------------------------------------


@base.hard_pass.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    x, y, z, vx, vy, vz, used, energy = impact(
        method.contact_step, method.restitution, chain, gravity, surface, x, y, z, vx, vy, vz, left, k0, k1, k2,
        method.touch, impulse, lane,
    )  # fmt: skip
    return x, y, z, vx, vy, vz, left - used, 1.0, energy, Status.DONE.value
