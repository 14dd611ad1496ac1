"""The walls that `Impact` does not know, with what can be given instead."""

from ..errors import SceneError
from ..scene import Scene
from ..surfaces.wall_law import lets_wait


def require_no_waiting(scene: Scene) -> None:
    """Raise a `SceneError` where a law lets particles wait on its wall, and walls move."""
    for i, surface in zip(scene.owners_of_pieces, scene.pieces, strict=True) if scene.moves() else ():
        for k, law in enumerate(surface.laws):
            if not isinstance(law, str) and lets_wait(law):
                raise SceneError(
                    f"surfaces[{i}].laws[{k}] must let nobody wait where walls move, which would carry who waits "
                    f"along, got {law}; leave it out, or the motions"
                )


def require_reacting(scene: Scene) -> None:
    """Raise a `SceneError` where a law of a wall is none for scenes in which impacts move walls."""
    for i, surface in zip(scene.owners_of_pieces, scene.pieces, strict=True):
        if surface.temperature is not None:
            raise SceneError(
                f"surfaces[{i}].temperature must be None where a wall has a mass, got {surface.temperature:g}; heat "
                "the particles at the start, or give the wall a motion instead of a mass"
            )
        if surface.laws:
            raise SceneError(
                f"surfaces[{i}].laws must be left out where a wall has a mass, got {surface.laws}; give that wall a "
                "motion instead of a mass"
            )
        if surface.openings:
            raise SceneError(
                f"surfaces[{i}].openings must be left out where a wall has a mass, got {len(surface.openings)}; give "
                "that wall a motion instead of a mass"
            )
        if surface.present is not None:
            raise SceneError(
                f"surfaces[{i}].present must be None where a wall has a mass, got {surface.present}; give that wall a "
                "motion instead of a mass"
            )
        if surface.friction > 0.0 and surface.reacts():
            raise SceneError(
                f"surfaces[{i}].friction must be 0 of a wall with a mass, which is pushed along its normals, got "
                f"{surface.friction:g}"
            )
        if surface.restitution < 1.0 and scene.gravity is not None:
            raise SceneError(
                f"surfaces[{i}].restitution must be 1 under gravity where a wall has a mass, got "
                f"{surface.restitution:g}: particles would come to rest on walls that move with them; leave gravity "
                "out, or give the wall a motion instead of a mass"
            )
