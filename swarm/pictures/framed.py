"""The frame of a picture: the points that it contains, the eye, and the window in the eye's coordinates."""

import numpy as np
from numpy.typing import NDArray

from ..state import Floats
from ..triangles.shape import Shape
from .eye import Eye, eye_for

# Points farther than `_FAR` times the distance within which the part `_MOSTLY` of them lies do not widen the picture.
_FAR, _MOSTLY = 3.0, 0.95
# Of more points than this only every k-th is used.
_ENOUGH = 100_000
# Directions in which extreme points are searched.
_DIRECTIONS = np.random.default_rng(1).normal(size=(64, 3))


def around(points: Floats, shapes: list[Shape], radius: Floats | None = None) -> list[Floats]:
    """The points of walls; if no wall encloses a volume, also the particles (N, 3), or balls of a `radius`."""
    found = [part for shape in shapes for part in (shape.vertices, *shape.edges) if len(part)]
    there = points[~np.isnan(points[:, 0])]
    if is_open(shapes):
        wide = 0.0 if radius is None else radius[~np.isnan(points[:, 0])][:, None]
        near = _are_near(there)
        found += [(there - wide)[near], (there + wide)[near]]
    found = [part for part in found if len(part)]
    return found or [np.zeros((1, 3))]


def is_open(shapes: list[Shape]) -> bool:
    """Whether all walls are solids, which do not enclose particles."""
    return not any(len(shape.vertices) and not shape.solid for shape in shapes)


def ends(found: list[Floats]) -> list[Floats]:
    """The extreme points in every direction of `_DIRECTIONS`; the other points are between them."""
    turned = np.concatenate([one[:: 1 + len(one) // _ENOUGH] for one in found])
    chosen = turned @ _DIRECTIONS.T
    return [turned[np.unique(np.concatenate([chosen.argmin(axis=0), chosen.argmax(axis=0)]))]]


def near_most(points: Floats) -> Floats:
    """The points, among these (N, 3), that are near to most of the others."""
    return np.asarray(points[_are_near(points)])


def most_of(positions: Floats) -> Floats:
    """The positions, among these (3, N), that are not NaN and near to most of the others."""
    return near_most(positions[:, ~np.isnan(positions[0])].T).T


def _are_near(points: Floats) -> NDArray[np.bool_]:
    """A mask (N,) of the points that are near to most of the others."""
    if not len(points):
        return np.empty(0, bool)
    far = np.sqrt(((points - np.median(points, axis=0)) ** 2).sum(axis=1))
    return np.asarray(far <= _FAR * np.quantile(far, _MOSTLY))


def box_of_points(found: list[Floats]) -> tuple[Floats, Floats]:
    """The corners of the box around points."""
    return np.min([one.min(axis=0) for one in found], axis=0), np.max([one.max(axis=0) for one in found], axis=0)


def eye_of(shapes: list[Shape], found: list[Floats]) -> Eye:
    """The eye of a picture of points: from below if from above all walls are seen from behind."""
    eye = eye_for(*box_of_points(found))
    if any((shape.normals @ eye.near > 0.0).any() for shape in shapes) or not any(len(s.normals) for s in shapes):
        return eye
    return eye_for(*box_of_points(found), below=True)


def window(eye: Eye, found: list[Floats]) -> tuple[Floats, Floats]:
    """The corners of points in the coordinates of an eye, with room in directions without extent."""
    seen = [eye.seen(one)[:, :2] for one in found]
    low, high = box_of_points(seen)
    wide = float((high - low).max())
    room = np.where(high - low < 0.05 * wide, 0.05 * wide, 0.0) if wide > 0.0 else 0.5 * (float(np.abs(low).max()) or 1)
    return low - room, high + room
