"""A run in words, for the titles of pictures and for reports."""

from ..scene import Scene
from .facts import call


def of_scene(scene: Scene) -> str:
    """What a scene is, as "an ellipsoid with a sphere in it, under gravity"."""
    return ", ".join(call(surface) for surface in scene.surfaces)
