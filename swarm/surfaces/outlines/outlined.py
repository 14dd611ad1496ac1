"""Walls that stand on an outline, as users describe them: the common part of all such surfaces."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common.checks import Vector
from ...kernel.grid import one_cell
from ...kernel.limits import ON_OUTLINE
from ...kernel.vector import Vec, vec
from ...state import Floats
from .. import rotation as rotations
from ..area_samples import AreaSample, Draw, Region
from ..fields.grid import grid_of
from ..fields.many import Many, field_of
from ..fields.members import Members, table_of
from ..parametrised import Triangles, halved
from ..rotation import Rotated
from ..shapes.quadratic import QuadricNumbers
from ..surface import UNBOUNDED, Box, HalfSpace, LevelSet, side_sign
from .outline import Outline
from .round_side import round_side
from .sides import FewSides, Side, Sides

# Up to this number of sides each lane looks at all on a straight flight; up to the second number all are in one cell.
_FEW, _IN_ONE_CELL = 24, 8
# Entries of a matrix up to this size count as 0.
_ALIGNED = 1e-15
# The parts of the height of the triangles on it, and the points of a line along it
_HIGH, _FINE = 8, 201
# The axes x, y, z of the scene, of the plane's axes to the right and upwards and of the axis across it
_ALONG = {(1.0, 0.0, 0.0): (1, 2, 0), (0.0, 1.0, 0.0): (2, 0, 1), (0.0, 0.0, 1.0): (0, 1, 2)}


Placed = Callable[[Floats, Floats], Floats]


class Outlined(Many):
    """A surface that stands on an outline."""

    axis: Vector
    center: Vector
    side: str
    height: Any = None
    face_noun: ClassVar[str] = "side"
    # The argument that gives the outline
    given: ClassVar[str] = "outline"

    def rows(self) -> Any:
        """Return the rows of the vertices."""
        return getattr(self, self.given)

    @cached_property
    def boundary(self) -> Outline:
        """The outline, in its own plane."""
        return Outline(self.given, self.rows())

    def __len__(self) -> int:
        return len(self.boundary) + (0 if self.height is None else 2)

    def area(self) -> float:
        """The area within the outline [m^2]."""
        return self.boundary.area()

    def perimeter(self) -> float:
        """The length of the outline [m]."""
        return self.boundary.perimeter()

    # --- Where it is ---

    @cached_property
    def frame(self) -> Floats:
        """The columns of a matrix: the axes of the outline's plane and the axis across it, in the scene."""
        across = _ALONG.get(self.axis)
        own = rotations.matrix(rotations.onto(self.axis)) if across is None else np.eye(3)[:, list(across)]
        found = own if self.rotation is None else rotations.matrix(self.rotation) @ own
        # Round-off of a rotation about its axis is no tilt.
        found[np.abs(found) <= _ALIGNED] = 0.0
        return np.asarray(found)

    @property
    def across(self) -> int | None:
        """The axis of the scene that is perpendicular to its plane, or None."""
        column = self.frame[:, 2]
        return int(np.argmax(np.abs(column))) if np.count_nonzero(column) == 1 else None

    def in_plane(self, points: Floats) -> Floats:
        """Return points of the scene (3, N) in the outline's plane and across it: (3, N)."""
        return np.asarray(self.frame.T @ (points - np.array(self.center)[:, None]))

    def placed(self, points: Floats) -> Floats:
        """Return points of the plane (2, N) in the scene (3, N)."""
        return np.asarray(self.frame[:, :2] @ points + np.array(self.center)[:, None])

    def plane_curves(self, across: int) -> list[Floats]:
        return self.curves()

    def curves(self) -> list[Floats]:
        """Return a curve (k, 3) along every side, for pictures."""
        return [self.placed(curve.T).T for curve in self.boundary.curves()]

    # --- For users ---

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """The signed distance of points (3, N): below 0 inside, 0 on the surface, above 0 outside; shape (N,)."""
        return self._at(points, time)[0]

    def _own_gradient(self, points: ArrayLike, time: float) -> NDArray[np.float64]:
        return self._at(points, time)[1]

    def _at(self, points: ArrayLike, time: float) -> tuple[Floats, Floats]:
        rows = np.array(self._own_rows(points, time))
        own = self.in_plane(rows.reshape(3, -1))
        level, slope = self.boundary.nearest(own[:2])
        slope = self.frame[:, :2] @ slope
        if self.height is not None:
            above = np.abs(own[2]) - 0.5 * self.height
            lid = self.frame[:, 2:] * np.copysign(1.0, own[2])
            slope, level = np.where(above > level, lid, slope), np.maximum(above, level)
        return level.reshape(rows.shape[1:]), slope.reshape(rows.shape)

    def corners(self) -> tuple[Floats, Floats]:
        low, high = replace(self, side="inside").bounds()  # type: ignore[call-arg]
        return np.array(low)[:, None], np.array(high)[:, None]

    def size(self) -> float:
        smallest = self.boundary.smallest()
        return smallest if self.height is None else min(smallest, 0.5 * self.height)

    def bounds(self) -> Box:
        if self.is_solid():
            return UNBOUNDED
        low, high = self.boundary.corners()
        half = math.inf if self.height is None else 0.5 * self.height
        low, high = low.min(axis=1), high.max(axis=1)
        middle, wide = np.append(0.5 * (low + high), 0.0), np.append(0.5 * (high - low), half)
        tilted = np.abs(self.frame)
        with np.errstate(invalid="ignore"):
            reach = np.where(tilted > 0.0, tilted * wide, 0.0).sum(axis=1)
        middle = self.frame @ middle + self.center
        return tuple((middle - reach).tolist()), tuple((middle + reach).tolist())

    def half_spaces(self) -> list[HalfSpace]:
        if self.is_solid() or self.across is not None:
            return []
        low, high = self.boundary.corners()
        found = []
        for k in range(2):
            for sign, offset in ((1.0, high[k].max()), (-1.0, -low[k].min())):
                n = sign * self.frame[:, k]
                found.append((tuple(n.tolist()), float(offset + n @ np.array(self.center))))
        return found  # type: ignore[return-value]

    def flat_faces(self) -> Floats:
        flat = self.boundary.sides.curvature == 0.0
        own = self.boundary.sides.normal[flat], self.boundary.sides.start[flat]
        normals, starts = (rows @ self.frame[:, :2].T for rows in own)
        if self.height is not None:
            lids = np.array([[1.0], [-1.0]]) * self.frame[:, 2]
            normals, starts = np.vstack([normals, lids]), np.vstack([starts, 0.5 * self.height * lids])
        return np.column_stack([normals, (normals * (starts + np.array(self.center))).sum(axis=1)])

    def extent(self) -> float:
        return float(
            max(map(abs, self.center)) + math.hypot(2.0**0.5 * self.boundary.extent, 0.5 * (self.height or 0.0))
        )

    # --- How it is drawn ---

    def enclosed(self, across: int | None) -> float | None:
        if across is None:
            return None if self.height is None else self.area() * self.height
        half = math.inf if self.height is None else 0.5 * self.height
        return self.area() if across == self.across and abs(self.center[across]) < half else None

    def area_samples(self, bounds: Region, across: int | None) -> list[AreaSample]:
        """Return the samples of its sides and, for a prism, of its lids."""
        frame = self.frame
        corners = np.array([[bounds[i >> k & 1][k] for k in range(3)] for i in range(8)]).T
        heights = frame[:, 2] @ corners
        low, high = (0.0, 0.0) if across is not None else (float(heights.min()), float(heights.max()))
        middle = float(frame[:, 2] @ np.array(self.center))
        if self.height is not None:
            low, high = max(low, middle - 0.5 * self.height), min(high, middle + 0.5 * self.height)
        rows = np.array(self.boundary.rows, np.float64)
        width = 1.0 if across is not None else high - low

        def placed(flat: Floats, height: Floats) -> Floats:
            at = self.placed(flat)
            return np.asarray(at + np.outer(frame[:, 2], height - frame[:, 2] @ at))

        found = []
        for begin, end in zip(rows, np.roll(rows, -1, axis=0), strict=True):
            length, path = _side(begin, end)
            found.append(AreaSample(length * width, _on_side(path, placed, low, high)))
        if self.height is not None and across is None:
            lows, highs = self.boundary.corners()
            least, most = lows.min(axis=1), highs.max(axis=1)
            area = float(np.prod(most - least))
            heights = middle - 0.5 * self.height, middle + 0.5 * self.height
            found += [AreaSample(area, _on_lid(least[:, None], most[:, None], placed, height)) for height in heights]
        return found

    def lids(self, across: int) -> list[float]:
        return [] if self.height is None else [0.5 * self.height]

    def own_frame(self) -> tuple[Floats, dict[str, Any]]:
        return self.frame, {"axis": (0.0, 0.0, 1.0)}

    def level_sets(self) -> list[LevelSet]:
        """Return the level sets of the sides, and of the lids as planes."""

        def phi(points: Floats) -> Floats:
            return self.boundary.nearest(self.in_plane(points.T)[:2])[0]

        def gradient(points: Floats) -> Floats:
            return np.asarray((self.frame[:, :2] @ self.boundary.nearest(self.in_plane(points.T)[:2])[1]).T)

        return [(phi, gradient), *([] if self.height is None else map(self._level_of_lid, (-1.0, 1.0)))]

    def _level_of_lid(self, side: float) -> LevelSet:
        normal = side * self.frame[:, 2]
        offset = float(normal @ np.array(self.center)) + 0.5 * self.height
        return lambda points: points @ normal - offset, lambda points: np.broadcast_to(normal, points.shape)

    def upright(self, low: float, high: float) -> Triangles:
        middle = float(self.frame[:, 2] @ np.array(self.center))
        heights = np.linspace(low, high, _HIGH + 1) - middle
        points, triangles, first = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
        for curve in self.boundary.curves():
            n = len(curve)
            own = np.concatenate([np.repeat(curve, len(heights), axis=0), np.tile(heights, n)[:, None]], axis=1)
            points.append(own @ self.frame.T + np.array(self.center))
            place = first + np.arange(n * len(heights)).reshape(n, len(heights))
            triangles.append(halved(place[:-1, :-1], place[1:, :-1], place[1:, 1:], place[:-1, 1:]))
            first += len(own)
        return np.concatenate(points), np.concatenate(triangles)

    def corner_lines(self, low: float, high: float) -> list[Floats]:
        outline, height = self.boundary, np.linspace(low, high, _FINE)[:, None] * self.frame[:, 2]
        at = self.placed(outline.sides.end[outline.turns != 0].T).T
        along = self.frame[:, 2]
        return [point - (point @ along) * along + height for point in at]

    # --- For kernels ---

    @cached_property
    def members(self) -> Members:  # type: ignore[override]
        table = table_of([self._side(k) for k in range(len(self))])
        like = self._side(0)
        grid = one_cell(len(self)) if len(self) <= _IN_ONE_CELL else grid_of(like, table, self._boxes())
        return (FewSides if len(self) <= _FEW else Sides)(like, table, grid)

    def _members_of_balls(self, largest: float) -> Members:
        sides = [round_side(self._side(k)) for k in range(len(self))]
        table = table_of(sides)
        return field_of(sides[0], table, self._boxes, None, largest)

    def faces_of_balls(self, largest: float) -> tuple[Members, NDArray[np.int64]]:
        """Return, as for `ManyBodies`, runs of sides that join smoothly or at an edge towards the balls, and lids."""
        n, sign = len(self.boundary), side_sign(self.side)
        # A ball that is too wide for an arc touches the neighbours of the arc on both sides.
        fits = 1.0 - sign * self.boundary.sides.curvature * largest > 0.0
        splits = (self.boundary.wedges(sign) > 0.0) | ~fits | ~np.roll(fits, -1)
        face = np.concatenate([[0], np.cumsum(splits[:-1])])
        if not splits[-1]:
            face[face == face[-1]] = 0
        lids = n + np.arange(len(self) - n)
        return self.walls_of_balls(largest)[0], np.concatenate([face, lids])

    def reaching_outside(self, points: Floats, radius: Floats, time: float = 0.0) -> Floats:
        return np.asarray(side_sign(self.side) * self.phi(points, time) + radius)

    def lost(self, points: Floats, time: float) -> NDArray[np.bool_]:
        # Particles outside of its box: phi takes some microseconds for each.
        rows, (low, high) = np.array(self._own_rows(points, time)), np.array(self.bounds())[:, :, None]
        return np.asarray(((rows < low) | (rows > high)).any(axis=0))

    def why_no_balls(self) -> str | None:
        return None

    def _boxes(self) -> tuple[Floats, Floats]:
        """The lowest and highest corners (3, n) of boxes around all walls, infinite across an endless outline."""
        low, high = self.boundary.corners()
        half = math.inf if self.height is None else 0.5 * self.height
        low, high = np.vstack([low, np.full(low.shape[1], -half)]), np.vstack([high, np.full(low.shape[1], half)])
        if self.height is not None:
            # In the order of the walls: a lid with the box of the second lid would be in no cell
            lids = np.array([[half, -half]])
            first, last = low[:2].min(axis=1), high[:2].max(axis=1)
            low = np.hstack([low, np.vstack([np.tile(first[:, None], 2), lids])])
            high = np.hstack([high, np.vstack([np.tile(last[:, None], 2), lids])])
        corners = np.array([np.where(np.array(pick)[:, None], high, low) for pick in np.ndindex(2, 2, 2)])
        with np.errstate(invalid="ignore"):
            terms = self.frame[None, :, :, None] * corners[:, None]
        placed = np.where(self.frame[None, :, :, None] == 0.0, 0.0, terms).sum(axis=2) + np.array(self.center)[:, None]
        room = ON_OUTLINE * (self.extent() + self.boundary.extent)
        return np.ascontiguousarray(placed.min(axis=0) - room), np.ascontiguousarray(placed.max(axis=0) + room)

    def _side(self, k: int) -> Any:
        """Return the numbers of wall k."""
        s, sign, n = self.boundary.sides, side_sign(self.side), len(self.boundary)
        slack = ON_OUTLINE * (self.extent() + self.boundary.extent)
        if k >= n:
            return self._lid(1.0 if k == n else -1.0, slack)
        turns = self.boundary.wedges(sign)
        across, frame = self.across, self.frame
        own = across is None
        place = (lambda v: np.append(v, 0.0)) if own else (lambda v: frame[:, :2] @ v)
        start = place(s.start[k]) + (frame.T @ self.center if own else np.array(self.center))
        half = 0.5 * sign * s.curvature[k]
        a = np.full(3, half)
        a[2 if across is None else across] = 0.0
        body = QuadricNumbers(_vec(start), _vec(a), _vec(place(sign * s.normal[k])), 0.0, float(s.length[k]), 1.0)
        side = Side(
            body, _vec(place(s.ahead[k])), _vec(place(s.behind[k])), _vec(place(s.end[k] - s.start[k])), slack,
            self.extent(), float(turns[k - 1]), float(turns[k]), float(self.boundary.thickness[k]),
            float((k - 1) % n if turns[k - 1] == 0.0 else -1), float((k + 1) % n if turns[k] == 0.0 else -1),
        )  # fmt: skip
        return Rotated(side, *(_vec(row) for row in frame)) if own else side

    def _lid(self, sign: float, slack: float) -> Any:
        """Return the numbers of a lid, which has no ends: sides keep particles from beyond them."""
        across, frame, none = self.across, self.frame, Vec(0.0, 0.0, 0.0)
        own = across is None
        normal = np.array([0.0, 0.0, sign]) if own else sign * frame[:, 2]
        center = frame.T @ self.center if own else np.array(self.center)
        body = QuadricNumbers(_vec(center + 0.5 * self.height * normal), none, _vec(normal), 0.0, self.height, 1.0)
        side = Side(body, none, none, none, slack, self.extent(), 0.0, 0.0, self.extent(), -1.0, -1.0)
        return Rotated(side, *(_vec(row) for row in frame)) if own else side


def _on_side(path: Callable[[Floats], Floats], placed: Placed, low: float, high: float) -> Draw:
    return lambda random, n: placed(path(random.random(n)), low + (high - low) * random.random(n))


def _on_lid(least: Floats, most: Floats, placed: Placed, height: float) -> Draw:
    return lambda random, n: placed(least + (most - least) * random.random((2, n)), np.full(n, height))


def _side(begin: Floats, end: Floats) -> tuple[float, Callable[[Floats], Floats]]:
    """Return the length of a side of an outline, a line or an arc, and the function of its points at parts of it."""
    a, b, bulge = begin[:2], end[:2], float(begin[2])
    chord = float(np.hypot(*(b - a)))
    if bulge == 0.0:
        return chord, lambda part: a[:, None] + (b - a)[:, None] * part
    angle = 4.0 * math.atan(bulge)
    radius = chord / (2.0 * abs(math.sin(0.5 * angle)))
    # To the left of the chord where the arc turns to the left by less than a half turn
    left = np.array([a[1] - b[1], b[0] - a[0]])
    center = 0.5 * (a + b) + left * (0.5 / math.tan(0.5 * angle))
    first = math.atan2(*(a - center)[::-1])
    return radius * abs(
        angle
    ), lambda part: center[:, None] + radius * np.array([np.cos(first + angle * part), np.sin(first + angle * part)])


def _vec(values: Any) -> Vec:
    return vec([float(value) for value in values])
