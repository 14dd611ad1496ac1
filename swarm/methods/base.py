"""What a method is: a description for people, a tuple of numbers for kernels, and the pass of one particle.

A pass is a free flight followed by at most one contact. Its parts are scalar, branch-free functions, and lanes.py
loops over each part separately: short loops keep more lanes in the processor's window than one long loop (measured on
Zen 3: 7.8 instead of 10.3 ns an impact in an ellipsoid, 3.2 instead of 5.8 for the bare loop in C). What is rare and
needs loops and branches is left to `hard_pass`.
"""

import math
from dataclasses import dataclass
from typing import Any

from ..errors import SceneError
from ..kernel.jit import by_type, by_type_outlined
from ..particles import Particles
from ..scene import Scene
from ..surfaces import base as surfaces
from ..surfaces import required

# A wall this low in place of a surface index asks for `hard_pass`: HARD - wall is the surface.
HARD = -2.0


# Default shortest flight as a part of the crossing time size/|v|.
SHORTEST = 1e-4


@dataclass(frozen=True)
class Method:
    """A way to advance particles. See the subclasses."""

    def check(self, scene: Scene, particles: Particles) -> None:
        """Raise a `SceneError` if this method cannot run this scene with these particles."""

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        """The functions of surfaces/base.py that its kernels ask of every wall."""
        return ()

    def numbers(self, scene: Scene) -> Any:
        """The NamedTuple of numbers that kernels take in place of this description."""
        raise NotImplementedError

    def time_of_impact(self) -> float | None:
        """How long an impact takes besides the flight to it [s]; None where a frame costs steps, not impacts."""
        return None

    def span(self, name: str, duration: float) -> float:
        """`duration` [s] in the unit in which the kernel counts a frame down; `name` is for the error."""
        return duration

    def is_rigid(self) -> bool:
        """Whether a particle outside its walls by more than round-off is an error, and no wall that gives way."""
        return False

    def has_multipliers(self) -> bool:
        """Whether contacts run Uzawa's loop, whose sweeps are then counted."""
        return False

    def seldom_hard(self, scene: Scene) -> bool:
        """Whether most runs meet no contact for `hard_pass`: then its kernel is compiled when the first one comes."""
        return False

    def failure(self, moment: float, left: float, sweeps: int, stored: float) -> str:
        """The end of the sentence about a loop that did not converge in the frame that ends at `moment`."""
        raise NotImplementedError

    def too_fast(self, scene: Scene) -> str:
        """The end of the sentence about a step that could jump over a solid."""
        raise NotImplementedError

    def law(self) -> Any:
        """The regularisation whose stored energy counts as contact energy, or None for rigid walls."""
        return None


def check_surfaces(method: Method, scene: Scene) -> None:
    """Raise a `SceneError` if a surface does not give what the method, or what is observed, asks of it."""
    purpose = type(method).__name__ + (" without gravity" if scene.gravity is None else " under gravity")
    # `escaped` asks where flights without gravity end.
    seen = (surfaces.first_hit,) if scene.is_open() and scene.gravity is None else ()
    required.require(scene.surfaces, purpose, (*method.needs(scene), surfaces.distance, *seen))


def check_elastic(name: str, scene: Scene) -> None:
    """Raise a `SceneError` if a surface loses energy, which a method of this name does not know."""
    for i, surface in enumerate(scene.surfaces):
        if surface.restitution < 1.0:
            raise SceneError(
                f"surfaces[{i}].restitution must be 1 with {name}, which conserves the energy, got "
                f"{surface.restitution:g}; use Impact"
            )


def check_crossing(name: str, step: float | None, scene: Scene, particles: Particles) -> None:
    """Raise a `SceneError` if the fastest particle crosses the scene in less than a contact step of this length."""
    if not step:
        return  # nothing that the speeds have to be looked at for
    fastest = particles.fastest()
    crossing = scene.size() / fastest if fastest > 0.0 else math.inf
    if step > crossing:
        raise SceneError(
            f"{name} must be at most the crossing time size/|v| of the fastest particle, {crossing:.3g} s, got {step:g}"
        )


@by_type
def lane_constants(method, mass, energy, vx, vy, vz):
    """Three numbers of one particle that hold for the whole frame; the method says which."""
    raise NotImplementedError


@by_type
def seeks(method):
    """Whether `flight` takes the first hit of a flight, found before: a constant for the compiler."""
    return False


@by_type
def flight(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, time, surface, hits):
    """Fly to the next contact, or to the end: (x, y, z, vx, vy, vz, left, surface).

    The arguments time and surface are `flights.first_hit`, for a method that seeks it; hits is how many impacts the
    frame has had. `left` is what is left of the frame, in the method's unit; the surface that is returned is the wall
    of the contact that follows, or -1 for none; `HARD - wall` leaves the contact to `hard_pass`.
    """
    raise NotImplementedError


@by_type
def unknown(method):
    """None where contacts have a closed form: then nothing that solves for an unknown is compiled."""
    return method


@by_type
def most_sweeps(method, chain):
    """The most sweeps of `improve` a contact may take: a constant for the compiler, 0 where it has a closed form."""
    return 0


@by_type
def guess(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface):
    """First guess of the contact's unknown kappa, and whether the lane has one to solve for."""
    return 0.0, False


@by_type
def improve(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa, unsolved, multiplier):
    """One sweep of the solve: (kappa, unsolved, (Phi0 + Phi1)/2, V, dkappa/dlambda).

    A lane that is solved stays as it is, bit by bit. The last three are for the loop of a multiplier.
    """
    return kappa, False, 0.0, 0.0, 0.0


@by_type
def multiplier_sweeps(method):
    """The most sweeps of that loop."""
    return 0


@by_type
def first_multiplier(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, surface, kappa):
    """The multiplier that the loop (8) starts from, kappa for it, and the acceleration of the loop."""
    return 0.0, kappa, 0.0


@by_type
def next_multiplier(method, left, acceleration, multiplier, mean, stored, multiplier_before, miss_before):
    """The multiplier after a sweep, what the sweep missed by, and whether to go on."""
    return 0.0, 0.0, False


@by_type
def turns(method):
    """Whether `turn` runs before `contact`, as one loop of both would be too long: a constant for the compiler."""
    return False


@by_type
def turn(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, surface, kappa):
    """The velocity after the contact with `surface` and its impulse per mass, for `contact`."""
    return 0.0, 0.0, 0.0, 0.0


@by_type
def dissipates(method):
    """Whether contacts may lose energy, so that k0, twice the energy per mass, changes: a constant for the compiler."""
    return False


@by_type
def contact(
    method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, kappa, unsolved, tx, ty, tz, turned
):
    """The contact with `surface`: (x, y, z, vx, vy, vz, left, surface, impulse, hits, k0).

    (tx, ty, tz, turned) is what `turn` found.

    `impulse` is the normal impulse per mass that the surface gave; `hits` counts new impacts. A `surface` that is HARD
    already passes through and nothing else changes; to become hard, return `HARD - surface`. `unsolved` says that the
    unknown was not found, or that the multiplier did not converge.
    """
    raise NotImplementedError


@by_type_outlined
def hard_pass(method, chain, gravity, x, y, z, vx, vy, vz, left, k0, k1, k2, surface, impulse, record, lane):
    """What flight or contact left: (x, y, z, vx, vy, vz, left, hits, k0, status).

    Adds to `impulse[surface, lane]`, and writes the sweeps of a multiplier loop into `record[:, lane]`.
    """
    raise NotImplementedError
