"""The description of a method for users, checked. The form for kernels is in contract.py."""

import math
import warnings
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from ..common.validated import Validated, choice
from ..errors import SceneError
from ..kernel.jit import select
from ..particles import Particles
from ..scene import Scene
from ..surfaces import required
from ..surfaces.in_motion.moving import lacks_bend
from ..surfaces.surface import named

# Marks an argument that older files do not have: tables omit it at its default, so that these files stay the same.
YOUNGER = {"younger": True}
# Where a contact step begins: at the impact, or half of the step before it.
ContactStart = Annotated[str, choice("impact", "centred")]
# Default shortest flight as a fraction of the crossing time size/|v|.
SHORTEST = 1e-4


@dataclass(frozen=True)
class Method(Validated):
    """A way to advance particles. See the subclasses."""

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        earlier = vars(cls).get("knows_period")
        if earlier is not None:
            warnings.warn(f"{cls.__name__}.knows_period is now supports_period", DeprecationWarning, stacklevel=2)
            cls.supports_period = earlier  # type: ignore[method-assign]

    def check(self, scene: Scene, particles: Particles) -> None:
        """Raise a `SceneError` if this method cannot run this scene with these particles."""

    def needs(self, scene: Scene) -> tuple[Any, ...]:
        """The functions of surfaces/contract.py that its kernels call for every wall."""
        return ()

    def numbers(self, scene: Scene) -> Any:
        """Return the record of numbers that kernels take in place of this description."""
        raise NotImplementedError

    def apart(self) -> str | None:
        """The `apart` of `CompiledScene`: a name if the method does not take listed solids as a field, else None."""
        return type(self).__name__

    def time_of_impact(self) -> float | None:
        """The duration of an impact besides the flight to it [s]; None if the cost of a frame is steps, not impacts."""
        return None

    def span(self, name: str, duration: float) -> float:
        """Return `duration` [s] in the unit in which the kernel counts a frame down; `name` is for errors."""
        return duration

    def birth_times(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the times [s] at which the method starts particles that sources give at `times` [s]."""
        return times

    def parts(self, durations: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return durations from a birth to the end of a frame [s] in the unit in which the kernel counts it down."""
        return durations

    def instant(self, moment: float) -> float:
        """Return the time of the method when a frame ends at `moment` [s], for the places of moving walls."""
        return moment

    def is_rigid(self) -> bool:
        """Whether a particle outside its walls by more than round-off is an error rather than wall compliance."""
        return False

    def supports_period(self) -> bool:
        """Whether its flights end where a particle leaves a periodic cell, and its contacts do not move particles."""
        return False

    def has_multipliers(self) -> bool:
        """Whether contacts run Uzawa's loop; its sweeps are then counted."""
        return False

    def is_explicit(self) -> bool:
        """Whether its steps gain energy without bound if they are too long for a linear spring."""
        return False

    def may_slide(self) -> bool:
        """Whether a particle may stay on its walls: the kernels of sliding are then compiled at the first one."""
        return False

    def seldom_hard(self, scene: Scene) -> bool:
        """Whether most runs have no contact for `hard_pass`: its kernel is then compiled at the first such contact."""
        return False

    def failure(self, moment: float, remaining: float, sweeps: int, stored: float, mass: float) -> str:
        """Return the end of the message about a loop that did not converge in the frame that ends at `moment`."""
        raise NotImplementedError

    def too_fast(self, scene: Scene) -> str:
        """Return the end of the message about a step that could jump over a solid."""
        raise NotImplementedError

    def law(self) -> Any:
        """The regularisation with the stored energy that counts as contact energy, or None for rigid walls."""
        return None


def check_surfaces(method: Method, scene: Scene) -> None:
    """Raise a `SceneError` if a surface lacks a function that the method, or an observable, needs."""
    purpose = type(method).__name__ + (" without gravity" if scene.gravity is None else " under gravity")
    # `escaped` needs the ends of flights without gravity.
    seen = ("first_hit",) if scene.is_open() and scene.gravity is None else ()
    required.require(scene.surfaces, purpose, (*method.needs(scene), "distance", *seen))


def check_bends(scene: Scene) -> None:
    """Raise a `SceneError` if a surface with a motion that needs safe steps does not bound its bend."""
    for i, surface in scene.pieces.owned():
        if lacks_bend(surface):
            raise SceneError(
                f"{named(i, surface)} must give hessian_bounds() to move as {surface.motion} "
                "does: hits of such walls are found by safe steps; give it, or use a Translation alone"
            )


def check_crossing(name: str, step: float | None, scene: Scene, particles: Particles) -> None:
    """Raise a `SceneError` if the fastest particle crosses the scene in less than the contact step `step`."""
    if not step:
        return  # no step: the speeds do not matter
    fastest = particles.fastest()
    crossing = scene.size() / fastest if fastest > 0.0 else math.inf
    if step > crossing:
        raise SceneError(
            f"{name} must be at most the crossing time size/|v| of the fastest particle, {crossing:.3g} s, got {step:g}"
        )


def centred_half(longest, lane):
    """Return half the length of a contact step of at most `longest`, with its middle at the end of a lane's flight.

    It begins at the earliest with this flight, which starts with the frame or after the last contact, and ends within
    the frame.
    """
    half = select(0.5 * longest < lane.flown, 0.5 * longest, lane.flown)
    return select(half < lane.remaining, half, lane.remaining)
