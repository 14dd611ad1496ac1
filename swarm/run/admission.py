"""Checks before a run starts."""

import numpy as np

from ..errors import SceneError
from ..methods.base import Method, check_surfaces
from ..particles import Particles
from ..scene import Scene
from ..surfaces.formulas.own import require_compiled
from . import workload
from .options import RunOptions, Task

# A particle this many times round-off of the scene's size outside a rigid wall still counts as on it at the start.
_ON_THE_WALL = 64.0 * np.finfo(np.float64).eps


def task_of(scene: Scene, particles: Particles, method: Method, options: RunOptions) -> Task:
    """The run, checked, with its own copy of the particles.

    Raises:
        SceneError: an argument is wrong, or the arguments do not go together.
    """
    for name, value, kind in (("scene", scene, Scene), ("particles", particles, Particles), ("method", method, Method)):
        if not isinstance(value, kind):
            raise SceneError(f"{name} must be a swarm.{kind.__name__}, got {type(value).__name__}")
    # The arrays of Particles may have been changed since it checked them.
    particles = particles.copy()
    check_surfaces(method, scene)
    if options.compile != "never":
        require_compiled(scene.surfaces)
    method.check(scene, particles)
    times = options.times
    assert times.every is not None
    method.span("until", times.until)
    method.span("every", times.every)
    _require_inside(scene, particles)
    workload.check(scene, particles, method, times.until, times.every)
    return Task(scene, particles, method, options)


def _require_inside(scene: Scene, particles: Particles) -> None:
    outside = scene.outside(particles.position, _ON_THE_WALL * _magnitude(scene, particles))
    if outside.size:
        first = int(outside[0])
        point = particles.position[:, first : first + 1]
        distances = scene.distances_outside(point)[:, 0]
        wall = int(np.argmax(np.where(np.isnan(distances), np.inf, distances)))
        phi = float(scene.surfaces[wall].phi(point)[0])
        raise SceneError(
            f"particles must start inside their walls, got {outside.size} of {len(particles)} outside; the first "
            f"is particle {first} at {tuple(point[:, 0].tolist())}, where phi = {phi:.6g} of surfaces[{wall}] "
            f"({type(scene.surfaces[wall]).__name__})"
        )


def _magnitude(scene: Scene, particles: Particles) -> float:
    """Magnitude that sets the round-off of a position on a wall."""
    return max(float(particles.position.max()), -float(particles.position.min()), scene.finite_size())
