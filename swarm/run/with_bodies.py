"""Walls and methods that do not go with bodies."""

import numpy as np

from ..bodies.state import Bodies
from ..errors import SceneError
from ..methods import AugmentedLagrangian, Impact, Penalty
from ..methods.base import Method, check_laws
from ..methods.fixed_step import check_solids
from ..particles import Particles
from ..scene import Scene
from ..surfaces.facets.mesh import Mesh
from ..surfaces.outlines.outlined import Outlined
from .options import RunOptions


def require_walls_of_bodies(scene: Scene) -> None:
    """Raise a `SceneError` where a wall is none for bodies."""
    for i, surface in zip(scene.owners_of_pieces, scene.pieces, strict=True):
        if surface.temperature is not None:
            raise SceneError(f"surfaces[{i}].temperature must be None with bodies, got {surface.temperature:g}")
        if surface.laws:
            raise SceneError(f"surfaces[{i}].laws must be left out with bodies, got {surface.laws}")
        if surface.motion is not None:
            raise SceneError(
                f"surfaces[{i}].motion must be None with bodies, got {surface.motion}; lead a point of the body, by "
                "anchors, in the frame of the wall"
            )
        if surface.openings:
            raise SceneError(
                f"surfaces[{i}].openings must be left out with bodies, which escape through none, got "
                f"{len(surface.openings)}; use particles, or a box with an open face"
            )
        if surface.present is not None:
            raise SceneError(
                f"surfaces[{i}].present must be None with bodies, which a wall that comes would cut, got "
                f"{surface.present}; use particles, or leave it out"
            )
        if isinstance(surface, (Mesh, Outlined)):
            raise SceneError(
                f"surfaces[{i}] must not be {type(surface).__name__} with bodies, got {surface!r:.200}; use particles, "
                "or from_mesh with a spacing for a vessel of bodies"
            )
        if surface.reacts():
            raise SceneError(
                f"surfaces[{i}] must have no mass and no inertia with bodies, got {surface}; make it a body, whose "
                "cavities= are walls that it carries"
            )


def require_method_of_bodies(scene: Scene, bodies: Bodies, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` where a method, or an argument of it, is none for bodies."""
    if not isinstance(method, (Impact, Penalty, AugmentedLagrangian)) or method.dt is None:
        raise SceneError(
            f"bodies need the method Impact with a step, Penalty or AugmentedLagrangian, got {method}; give "
            "Impact(dt=...) [s]"
        )
    if isinstance(method, Impact):
        if method.contact_step > 0.0:
            raise SceneError(f"contact_step must be 0 with bodies, whose blows are exact, got {method.contact_step:g}")
        return
    _require_of_soft(scene, bodies, method)
    if isinstance(method, Penalty):
        if len(bodies.body.contacts):
            velocity = np.tensordot(bodies.body.contacts, bodies.velocity, axes=(1, 1)).transpose(1, 0, 2)
            touching = Particles(bodies.contact_points().reshape(3, -1), velocity.reshape(3, -1))
            check_solids(scene, touching, method.dt)
        method.span("until", options.times.until)
        assert options.times.every is not None
        method.span("every", options.times.every)


def _require_of_soft(scene: Scene, bodies: Bodies, method: Penalty | AugmentedLagrangian) -> None:
    """Raise a `SceneError` where an argument of the method, or a wall, is none for bodies."""
    name = type(method).__name__
    for argument, value in (("gradient", "composite"), ("acceleration", "none"), ("contact_start", "impact")):
        given = getattr(method, argument, value)
        if given != value:
            raise SceneError(f'{argument} of {name} must be "{value}" with bodies, got "{given}"')
    if isinstance(method, AugmentedLagrangian) and method.exponent != 1.0:
        raise SceneError(
            f"exponent of AugmentedLagrangian must be 1 with bodies, got {method.exponent:g}: its loop has no limit "
            "for others; such walls are for Penalty"
        )
    if isinstance(method, AugmentedLagrangian) and not method.adaptive:
        raise SceneError(
            "adaptive of AugmentedLagrangian must be True with bodies, got False: a loop that does not start from the "
            "wall has no limit, and its multiplier would tear the links"
        )
    if getattr(method, "on_unconverged", "raise") == "impact":
        raise SceneError('on_unconverged must be "raise" or "count" with bodies, got "impact"; use Impact(dt=...)')
    check_laws(name, scene)
    for k, (surface, _carrier, _point) in enumerate(bodies.body.cavities):
        if surface.restitution != 1.0 or surface.friction != 0.0:
            raise SceneError(f"cavities[{k}] must be elastic with {name}, got {surface}; use Impact(dt=...)")
