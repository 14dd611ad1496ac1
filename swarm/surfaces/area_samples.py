"""Points of surfaces, uniform in their area, or in their length in a plane.

Each surface defines how its points are drawn. Points of spheres, tori, triangles and outlines are drawn directly. Any
other wall is a quadric or a plane: lines that are uniform and isotropic in a ball, or in a plane in a disc, meet every
piece of an area equally often (Crofton), at any orientation of the piece.
"""

import functools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..kernel.vector import vec
from ..state import Floats

Random = np.random.Generator
Region = tuple[Floats, Floats]
Draw = Callable[[Random, int], Floats]


# A drawn point is as near to its surface as this part of the extent of the surface.
NEAR = 1e-10


class AreaSample(NamedTuple):
    """A sampler of a part of a surface.

    Attributes:
        area: area of the part. Points of several samples are uniform in all if their numbers are as the areas.
        draw: function that draws points (3, n) from a random generator and n, NaN where a line meets nothing.
    """

    area: float
    draw: Draw


def points_of(samples: list[AreaSample], random: Random, n: int) -> Floats:
    """Return at most `n` points of the samples, uniform in their areas, in random order."""
    areas = np.array([one.area for one in samples])
    counts = random.multinomial(n, areas / areas.sum()) if len(samples) > 1 else np.array([n])
    drawn = [one.draw(random, int(count)) for one, count in zip(samples, counts, strict=True) if count]
    points = np.concatenate(drawn, axis=1)
    if len(samples) > 1:
        points = points[:, random.permutation(points.shape[1])]
    return points[:, np.isfinite(points).all(axis=0)]


def directions(random: Random, n: int) -> Floats:
    """Return unit vectors (3, n) uniform on the sphere."""
    normal = random.standard_normal((3, n))
    return np.asarray(normal / np.sqrt((normal**2).sum(axis=0)))


def of_triangles(vertices: Floats, triangles: NDArray[Any]) -> AreaSample:
    """Return the sample of triangles (T, 3) with vertices (V, 3)."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    areas = 0.5 * np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))

    def draw(random: Random, n: int) -> Floats:
        k = random.choice(len(areas), n, p=areas / areas.sum())
        u, w = random.random((2, n))
        beyond = u + w > 1.0
        u, w = np.where(beyond, 1.0 - u, u)[:, None], np.where(beyond, 1.0 - w, w)[:, None]
        return np.asarray((a[k] + u * (b[k] - a[k]) + w * (c[k] - a[k])).T)

    return AreaSample(float(areas.sum()), draw)


# --- By lines --------------------------------------------------------------------------------------------


def by_lines(surface: Any, bounds: Region, across: int | None) -> Iterator[AreaSample]:
    """Yield the samples of a surface with walls of at most the second degree."""
    low, high = (np.array(corner, np.float64) for corner in surface.enclosing_box())
    low, high = np.maximum(low, bounds[0]), np.minimum(high, bounds[1])
    if not np.isfinite(high - low).all():
        raise SceneError(
            f"where must be bounded, got {surface!r:.200} in a scene that is open to infinity; give within=, a surface "
            "that bounds the part of it from which particles come"
        )
    if (high < low).any():
        return
    center, radius = 0.5 * (low + high)[:, None], 0.5 * float(np.sqrt(((high - low) ** 2).sum()))
    radius *= 1.0 + 1e-9
    for wall in (part for one in surface.walls() for part in one.smooth_parts()):
        if not wall.degree:
            raise SceneError(
                f"where must be a surface of which points can be drawn exactly, got {type(surface).__name__}; give one "
                "of spheres, cylinders, boxes, planes, quadrics, outlines or meshes, or volume=True"
            )
        half = wall.degree * (math.pi * radius if across is not None else 2.0 * math.pi * radius**2)
        yield AreaSample(half, functools.partial(_met, wall, (center, radius, across)))


def _met(wall: Any, ball: tuple[Floats, float, int | None], random: Random, n: int) -> Floats:
    """Return where random lines through a ball, or a disc, meet a wall; one of two places on a line at random."""
    center, radius, across = ball
    first, u = _lines(random, n, across)
    foot = center + radius * first
    before, here, after = (wall.polynomial(vec(foot + t * u)) for t in (-radius, 0.0, radius))
    a, b = 0.5 * (before + after) - here, 0.5 * (after - before)
    if wall.degree == 1:
        with np.errstate(all="ignore"):
            t = -here / b
    else:
        sign = np.where(random.random(n) < 0.5, 1.0, -1.0)
        with np.errstate(all="ignore"):
            root = np.sqrt(b * b - 4.0 * a * here)
            # The root that is not a difference, and the other root by the product of both.
            large = -0.5 * (b + np.copysign(root, b))
            size = np.abs(here) + np.abs(b) + np.abs(a)
            t = np.where(sign > 0.0, large / np.where(np.abs(a) > 1e-13 * size, a, np.nan), here / large)
    return np.asarray(np.where(np.abs(t) <= 1.0, foot + radius * t * u, np.nan))


def _lines(random: Random, n: int, across: int | None) -> tuple[Floats, Floats]:
    """Return feet and directions of uniform, isotropic lines among those that meet the unit ball, or disc."""
    if across is not None:
        angle, offset = 2.0 * math.pi * random.random(n), 2.0 * random.random(n) - 1.0
        i, j = (across + 1) % 3, (across + 2) % 3
        u, foot = np.zeros((3, n)), np.zeros((3, n))
        u[i], u[j] = np.cos(angle), np.sin(angle)
        foot[i], foot[j] = -offset * u[j], offset * u[i]
        return foot, u
    u = directions(random, n)
    other = directions(random, n)
    beside = other - (other * u).sum(axis=0) * u
    beside /= np.sqrt((beside**2).sum(axis=0))
    return np.sqrt(random.random(n)) * beside, u
