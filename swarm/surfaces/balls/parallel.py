"""Surfaces that balls meet by the foot of the normal: their parallel surfaces, and the largest radius of balls."""

import math
from typing import Any

import numpy as np

from ...common.checks import Vector
from ...kernel.jit import kernel
from ...kernel.vector import Vec, column
from ...state import Floats
from .. import rotation as rotations
from ..surface import UNBOUNDED, Box, Surface, shown
from .by_foot import ByFoot

# The points that search the least slope: their number, the first and last step, its reduction, Newton's steps of each.
_STARTS, _FIRST, _SHORTEST, _SHORTER, _MOVES = 16, 0.05, 1e-6, 0.7, 3
# A point this close to a surface, as a part of its size, is on it; the most moves onto it.
_NEAR, _ONTO = 1e-6, 30


class Parallel(Surface):
    """A surface with a smooth phi that has bounded second derivatives."""

    def tightest(self) -> tuple[float, Vector | None]:
        """Return the smallest certain radius of curvature [m], and its place on the surface, None if it is infinite."""
        radius, where = self.own_tightest()
        if where is None:
            return radius, None
        turned = rotations.turned(self.rotation, where)
        x, y, z = (float(a + b) for a, b in zip(self.middle(), turned, strict=True))
        return radius, (x, y, z)

    def own_tightest(self) -> tuple[float, Any]:
        """Return `tightest` with the place relative to the middle, before the surface is rotated about the middle."""
        raise NotImplementedError

    def middle(self) -> Vector:
        """Return the place about which the surface is rotated."""
        return self.center  # type: ignore[attr-defined, no-any-return]

    def by_foot(self, largest: float) -> ByFoot:
        """Return the wall for balls up to a radius, in the frame of `numbers`."""
        numbers = self.numbers()
        return foot_of(numbers, numbers.hessian_bounds(None)[0], self.tightest()[0])

    def framed_alike(self, wall: Any) -> Any:
        """Return a wall in the frame of `numbers`, transformed to the scene."""
        return rotations.rotated(self.rotation, wall)

    def walls_of_balls(self, largest: float) -> tuple[Any, ...]:
        return (self.framed_alike(self.by_foot(largest)),)

    def why_no_balls(self) -> str | None:
        radius, where = self.tightest()
        if radius > 0.0 or where is None:
            return None
        return f"which has a tip at {shown(where)}, where its normal turns at once"

    def largest_ball(self) -> float:
        return self.tightest()[0]

    def most_bent_at(self) -> Vector | None:
        return self.tightest()[1]

    def reaching_outside(self, points: Floats, radius: Floats, time: float = 0.0) -> Floats:
        return reach_by_distance(self, points, radius, time)


def reach_by_distance(surface: Any, points: Floats, radius: Floats, time: float) -> Floats:
    """Return how far balls (N,) at points (3, N) reach out of a surface [m]; its one wall for balls gives distances."""
    found = np.empty(points.shape[1])
    distances_from(surface.walls_of_balls(0.0)[0], np.ascontiguousarray(surface._own_rows(points, time)), found)
    return found + radius


@kernel
def distances_from(wall, points, found):
    """Write the distances of points (3, N) outside a wall into `found`."""
    for i in range(points.shape[1]):
        found[i] = wall.distance(column(points, 0, i))


def foot_of(numbers: Any, most: float, bend: float, box: Box = UNBOUNDED, known: float = math.inf) -> ByFoot:
    """Return the wall for balls of a record: side H is at most `most` up to twice `known` from it; it is in a box."""
    low, high = (Vec(*map(float, corner)) for corner in box)
    return ByFoot(numbers, 0.0, float(most), float(bend), low, high, float(known))


def nearer(points: Floats, value: Any, slope: Any) -> Floats:
    """Return points (3, N) after Newton's step onto a surface along the gradient."""
    normal = slope(points)
    with np.errstate(all="ignore"):
        return np.asarray(points - value(points) / (normal**2).sum(axis=0) * normal)


def onto(points: Floats, value: Any, slope: Any) -> Floats:
    """Return points (3, N) moved onto a surface along the gradient, without those that move far."""
    size, to = np.ptp(points, axis=1).max(), points
    for _move in range(_ONTO):
        to = nearer(to, value, slope)
    with np.errstate(all="ignore"):
        found = np.abs(value(to)) <= _NEAR * size * np.sqrt((slope(to) ** 2).sum(axis=0))
    return to[:, found & (np.abs(to - points).max(axis=0) <= 0.1 * size)]


def tightest_of(points: Floats, value: Any, slope: Any, most: float) -> tuple[float, Vector]:
    """Return the least |grad phi|/(2 most) on a surface, and its place, by descent from points (3, N) on it."""
    steep = np.sqrt((slope(points) ** 2).sum(axis=0))
    near = _NEAR * float(steep.max()) * float(np.ptp(points, axis=1).max())
    best = points[:, np.argsort(steep)[:_STARTS]]
    steep = np.sort(steep)[:_STARTS]
    step = _FIRST * float(np.ptp(points, axis=1).max())
    random = np.random.default_rng(0)
    while step > _SHORTEST * float(np.abs(points).max()):
        trial = best + step * random.normal(size=best.shape)
        for _move in range(_MOVES):
            trial = nearer(trial, value, slope)
        there = np.sqrt((slope(trial) ** 2).sum(axis=0))
        less = (there < steep) & (np.abs(value(trial)) <= near)
        best, steep = np.where(less, trial, best), np.where(less, there, steep)
        if not less.any():
            step *= _SHORTER
    k = int(np.argmin(steep))
    x, y, z = best[:, k].tolist()
    return (float(steep[k]) / (2.0 * most) if most > 0.0 else math.inf), (x, y, z)
