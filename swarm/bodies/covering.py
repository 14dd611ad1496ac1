"""Contact points on the edges and faces of a body, and the distance of its surface from them.

Only contact points touch walls. A solid smaller than the gaps between contact points passes into the body.
"""

import functools
import math

import numpy as np

from ..state import Floats
from . import algebra, room
from .body import Body
from .checked import Pairs

# The parts into which the sides of a triangle are cut at first, and at most, to find its distance from contact points.
# A point between lattice points is farther by at most 1/sqrt(3) of a part. The lattice is fine enough where this is
# `_SHARE` of the distance found.
_FIRST, _LAST, _SHARE = 24, 48, 0.25
# The contact points in one array of distances.
_TOGETHER = 1000
# A point of a triangle is at most this times its longest side from the nearest corner.
_LARGEST = 1.0 / math.sqrt(3.0)


def points(corners: Floats, triangles: Pairs, spacing: float) -> Floats:
    """Return points (Q, 3) on the edges and in the faces, without corners; neighbours are at most `spacing` [m] apart.

    Raises:
        SceneError: the points are too many for a body.
    """
    edges = np.unique(np.sort(triangles[:, ((0, 1), (1, 2), (2, 0))].reshape(-1, 2), axis=1), axis=0)
    lengths = np.sqrt(((corners[edges[:, 0]] - corners[edges[:, 1]]) ** 2).sum(axis=1))
    sides = _sides(corners[triangles]).max(axis=1)
    along, across = np.ceil(lengths / spacing), np.ceil(sides / spacing)
    with np.errstate(over="ignore"):
        room.require(4, contacts=int(min(along.sum() + (0.5 * across * across).sum(), 1e100)))
    found = [np.zeros((0, 3))]
    for (i, j), parts in zip(edges.tolist(), along.astype(int).tolist(), strict=True):
        share = (np.arange(1, parts) / parts)[:, None]
        found.append((1.0 - share) * corners[i] + share * corners[j])
    for triangle, parts in zip(triangles, across.astype(int).tolist(), strict=True):
        inside = [(a, b, parts - a - b) for a in range(1, parts) for b in range(1, parts - a)]
        found.append(algebra.product(np.array(inside, dtype=float).reshape(-1, 3) / parts, corners[triangle]))
    return np.concatenate(found)


def distance(body: Body) -> float:
    """An upper bound of the distance of a point of the faces to the nearest contact point [m]; 0 without faces."""
    touching = body.contacts @ body.points
    corners = touching[body.faces]
    longest, bounds = _sides(corners).max(axis=1, initial=0.0), _from_corners(corners)
    farthest = 0.0
    # The order is that of falling bounds, until a bound is below the distance found.
    for k in np.argsort(-bounds):
        if bounds[k] <= farthest:
            break
        # Places are relative to the middle of the triangle, so that differences of squares keep enough digits.
        arms, sides = touching - corners[k].mean(axis=0), corners[k] - corners[k].mean(axis=0)
        near = arms[(arms**2).sum(axis=1) <= (longest[k] + bounds[k]) ** 2]
        parts, nearest, between = _FIRST // 2, 0.0, math.inf
        while between > _SHARE * nearest and parts < _LAST:
            parts *= 2
            places, between = _lattice(parts) @ sides, longest[k] * _LARGEST / parts
            least = np.full(len(places), math.inf)
            for some in (near[begin : begin + _TOGETHER] for begin in range(0, len(near), _TOGETHER)):
                least = np.minimum(least, ((some**2).sum(axis=1) - 2.0 * (places @ some.T)).min(axis=1))
            nearest = math.sqrt(max((least + (places**2).sum(axis=1)).max(), 0.0))
        farthest = max(farthest, min(nearest + between, bounds[k]))
    return float(farthest)


def _from_corners(corners: Floats) -> Floats:
    """The largest distance (F,) of a point of each triangle (F, 3, 3) to the nearest of its corners.

    Without an obtuse angle it is the radius of the circumscribed circle. Else the farthest point is on the longest
    side, on the perpendicular bisector of another side, of length b, at an angle A: its distance is b/(2 cos A).
    """
    c, b, a = np.sort(_sides(corners), axis=1)[:, ::-1].T
    # A triangle without an area gives 0/0.
    with np.errstate(divide="ignore", invalid="ignore"):
        cos_a, cos_b = (b * b + c * c - a * a) / (2.0 * b * c), (a * a + c * c - b * b) / (2.0 * a * c)
        obtuse = np.maximum(b / (2.0 * cos_a), a / (2.0 * cos_b))
        area4 = np.sqrt(np.maximum((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c)), 0.0))
        found = np.where(c * c >= a * a + b * b, obtuse, a * b * c / area4)
    # The equilateral triangle with the longest side is the bound, whatever round-off gives.
    return np.asarray(np.fmin(found, c * _LARGEST))


@functools.cache
def _lattice(parts: int) -> Floats:
    """The weights (Q, 3) of the corners at the lattice points of a triangle with sides cut into `parts` parts."""
    return np.array([(a, b, parts - a - b) for a in range(parts + 1) for b in range(parts + 1 - a)]) / parts


def thickness(body: Body) -> float:
    """Half of the extent of a body along the direction in which its contact points spread least [m]."""
    touching = body.contacts @ body.points
    arms = touching - touching.mean(axis=0)
    axes = np.linalg.svd(arms, full_matrices=False)[2]
    return float(0.5 * np.ptp(arms @ axes.T, axis=0).min())


def _sides(corners: Floats) -> Floats:
    """The lengths (F, 3) of the sides of triangles (F, 3, 3)."""
    return np.asarray(np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2)))
