"""Checks of particles with a radius before a run starts."""

from ..errors import SceneError
from ..methods import Impact, Penalty
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from .instants import require_instants_of_balls
from .options import RunOptions


def require_balls(scene: Scene, particles: Particles, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` where particles with a radius do not go with the scene, the method or the options."""
    if particles.radius is None:
        if not scene.surfaces:
            raise SceneError(
                "surfaces must hold at least one surface for particles without a radius, which meet nothing else, got "
                "none; give the walls, or give the particles a radius"
            )
        if scene.pairs is not None:
            raise SceneError(
                "pairs must be None where particles have no radius, points do not meet one another, got "
                f"{scene.pairs}; give the particles a radius, or leave pairs out"
            )
        return
    if not isinstance(method, (Impact, Penalty)):
        raise SceneError(
            f"radius of the particles must be None with {type(method).__name__}, got radii; Impact and Penalty know "
            "particles that meet"
        )
    require_instants_of_balls(scene, particles, method, options)
