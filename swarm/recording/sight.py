"""Where the eye of Rerun's viewer is: it sees the whole scene, from where pictures see it."""

import math
from typing import Any

import numpy as np
import rerun.blueprint as rrb

from ..pictures.eye import Eye, eye_for
from ..state import Floats
from ..surfaces.plane import PLANES, along
from ..triangles.shape import Shape

# The viewer's angle of view from bottom to top, and the width of the narrowest panel as a part of its height.
ANGLE, NARROWEST = math.radians(55.0), 0.8
# The part of the panel that the scene fills.
_FILLED = 0.97


def eye_controls(plane: str | None, shapes: list[Shape], points: Floats, center: Floats) -> Any:
    """The eye that sees all walls and the points (n, 3); None where these are at one place.

    It is given with the origin of the recording, `center`. That of a scene of two dimensions is above its plane.
    """
    curves = [curve for shape in shapes for curve in (*shape.wires, shape.vertices) if len(curve)]
    every = np.concatenate([points[~np.isnan(points[:, 0])], *curves])
    if not len(every) or not np.ptp(every, axis=0).any():
        return None
    low, high = every.min(axis=0) - center, every.max(axis=0) - center
    eye, middle = _eye(plane, low, high), 0.5 * (low + high)
    place = middle + distance(eye, high - low) * eye.near
    # About which the scene is turned by hand.
    up = eye.up if plane else np.array([0.0, 0.0, 1.0])
    return rrb.EyeControls3D(position=place, look_target=middle, eye_up=up)


def _eye(plane: str | None, low: Floats, high: Floats) -> Eye:
    across = PLANES.get(plane)
    if across is None:
        return eye_for(low, high)
    right, up = (np.eye(3)[axis] for axis in along(across))
    return Eye(right, up, np.cross(right, up))


def distance(eye: Eye, size: Floats) -> float:
    """The distance from the middle of a box from which all of its corners are seen.

    A corner that is x to the right, y up and z nearer than the middle is seen from D where |x| and |y| are at most
    (D - z) times the tangents of half the angles of view.
    """
    signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
    x, y, z = eye.seen(signs * size).T
    upright = _FILLED * math.tan(0.5 * ANGLE)
    return float((z + np.maximum(np.abs(x) / NARROWEST, np.abs(y)) / upright).max())
