"""Walls that stand on an outline, as users describe them: what all such surfaces have in common."""

import math
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common.checks import Vector
from ...kernel.grid import one_cell
from ...kernel.limits import ON_OUTLINE
from ...kernel.vector import Vec, vec
from .. import rotation as rotations
from ..fields.grid import grid_of
from ..fields.many import Many, field_of
from ..fields.members import Members, table_of
from ..rotation import Rotated
from ..shapes.quadratic import QuadricNumbers
from ..surface import UNBOUNDED, Box, HalfSpace, Surface, side_sign
from .outline import Floats, Outline
from .round_side import round_side
from .sides import FewSides, Side, Sides

# At so few sides each lane looks on a straight flight; under gravity so few are in one cell of a grid.
_FEW, _IN_ONE_CELL = 24, 8
# Entries of a matrix up to this size count as 0.
_ALIGNED = 1e-15
# The axes x, y, z of the scene along which the plane's axes to the right, upwards and the axis across it are.
_ALONG = {(1.0, 0.0, 0.0): (1, 2, 0), (0.0, 1.0, 0.0): (2, 0, 1), (0.0, 0.0, 1.0): (0, 1, 2)}


class Outlined(Many):
    """A surface that stands on an outline."""

    axis: Vector
    center: Vector
    side: str
    height: Any = None
    refused = ("motion", "mass", "inertia")
    instead = "its walls end at its corners: move the other surfaces, or build it of surfaces without edges"
    # The argument that gives the outline.
    given: ClassVar[str] = "outline"

    def __post_init__(self) -> None:
        Surface.__post_init__(self)

    __repr__ = Surface.__repr__

    def rows(self) -> Any:
        """The rows of the vertices."""
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
        # Round-off of a turn about its axis is no tilt.
        found[np.abs(found) <= _ALIGNED] = 0.0
        return np.asarray(found)

    @property
    def across(self) -> int | None:
        """The axis of the scene across its plane, or None if the plane is across no axis of the scene."""
        column = self.frame[:, 2]
        return int(np.argmax(np.abs(column))) if np.count_nonzero(column) == 1 else None

    def in_plane(self, points: Floats) -> Floats:
        """Points of the scene (3, N) in the outline's plane and across it: (3, N)."""
        return np.asarray(self.frame.T @ (points - np.array(self.center)[:, None]))

    def placed(self, points: Floats) -> Floats:
        """Points of the plane (2, N) in the scene (3, N)."""
        return np.asarray(self.frame[:, :2] @ points + np.array(self.center)[:, None])

    def curves(self) -> list[Floats]:
        """A curve (k, 3) along every side, for pictures."""
        return [self.placed(curve.T).T for curve in self.boundary.curves()]

    # --- For users ---

    def phi(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """The signed distance of points (3, N): below 0 inside, 0 on the surface, above 0 outside; shape (N,)."""
        return self._at(points)[0]

    def gradient(self, points: ArrayLike, time: float = 0.0) -> NDArray[np.float64]:
        """Gradient of phi at points (3, N); shape (3, N). At a corner it is that of one of its sides."""
        return self._at(points)[1]

    def _at(self, points: ArrayLike) -> tuple[Floats, Floats]:
        rows = np.array(self._own_rows(points, 0.0))
        own = self.in_plane(rows.reshape(3, -1))
        level, slope = self.boundary.nearest(own[:2])
        slope = self.frame[:, :2] @ slope
        if self.height is not None:
            above = np.abs(own[2]) - 0.5 * self.height
            lid = self.frame[:, 2:] * np.copysign(1.0, own[2])
            slope, level = np.where(above > level, lid, slope), np.maximum(above, level)
        return level.reshape(rows.shape[1:]), slope.reshape(rows.shape)

    def contain(self, points: Floats) -> NDArray[np.bool_]:
        """Whether each of the points (3, N) is not admissible."""
        return np.asarray(side_sign(self.side) * self.phi(points) > 0.0)

    def corners(self) -> tuple[Floats, Floats]:
        low, high = replace(self, side="inside").bounds()  # type: ignore[call-arg]
        return np.array(low)[:, None], np.array(high)[:, None]

    def shifted(self, shift: Vector) -> Surface:
        return Surface.shifted(self, shift)

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

    def extent(self) -> float:
        return float(
            max(map(abs, self.center)) + math.hypot(2.0**0.5 * self.boundary.extent, 0.5 * (self.height or 0.0))
        )

    # --- For kernels ---

    def numbers(self) -> list[int]:
        """The number of every wall."""
        return list(range(len(self)))

    @cached_property
    def members(self) -> Members:
        """The walls as kernels take them."""
        table = table_of([self._side(k) for k in range(len(self))])
        like = self._side(0)
        grid = one_cell(len(self)) if len(self) <= _IN_ONE_CELL else grid_of(like, table, self._boxes())
        return (FewSides if len(self) <= _FEW else Sides)(like, table, grid)

    def _members_of_balls(self, largest: float) -> Members:
        sides = [round_side(self._side(k)) for k in range(len(self))]
        table = table_of(sides)
        return field_of(sides[0], table, self._boxes, None, largest)

    def faces_of_balls(self, largest: float) -> tuple[Members, NDArray[np.int64]]:
        """As `Many.faces_of_balls`: runs of sides that join smoothly or at an edge towards the balls, and lids."""
        n, sign = len(self.boundary), side_sign(self.side)
        # A ball that is too wide for an arc touches what is next to it on both sides.
        fits = 1.0 - sign * self.boundary.sides.curvature * largest > 0.0
        splits = (self.boundary.wedges(sign) > 0.0) | ~fits | ~np.roll(fits, -1)
        face = np.concatenate([[0], np.cumsum(splits[:-1])])
        if not splits[-1]:
            face[face == face[-1]] = 0
        lids = n + np.arange(len(self) - n)
        return self.walls_of_balls(largest)[0], np.concatenate([face, lids])

    def reaching_outside(self, points: Floats, radius: Floats, time: float = 0.0) -> Floats:
        return np.asarray(side_sign(self.side) * self.phi(points, time) + radius)

    def holds_balls(self) -> str | None:
        return None

    def _boxes(self) -> tuple[Floats, Floats]:
        """The lowest and the highest corners (3, n) of boxes around all walls, infinite across an endless outline."""
        low, high = self.boundary.corners()
        half = math.inf if self.height is None else 0.5 * self.height
        low, high = np.vstack([low, np.full(low.shape[1], -half)]), np.vstack([high, np.full(low.shape[1], half)])
        if self.height is not None:
            lids = np.array([[-half, half]])
            first, last = low[:2].min(axis=1), high[:2].max(axis=1)
            low = np.hstack([low, np.vstack([np.tile(first[:, None], 2), lids])])
            high = np.hstack([high, np.vstack([np.tile(last[:, None], 2), lids])])
        corners = np.array([np.where(np.array(pick)[:, None], high, low) for pick in np.ndindex(2, 2, 2)])
        with np.errstate(invalid="ignore"):
            terms = self.frame[None, :, :, None] * corners[:, None]
        placed = np.where(self.frame[None, :, :, None] == 0.0, 0.0, terms).sum(axis=2) + np.array(self.center)[:, None]
        room = ON_OUTLINE * (self.extent() + self.boundary.extent)
        return np.ascontiguousarray(placed.min(axis=0) - room), np.ascontiguousarray(placed.max(axis=0) + room)

    def walls(self) -> tuple[Members]:
        return (self.members,)

    def _side(self, k: int) -> Any:
        """The numbers of wall k."""
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
        """The numbers of a lid, which has no ends: sides keep particles from beyond them."""
        across, frame, none = self.across, self.frame, Vec(0.0, 0.0, 0.0)
        own = across is None
        normal = np.array([0.0, 0.0, sign]) if own else sign * frame[:, 2]
        center = frame.T @ self.center if own else np.array(self.center)
        body = QuadricNumbers(_vec(center + 0.5 * self.height * normal), none, _vec(normal), 0.0, self.height, 1.0)
        side = Side(body, none, none, none, slack, self.extent(), 0.0, 0.0, self.extent(), -1.0, -1.0)
        return Rotated(side, *(_vec(row) for row in frame)) if own else side


def _vec(values: Any) -> Vec:
    return vec([float(value) for value in values])
