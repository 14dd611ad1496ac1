"""What a picture shows: the points that it is around, the eye, and the window of what that sees."""

import numpy as np
from numpy.typing import NDArray

from ..state import Floats
from ..triangles.shape import Shape
from .eye import Eye, eye_for

# Points beyond `_FAR` times the distance within which the part `_MOSTLY` of them lies do not widen an open picture.
_FAR, _MOSTLY = 3.0, 0.95
# Of more points than this some are looked at.
_ENOUGH = 100_000
# Directions in which ends of points are looked for.
_DIRECTIONS = np.random.default_rng(1).normal(size=(64, 3))


def around(points: Floats, shapes: list[Shape], radius: Floats | None = None) -> list[Floats]:
    """The points of walls. Where walls do not enclose a volume, also the particles (N, 3), or balls of a `radius`."""
    found = [part for shape in shapes for part in (shape.vertices, *shape.edges) if len(part)]
    there = points[~np.isnan(points[:, 0])]
    if is_open(shapes):
        wide = 0.0 if radius is None else radius[~np.isnan(points[:, 0])][:, None]
        near = _are_near(there)
        found += [(there - wide)[near], (there + wide)[near]]
    found = [part for part in found if len(part)]
    return found or [np.zeros((1, 3))]


def is_open(shapes: list[Shape]) -> bool:
    """Whether only solids are there, which do not enclose particles."""
    return not any(len(shape.vertices) and not shape.solid for shape in shapes)


def ends(found: list[Floats]) -> list[Floats]:
    """Some of these points, between which the others are, in every direction that is looked for."""
    turned = np.concatenate([one[:: 1 + len(one) // _ENOUGH] for one in found])
    chosen = turned @ _DIRECTIONS.T
    return [turned[np.unique(np.concatenate([chosen.argmin(axis=0), chosen.argmax(axis=0)]))]]


def near_most(points: Floats) -> Floats:
    """The points, of these (N, 3), that are near to most of the others."""
    return np.asarray(points[_are_near(points)])


def most_of(positions: Floats) -> Floats:
    """The positions, of these (3, N), that are not NaN and near to most of the others."""
    return near_most(positions[:, ~np.isnan(positions[0])].T).T


def _are_near(points: Floats) -> NDArray[np.bool_]:
    """A mask (N,) of the points that are near to most of the others."""
    if not len(points):
        return np.empty(0, bool)
    far = np.sqrt(((points - np.median(points, axis=0)) ** 2).sum(axis=1))
    return np.asarray(far <= _FAR * np.quantile(far, _MOSTLY))


def box_of_points(found: list[Floats]) -> tuple[Floats, Floats]:
    """The corners of the box around some points."""
    return np.min([one.min(axis=0) for one in found], axis=0), np.max([one.max(axis=0) for one in found], axis=0)


def eye_of(shapes: list[Shape], found: list[Floats]) -> Eye:
    """The eye of a picture of points: from below where all walls are seen from behind from above."""
    eye = eye_for(*box_of_points(found))
    if any((shape.normals @ eye.near > 0.0).any() for shape in shapes) or not any(len(s.normals) for s in shapes):
        return eye
    return eye_for(*box_of_points(found), below=True)


def window(eye: Eye, found: list[Floats]) -> tuple[Floats, Floats]:
    """The corners of what an eye sees of some points, without any room."""
    seen = [eye.seen(one)[:, :2] for one in found]
    low, high = box_of_points(seen)
    wide = float((high - low).max())
    room = np.where(high - low < 0.05 * wide, 0.05 * wide, 0.0) if wide > 0.0 else 0.5 * (float(np.abs(low).max()) or 1)
    return low - room, high + room
