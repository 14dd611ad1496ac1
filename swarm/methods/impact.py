"""Impact: from impact to impact, with the converged multiplier of the conserving scheme."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from .. import checks
from .._jit import by_type, kept, select
from ..contact.reflection import along, chord_step, exact, impact, reflect
from ..errors import SceneError
from ..particles import Particles
from ..scene import Scene
from ..status import Status
from ..surfaces import chain as walls
from . import base


@dataclass(frozen=True)
class Impact(base.Method):
    """Exact flight to the impact instant, then the converged contact step, and on: the default method.

    At the impact the particle is on the surface (State I), where the augmented Lagrangian scheme with g1 = 0 is
    a reflection about the discrete gradient D(r0, r1):  v1 = v0 - 2 (v0.n) n,  r1 = r0 + h (v0 + v1)/2.

    Args:
        contact_step: length h of the contact step [s], >= 0 and at most the crossing time size/|v|. 0 is the exact
            elastic reflection; h > 0 slides along a chord of the surface, as the paper's scheme does.
        shortest_flight: flights that return to the same wall sooner [s] (grazing, whispering gallery) become
            chord steps of this length, so a particle launched along the wall costs a bounded number of steps.
            None: 1e-4 of the crossing time, which costs a tangential launch 1e4 steps a crossing and its speed
            along the wall a relative error (h |v|/R)^2/12 of 8e-10.

    Raises:
        SceneError: an argument is out of its range, or the scene has gravity (not yet supported).

    Conserves: kinetic energy to round-off that does not grow (each particle knows its |v|^2); never leaves the
    walls by more than round-off. Order: exact for contact_step = 0, otherwise first order in h at an impact.
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
        if scene.gravity is not None:
            raise SceneError(
                f"Impact does not know gravity yet, got gravity={tuple(scene.gravity)}; "
                "use Penalty(dt, penalty) or gravity=None"
            )
        base.check_crossing("contact_step", self.contact_step, scene, particles)
        base.check_crossing("shortest_flight", self.shortest_flight, scene, particles)

    def numbers(self, scene: Scene) -> "ImpactNumbers":
        length = base.SHORTEST * scene.finite_size() if self.shortest_flight is None else 0.0
        return ImpactNumbers(self.contact_step or None, self.shortest_flight or 0.0, length)


class ImpactNumbers(NamedTuple):
    """What kernels know of the method; one of the last two is 0."""

    contact_step: Any  # None or h
    shortest_flight: float
    shortest_length: float


# --- One pass --------------------------------------------------------------------------------------------


@base.lane_constants.register(ImpactNumbers)
def _(method, mass, energy, vx, vy, vz):
    # |v|^2 and 1/(2 |v|^2) at the start of the run, and the shortest flight of this particle
    speed2 = 2.0 * energy
    moving = speed2 > 0.0
    safe = select(moving, speed2, 1.0)
    shortest = method.shortest_flight + method.shortest_length / math.sqrt(safe)
    return speed2, select(moving, 0.5 / safe, 0.0), select(moving, shortest, 0.0)


@base.flight.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2):
    time, surface = walls.first_hit(chain, x, y, z, vx, vy, vz)
    hit = time <= left
    t = select(hit, time, left)
    # A flight shorter than the shortest ends in a contact that may graze.
    surface = select(hit, select(time < k2, base.HARD - surface, surface), -1.0)
    return x + t * vx, y + t * vy, z + t * vz, vx, vy, vz, left - t, surface


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
    return _guess(method.contact_step, chain, surface, x, y, z, vx, vy, vz, left)


@by_type
def _guess(contact_step, chain, surface, x, y, z, vx, vy, vz, left):
    return 0.0, False


@_guess.register(float)
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left):
    h = select(contact_step < left, contact_step, left)
    return walls.chord_guess(chain, surface, x, y, z, h * vx, h * vy, h * vz), (surface >= 0.0) & (h > 0.0)


@base.improve.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa, unsolved, multiplier):
    kappa, more = _improve(method.contact_step, chain, surface, x, y, z, vx, vy, vz, left, kappa, unsolved)
    return kappa, more, 0.0, 0.0, 0.0


@by_type
def _improve(contact_step, chain, surface, x, y, z, vx, vy, vz, left, kappa, unsolved):
    return kappa, False


@_improve.register(float)
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, kappa, unsolved):
    h = select(contact_step < left, contact_step, left)
    better, more = chord_step(chain, surface, x, y, z, h * vx, h * vy, h * vz, kappa)
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
    return _turn(method.contact_step, chain, surface, x, y, z, vx, vy, vz, left, k0, k1, kappa)


@by_type
def _turn(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse, kappa):
    return 0.0, 0.0, 0.0, 0.0


@_turn.register(float)
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse, kappa):
    h = select(contact_step < left, contact_step, left)
    nx, ny, nz = walls.chord_normal(chain, surface, x, y, z, h * vx, h * vy, h * vz, kappa)
    return reflect(vx, vy, vz, nx, ny, nz, speed2, half_inverse)


@base.contact.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned):
    return _lane(method.contact_step, chain, surface, x, y, z, vx, vy, vz, left, k0, k1, unsolved, tx, ty, tz, turned)


@by_type
def _lane(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse, unsolved, tx, ty, tz, turned):
    """The contact of one lane."""
    raise NotImplementedError


@_lane.register(type(None))
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse, unsolved, tx, ty, tz, turned):
    wx, wy, wz, impulse = exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
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
    )


@_lane.register(float)
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse, unsolved, tx, ty, tz, turned):
    h = select(contact_step < left, contact_step, left)
    ox, oy, oz, stays = along(chain, surface, x, y, z, vx, vy, vz, tx, ty, tz, h)
    hit = surface >= 0.0
    chord = hit & stays & (turned > 0.0) & (not unsolved)
    return (
        select(chord, ox, kept(x)),
        select(chord, oy, kept(y)),
        select(chord, oz, kept(z)),
        select(chord, tx, kept(vx)),
        select(chord, ty, kept(vy)),
        select(chord, tz, kept(vz)),
        left - select(chord, h, 0.0),
        select(hit & (not chord), base.HARD - surface, surface),
        select(chord, turned, 0.0),
        select(chord, 1.0, 0.0),
    )


# --- Grazing ---------------------------------------------------------------------------------------------


@base.hard_pass.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    x, y, z, vx, vy, vz, used = impact(
        method.contact_step, chain, surface, x, y, z, vx, vy, vz, left, k0, k1, k2, impulse, lane
    )
    return x, y, z, vx, vy, vz, left - used, 1.0, Status.DONE.value
