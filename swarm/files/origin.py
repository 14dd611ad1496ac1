"""The origin of files with float32 numbers: with seven digits, particles far from 0 would coincide."""

import numpy as np

from ..errors import SceneError
from ..particles import Particles
from ..scene import Scene
from ..state import Floats

# The largest distance of a scene from 0, in widths of it: float32 rounds positions to 4e-6 of the width there.
_FAR = 64.0


def origin_of(scene: Scene, start: Particles) -> Floats:
    """The centre (3,) of a scene [m], or 0 if it is at most a few dozen widths of the scene from 0.

    In a direction in which the scene is open, the centre of the particles at the start is used.
    """
    low, high = (np.array(corner) for corner in scene.bounds())
    there = start.position[:, ~np.isnan(start.position[0])]
    if not there.size:
        there = np.zeros((3, 1))
    first, last = there.min(axis=1), there.max(axis=1)
    bounded = np.isfinite(low) & np.isfinite(high)
    low, high = np.where(bounded, low, first), np.where(bounded, high, last)
    width = float((high - low).max()) or scene.finite_size()
    center = 0.5 * (low + high)
    return center if np.abs(center).max() > _FAR * width else np.zeros(3)


def require_near(scene: Scene, start: Particles) -> None:
    """Raise a `SceneError` if positions in float32 would be too coarse: a trajectory has no origin of its own."""
    center = origin_of(scene, start)
    if center.any():
        off = float(np.spacing(np.float32(np.abs(center).max())))
        raise SceneError(
            f'precision must be "float64" where the scene is far from the origin, got "float32", in which positions '
            f"around {tuple(center.tolist())} are rounded to {off:.2g} m; leave it out, or move the scene to the origin"
        )
