"""What balls that meet at instants do not know yet: checks before a run starts."""

from ..errors import SceneError
from ..methods import Impact
from ..methods.base import Method
from ..particles import Particles
from ..scene import Scene
from ..surfaces.laws.sticky import Sticky
from .options import RunOptions


def require_instants_of_balls(scene: Scene, particles: Particles, method: Method, options: RunOptions) -> None:
    """Raise a `SceneError` where balls that meet at instants do not go with the scene or the options."""
    if not isinstance(method, Impact):
        return
    _require_plain(scene)
    if method.contact_step > 0.0:
        raise SceneError(
            f"contact_step must be 0 with particles that have a radius, got {method.contact_step:g}; leave it out"
        )
    if scene.pairs is not None and scene.pairs.friction > 0.0:
        raise SceneError(
            f"pairs.friction must be 0 with Impact, whose particles do not turn, got {scene.pairs.friction:g}; use "
            "Penalty, or leave it out"
        )
    for k, length in enumerate(scene.period or ()):
        largest = 2.0 * float(particles.radius.max())  # type: ignore[union-attr]
        if length is not None and length < 2.0 * largest:
            raise SceneError(
                f"period[{k}] must be two diameters of the largest particle or more, {2.0 * largest:g} m, got "
                f"{length:g}; give a longer period, or smaller particles"
            )


def _require_plain(scene: Scene) -> None:
    """Raise a `SceneError` for what balls that meet at instants do not know."""
    for i, surface in enumerate(scene.surfaces):
        for k, law in enumerate(surface.laws):
            if isinstance(law, Sticky):
                raise SceneError(
                    f"surfaces[{i}].laws[{k}] must let particles that have a radius leave at once with Impact, got "
                    f"{law!r:.200}; leave it or the radius out"
                )
