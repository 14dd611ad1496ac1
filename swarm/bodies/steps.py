"""Steps of bodies, checked before a run starts."""

import numpy as np

from ..methods import Penalty
from ..methods.base import Method
from ..methods.fixed_step import check_solids
from ..particles import Particles
from ..run.options import RunOptions
from ..scene import Scene
from .state import Bodies


def require_steps_of_bodies(scene: Scene, bodies: Bodies, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` where a step of soft bodies does not fit the scene or the frames."""
    if not isinstance(method, Penalty):
        return
    if len(bodies.body.contacts):
        velocity = np.tensordot(bodies.body.contacts, bodies.velocity, axes=(1, 1)).transpose(1, 0, 2)
        touching = Particles(bodies.contact_points().reshape(3, -1), velocity.reshape(3, -1))
        check_solids(scene, touching, method.dt)
    method.span("until", options.times.until)
    assert options.times.every is not None
    method.span("every", options.times.every)
