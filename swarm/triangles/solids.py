"""Fields of many solids by a few numbers for each, without triangles: places, sizes and directions.

For viewers that draw a million of them from one mesh: Rerun (instanced.py) and ParaView (walls.py).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..motion import Pose
from ..scene import Scene
from ..state import Floats
from ..surfaces.rotation import after, matrices, normalized, onto
from ..surfaces.surface import Surface

# A field of more solids than this is shown in this way.
MANY = 2_000
_CIRCLE = 25
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])


class Solids(NamedTuple):
    """The solids of a field.

    Attributes:
        surface: its number in the scene.
        kind: "spheres", "boxes", "cylinders", "capsules" or "ellipsoids".
        centers: (n, 3) [m].
        halves: (n, 3) half of the extent along the axes of each, for capsules with their caps [m].
        turns: (n, 4) quaternions (w, x, y, z) of these axes.
    """

    surface: int
    kind: str
    centers: Floats
    halves: Floats
    turns: Floats


def solids_of(scene: Scene, time: float) -> list[Solids]:
    """Return the fields of many solids of a scene that are present at a time [s], at their places then."""
    each = enumerate(zip(scene.surfaces, scene.poses(time), strict=True))
    return [_placed(i, surface, at) for i, (surface, at) in each if is_many(surface) and surface.is_there(time)]


def is_many(surface: Surface) -> bool:
    """Whether a surface is a field of more than `MANY` solids, each of which is shown by a few numbers."""
    return surface.body_count() > MANY and surface.halves() is not None


def _placed(i: int, surface: Any, at: Pose) -> Solids:
    """Return the solids of surface i, in its pose."""
    n, still = len(surface), np.array([1.0, 0.0, 0.0, 0.0])
    turns: Any = np.broadcast_to(still, (n, 4))
    if getattr(surface, "rotations", None) is not None:
        turns = normalized(surface.rotations, 1)
    elif hasattr(surface, "axes"):
        axes, which = np.unique(normalized(surface.axes, 1), axis=0, return_inverse=True)
        turns = np.array([onto(tuple(axis)) or still for axis in axes.tolist()])[which.ravel()]
    if not np.array_equal(at.turn, np.eye(3)):
        several, which = np.unique(turns, axis=0, return_inverse=True)
        turns = np.array([after(at.quaternion, tuple(turn)) or still for turn in several.tolist()])[which.ravel()]
    kind = type(surface).__name__.lower()
    return Solids(i, kind, at.placed(surface.centers.T).T, surface.halves(), np.asarray(turns))


def curves(solids: Solids, most: int = MANY) -> list[Floats]:
    """Curves (k, 3) of at most `most` solids, evenly chosen: three ellipses; for boxes and cylinders outlines."""
    some = slice(None, None, math.ceil(len(solids.centers) / most))
    angle = np.linspace(0.0, 2.0 * math.pi, _CIRCLE)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    of_one = []
    for k in range(3):
        flat = _CORNERS if solids.kind == "boxes" or (solids.kind == "cylinders" and k < 2) else circle
        of_one.append(np.insert(flat, k, 0.0, axis=1))
    turns = matrices(solids.turns[some])
    placed = [
        solids.centers[some, None] + np.einsum("nij,nkj->nki", turns, solids.halves[some, None] * one)
        for one in of_one
    ]  # fmt: skip
    return [curve for one in zip(*placed, strict=True) for curve in one]
