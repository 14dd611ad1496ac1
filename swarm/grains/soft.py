"""Damping and steps of soft balls, checked before a run starts."""

import logging

import numpy as np

from ..errors import SceneError
from ..methods import Penalty
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from .matter import MOST_DAMPED, contact_time

_LOG = logging.getLogger("swarm")
# Steps in the shortest contact: with fewer than the first there is a warning, which proposes the second.
_FEWEST, _GOOD = 6.0, 20.0


def require_soft_balls(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` where dampers or steps of soft balls are out of range."""
    if not isinstance(method, Penalty):
        return
    _require_damping(scene)
    _require_steps(particles, method)
    _warn_of_steps(scene, particles, method)


def _require_damping(scene: Scene) -> None:
    """Raise a `SceneError` for a restitution that a damper cannot give."""
    named = [(f"surfaces[{i}]", one.restitution) for i, whole in enumerate(scene.surfaces) for one in whole.surfaces()]
    for name, value in (*named, *(() if scene.pairs is None else [("pairs", scene.pairs.restitution)])):
        if value < MOST_DAMPED:
            raise SceneError(
                f"{name}.restitution must be {MOST_DAMPED:g} or more with Penalty: its dampers grow as it "
                f"becomes less, got {value:g}"
            )


def _require_steps(particles: Particles, method: Penalty) -> None:
    """Raise a `SceneError` where a step is so long that the fastest ball can jump over another one."""
    radius, velocity = particles.radius, particles.velocity
    assert radius is not None
    if not len(particles):
        return
    fastest = int(np.argmax((velocity**2).sum(axis=0)))
    moves = method.dt * np.sqrt(((velocity - velocity[:, [fastest]]) ** 2).sum(axis=0))
    reach = radius + radius[fastest]
    k = int(np.argmax(moves / reach))
    if moves[k] > reach[k]:
        raise SceneError(
            f"dt must be so small that no particle jumps over another one in a step, got dt = {method.dt:g} s, in "
            f"which particle {k} moves by {moves[k]:.3g} m against particle {fastest}, and their radii are "
            f"{reach[k]:.3g} m in all; use dt < {method.dt * reach[k] / moves[k]:.2g} s, or Impact"
        )


def _warn_of_steps(scene: Scene, particles: Particles, method: Penalty) -> None:
    """Warn where a step is a large part of a contact."""
    shortest = contact_time(scene, particles, method)
    if method.dt * _FEWEST > shortest:
        _LOG.warning(
            "dt = %g s is long for the contacts of these balls: two of the lightest that meet at the speed of the "
            "fastest touch for %.3g s; use dt <= %.2g s, or a softer penalty",
            method.dt, shortest, shortest / _GOOD,
        )  # fmt: skip
