"""Runs of bodies, checked before they start."""

import logging

import numpy as np

from ..files.origin import require_near
from ..methods import Impact, Penalty
from ..methods.base import Method, check_surfaces
from ..methods.fixed_step import check_solids
from ..motion.given import require_angles
from ..particles import Particles
from ..run.options import RunOptions, Task
from ..run.preflight.starts import require_inside
from ..scene import Scene
from . import passing
from .copies import Bodies

_LOG = logging.getLogger("swarm")
# A body that turns farther in a step [rad], and how far it may.
_FAR_TURN, _GOOD_TURN = 1.0, 0.3


def task_of(scene: Scene, bodies: Bodies, method: Method, options: RunOptions) -> Task:
    """The run of bodies, checked, with its own copy of them.

    Raises:
        SceneError: the arguments do not go together.
    """
    if not isinstance(method, Impact):
        scene = scene.ungrouped("bodies and soft walls")
    bodies = bodies.copy()
    _require_steps(scene, bodies, method, options)
    for point, motion in bodies.body.anchors.items():
        require_angles(f"anchors[{point}]", motion, options.times.until)
    assert method.dt is not None  # type: ignore[attr-defined]
    passing.warn(scene, bodies.body)
    _warn_of_turns(bodies, method.dt)  # type: ignore[attr-defined]
    check_surfaces(method, scene)
    if options.compile != "never":
        for surface in scene.surfaces:
            surface.require_compiled()
    if len(bodies.body.contacts):
        touching = bodies.contact_points().reshape(3, -1)
        require_inside(scene, Particles(touching, touching))
    points = bodies.particles()
    if options.keeps_float32():
        require_near(scene, points)
    return Task(scene, points, method, options, bodies)


def _require_steps(scene: Scene, bodies: Bodies, method: Method, options: RunOptions) -> None:
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


def _warn_of_turns(bodies: Bodies, dt: float) -> None:
    """Warn where a tie of a body turns so far in a step that the step is cut, or says little."""
    ends, r, v = bodies.body.links, bodies.position, bodies.velocity
    if not len(ends):
        return
    length2 = ((r[:, ends[:, 0]] - r[:, ends[:, 1]]) ** 2).sum(axis=0)
    speed2 = ((v[:, ends[:, 0]] - v[:, ends[:, 1]]) ** 2).sum(axis=0)
    turns = dt * np.sqrt(speed2 / length2)  # (L, n)
    link, copy = np.unravel_index(int(np.argmax(turns)), turns.shape)
    if turns[link, copy] > _FAR_TURN:
        _LOG.warning(
            "body %d turns by %.2g rad in a step of %g s (links[%d]): its steps will be cut, which is slow, or say "
            "little of its motion; use dt = %.1g s or less",
            copy, turns[link, copy], dt, link, _GOOD_TURN * dt / turns[link, copy],
        )  # fmt: skip
