"""Impact: from impact to impact, with the converged multiplier of the conserving scheme."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from .. import checks
from .._jit import by_type, inlined, kept, select
from ..contact.reflection import chord, chord_step, reflect
from ..errors import SceneError
from ..particles import Particles
from ..scene import Scene
from ..status import Status
from ..surfaces import chain as walls
from . import base

# Default shortest flight as a part of the crossing time size/|v|.
_SHORTEST = 1e-4
# A second wall nearer than this part of the shortest flight is met in the same instant.
_SAME_INSTANT = 1e-6


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
        length = _SHORTEST * scene.finite_size() if self.shortest_flight is None else 0.0
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
    wx, wy, wz, impulse = _exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
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
    ox, oy, oz, stays = _along(chain, surface, x, y, z, vx, vy, vz, tx, ty, tz, h)
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


@inlined
def _exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse):
    """The exact reflection: velocity and impulse per mass."""
    nx, ny, nz = walls.unit_normal(chain, surface, x, y, z)
    return reflect(vx, vy, vz, nx, ny, nz, speed2, half_inverse)


@inlined
def _along(chain, surface, x, y, z, vx, vy, vz, wx, wy, wz, h):
    """The end of the chord step, (v0 + v1)/2 = (r1 - r0)/h, and whether no other wall cuts it."""
    ux, uy, uz = 0.5 * (vx + wx), 0.5 * (vy + wy), 0.5 * (vz + wz)
    cut, _other = walls.other_hit(chain, surface, x, y, z, ux, uy, uz)
    ox, oy, oz = walls.settle(chain, surface, x + h * ux, y + h * uy, z + h * uz)
    return ox, oy, oz, cut > h


# --- Grazing ---------------------------------------------------------------------------------------------


@by_type
def _contact(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse):
    """The contact step of one particle: (x, y, z, vx, vy, vz, time used, impulse)."""
    wx, wy, wz, impulse = _exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
    return x, y, z, wx, wy, wz, 0.0, impulse


@_contact.register(float)
def _(contact_step, chain, surface, x, y, z, vx, vy, vz, left, speed2, half_inverse):
    h = min(contact_step, left)
    kappa = chord(chain, surface, x, y, z, h * vx, h * vy, h * vz)
    nx, ny, nz = walls.chord_normal(chain, surface, x, y, z, h * vx, h * vy, h * vz, kappa)
    wx, wy, wz, impulse = reflect(vx, vy, vz, nx, ny, nz, speed2, half_inverse)
    ox, oy, oz, stays = _along(chain, surface, x, y, z, vx, vy, vz, wx, wy, wz, h)
    if stays and impulse > 0.0:
        return ox, oy, oz, wx, wy, wz, h, impulse
    # A chord that another wall would cut, or that a solid does not oppose (the free flight of length h ends outside it
    # again), gives way to the exact reflection.
    wx, wy, wz, impulse = _exact(chain, surface, x, y, z, vx, vy, vz, speed2, half_inverse)
    return x, y, z, wx, wy, wz, 0.0, impulse


@base.hard_pass.register(ImpactNumbers)
def _(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    # A flight shorter than `shortest_flight` ends here. If the next one, back to the same wall, is short too, the
    # particle grazes: it takes a chord step of that length h instead.
    nx, ny, nz = walls.unit_normal(chain, surface, x, y, z)
    wx, wy, wz, given = reflect(vx, vy, vz, nx, ny, nz, k0, k1)
    used = 0.0
    if walls.hit_of(chain, surface, x, y, z, wx, wy, wz) < k2:
        # How far along the wall until another wall is in the way?
        tx, ty, tz = 0.5 * (vx + wx), 0.5 * (vy + wy), 0.5 * (vz + wz)
        cut, other = walls.other_hit(chain, surface, x, y, z, tx, ty, tz)
        nx, ny, nz = walls.unit_normal(chain, other, x, y, z)
        ax, ay, az, blow = reflect(vx, vy, vz, nx, ny, nz, k0, k1)
        if cut < _SAME_INSTANT * k2 and blow > 0.0:
            # Both walls at once: the blow of the other one comes first, this one is met again in the next pass.
            impulse[int(other), lane] += blow
            return x, y, z, ax, ay, az, left, 1.0, Status.DONE.value
        # Half way to the other wall at most: the chord bends towards the inside, and what is left halves.
        h = min(k2, left, 0.5 * cut)
        x, y, z, wx, wy, wz, used, given = _contact(h, chain, surface, x, y, z, vx, vy, vz, left, k0, k1)
        ex, ey, ez = x + h * wx, y + h * wy, z + h * wz
        cut, other = walls.other_hit(chain, surface, x, y, z, wx, wy, wz)
        if used == 0.0 and cut > h and not walls.outside(chain, -1.0, ex, ey, ez):
            # The wall curves away from the flight (a solid that is only touched): the sign of v.n is round-off.
            x, y, z, used = ex, ey, ez, h
    else:
        x, y, z, wx, wy, wz, used, given = _contact(
            method.contact_step, chain, surface, x, y, z, vx, vy, vz, left, k0, k1
        )
    impulse[int(surface), lane] += given
    return x, y, z, wx, wy, wz, left - used, 1.0, Status.DONE.value
