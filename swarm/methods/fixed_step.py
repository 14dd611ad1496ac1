"""What methods with a fixed step share: whole steps, the jump over free ones, solids that a step could miss."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import checks
from ..contact.regularisation import regularisation
from ..errors import SceneError
from ..kernel.gravity import accelerated, displacement
from ..kernel.jit import by_type, inlined, kept, select
from ..particles import Particles
from ..scene import Scene
from ..surfaces import flights
from . import base

# A frame may miss a whole number of steps by this part of a step: decimal times are not binary ones.
_WHOLE = 1e-6
# More steps than this are not counted exactly.
_MOST_STEPS = 2.0**53
GRADIENTS = ("composite", "mean-value")


@dataclass(frozen=True)
class SoftWalls(base.Method):
    """A method of fixed step whose walls are springs, and nothing else. See the subclasses."""

    dt: float
    penalty: float
    exponent: float = 1.0

    def __post_init__(self) -> None:
        check_numbers(self)

    def check(self, scene: Scene, particles: Particles) -> None:
        base.check_elastic(type(self).__name__, scene)
        check_solids(scene, particles, self.dt)

    def seldom_hard(self, scene: Scene) -> bool:
        return len(scene.owners()) == 1 and not scene.surfaces[0].is_solid()

    def too_fast(self, scene: Scene) -> str:
        return too_fast_failure(scene, self.dt)

    def span(self, name: str, duration: float) -> float:
        return whole_steps(name, duration, self.dt)

    def law(self) -> Any:
        return regularisation(self.penalty, self.exponent)


def check_numbers(method: Any) -> None:
    """Check and convert dt, penalty and exponent of a description."""
    object.__setattr__(method, "dt", checks.positive("dt", method.dt))
    object.__setattr__(method, "penalty", checks.positive("penalty", method.penalty))
    object.__setattr__(method, "exponent", checks.at_least("exponent", method.exponent, 1.0))


def check_arguments(method: Any) -> None:
    """The same, and check its gradient."""
    check_numbers(method)
    checks.one_of("gradient", method.gradient, GRADIENTS)
    if method.gradient == "mean-value" and method.exponent == 1.0:
        raise SceneError(
            'gradient must be "composite" for exponent = 1, got "mean-value": that form is the gradient of Phi at a '
            "point of the step, and for exponent = 1 this gradient jumps at the surface, so no such point need exist"
        )


def check_solids(scene: Scene, particles: Particles, dt: float) -> None:
    """Raise a `SceneError` where the fastest particle can jump over a solid in one step."""
    step, longest = particles.fastest() * dt, longest_step(scene)
    if longest is not None and step > longest:
        raise SceneError(
            f"dt must be so small that no particle jumps over a solid in one step, got dt = {dt:g} s, in which the "
            f"fastest flies {step:.3g} m, and {_thinnest(scene)}; use dt < {longest / particles.fastest():.2g} s, or "
            "Impact"
        )


def longest_step(scene: Scene) -> float | None:
    """The thickness of the thinnest solid [m], which no step may be longer than; None where there is no solid."""
    solids = [2.0 * surface.size() for surface in scene.surfaces if surface.is_solid()]
    return min(solids, default=None)


def _thinnest(scene: Scene) -> str:
    solids = [(2.0 * surface.size(), i) for i, surface in enumerate(scene.surfaces) if surface.is_solid()]
    thickness, i = min(solids)
    return f"surfaces[{i}] ({type(scene.surfaces[i]).__name__}), {thickness:.3g} m thick"


def too_fast_failure(scene: Scene, dt: float) -> str:
    """The end of the sentence about a step that was longer than a solid is thick."""
    return f"with dt = {dt:g} s and {_thinnest(scene)}; use a smaller dt, or Impact"


def whole_steps(name: str, duration: float, dt: float) -> float:
    """How many steps a duration is; a `SceneError` that calls it `name` where they are not whole."""
    if duration / dt > _MOST_STEPS:
        raise SceneError(
            f"{name} must be at most {_MOST_STEPS:g} steps, got {name} = {duration:g} s with dt = {dt:g} s"
        )
    steps = round(duration / dt)
    if abs(duration / dt - steps) > _WHOLE:
        raise SceneError(
            f"{name} must be a whole number of steps, got {name} = {duration:g} s with dt = {dt:g} s, which is "
            f"{duration / dt:.6g} steps"
        )
    return float(steps)


def of_steps(scene: Scene) -> tuple[Any, ...]:
    """What whole steps ask of every wall."""
    asked: tuple[Any, ...] = flights.of_steps(scene.gravity is not None)
    return asked


@by_type
def too_fast(longest, px, py, pz):
    """Whether a step with free displacement p could jump over a solid. Only its ends are looked at."""
    return False


@too_fast.register(float)
def _(longest, px, py, pz):
    return px * px + py * py + pz * pz > longest * longest


@inlined
def free_steps(chain, gravity, dt, x, y, z, vx, vy, vz, left):
    """Jump over the steps that surely stay free: (x, y, z, vx, vy, vz, steps left)."""
    # One too many by round-off starts a contact 1e-16 deep: harmless.
    steps = np.floor(flights.free_time(gravity, chain, x, y, z, vx, vy, vz) * (1.0 / dt))
    steps = select(steps < left, steps, left)
    t = steps * dt
    dx, dy, dz = displacement(gravity, vx, vy, vz, t)
    vx, vy, vz = accelerated(gravity, vx, vy, vz, t)
    return x + dx, y + dy, z + dz, vx, vy, vz, left - steps


@inlined
def taken(step, x, y, z, vx, vy, vz, left, x1, y1, z1, wx, wy, wz):
    """Where a lane is after its step, if it takes one: (x, y, z, vx, vy, vz, steps left)."""
    return (
        select(step, x1, kept(x)),
        select(step, y1, kept(y)),
        select(step, z1, kept(z)),
        select(step, wx, kept(vx)),
        select(step, wy, kept(vy)),
        select(step, wz, kept(vz)),
        left - select(step, 1.0, 0.0),
    )
