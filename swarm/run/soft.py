"""What soft balls do not know: checks before a run starts."""

import logging

import numpy as np

from ..errors import SceneError
from ..grains.described import MOST_DAMPED, contact_time
from ..methods import Penalty
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from ..surfaces.facets.mesh import Mesh

_LOG = logging.getLogger("swarm")
# Steps in the shortest contact: with fewer than the first there is a warning, which proposes the second.
_FEWEST, _GOOD = 6.0, 20.0


def require_soft_balls(scene: Scene, particles: Particles, method: Method) -> None:
    """Raise a `SceneError` where soft balls do not go with the scene or the method."""
    if not isinstance(method, Penalty):
        return
    _require_laws(scene)
    _require_steps(particles, method)
    _warn_of_steps(scene, particles, method)


def _require_laws(scene: Scene) -> None:
    """Raise a `SceneError` for what contacts of soft balls do not know."""
    if scene.reacts():
        raise SceneError(
            "surfaces must have no mass and no inertia with particles that have a radius and Penalty, got a scene in "
            "which impacts move one; give it a motion instead"
        )
    laws = scene.laws()
    if laws is not None and laws.send_off:
        raise SceneError(
            "surfaces must have no temperature and no laws of their own with Penalty, got a scene with them; use "
            "restitution and friction, or Impact"
        )
    if scene.has_doors() or scene.openings() is not None:
        raise SceneError(
            "surfaces must have no openings and always be present with particles that have a radius and Penalty, got a "
            "scene with them; build the wall of parts that leave the opening, such as solid boxes"
        )
    for i in scene.order.fields if scene.moves() else ():
        raise SceneError(
            f"surfaces must not move beside a field or a mesh with particles that have a radius and Penalty, got "
            f"surfaces[{scene.owners_of_pieces[i]}] ({type(scene.pieces[i]).__name__}) in a scene with a motion; use "
            "Impact, or build it of single surfaces"
        )
    for i, surface in enumerate(scene.surfaces):
        if isinstance(surface, Mesh) and surface.groups is not None:
            raise SceneError(
                f"surfaces[{i}].groups must be None with particles that have a radius and Penalty, got laws of "
                f"{', '.join(surface.groups)}; give all of the mesh one law, make two of it, or use Impact"
            )
    named = [(f"surfaces[{i}]", surface.restitution) for i, surface in enumerate(scene.surfaces)]
    for name, value in (*named, *(() if scene.pairs is None else [("pairs", scene.pairs.restitution)])):
        if value < MOST_DAMPED:
            raise SceneError(
                f"{name}.restitution must be {MOST_DAMPED:g} or more with Penalty, whose dampers grow as it "
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
