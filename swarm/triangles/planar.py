"""The walls of a two-dimensional scene as shapes to draw: curves in its plane, and a low ribbon along each."""

import contourpy
import numpy as np
from numpy.typing import NDArray

from ..motion import Pose, pose
from ..scene import Scene
from ..state import Floats
from ..surfaces.instant import box_of
from ..surfaces.plane import along
from ..surfaces.presence.openings import are_open
from ..surfaces.room import polyhedron_bounds
from ..surfaces.rotation import normalized
from ..surfaces.surface import Surface
from .curves import runs, spans
from .cut import Level, SmoothSurface
from .gridded import Corners, around
from .parts import Part

# Points along each side of the grid on which curves are found, and on which a small body is found
_POINTS, _BODY = 500, 60
# Bisections of a piece of a curve at the end of a wall.
_BISECTIONS = 20
# Cells of the grid beyond the walls, so that these are closed.
_MARGIN = 2.0
# An open area is drawn to this many times the distance of the surfaces and particles.
_BEYOND = 1.2
# The height of a ribbon, as a part of the width of the scene.
_HEIGHT = 0.02

Strip = tuple[Floats, NDArray[np.int64], Floats]


class PlaneWalls:
    """The walls of a scene at one time [s], in its plane, around them and particles (3, N)."""

    def __init__(self, scene: Scene, positions: Floats, time: float) -> None:
        across = scene.across()
        assert across is not None
        self._scene, self._time, self._across, self._axes = scene, time, across, along(across)
        low, high = (np.array(corner)[list(self._axes)] for corner in scene.bounds(time))
        wide = max((_extent(surface, self._axes) for surface in scene.surfaces), default=0.0) or scene.extent()
        reach = _BEYOND * max(wide, float(np.abs(positions).max()))
        low, high = np.where(np.isfinite(low), low, -reach), np.where(np.isfinite(high), high, reach)
        margin = _MARGIN * (high - low) / (_POINTS - 1.0)
        self._box: Corners = low - margin, high + margin
        self.height = _HEIGHT * float((high - low).max())
        self._coarse = self._curves(self._box)

    def curves(self, i: int, pose: Pose, bodies: int) -> list[Floats]:
        """Return the curves (k, 3) [m] of surface i."""
        surface = self._scene.surfaces[i]
        known = surface.plane_curves(self._across)
        if known is not None and not bodies:
            return self._of(i, known)
        if known is not None or bodies:
            found = known or [curve for solid in surface.solids() for curve in self._around(solid)]
            if surface.is_foam():
                nothing = 1e-9 * float((self._box[1] - self._box[0]).max())
                found = [run for curve in found for run in runs(curve, surface.phi(curve.T) >= -nothing)]
            return [pose.placed(curve.T).T for curve in found]
        found = self._of(i, self._coarse)
        if not found:
            return []
        # Again, on a grid around this surface only.
        points = np.concatenate(found)[:, list(self._axes)]
        return self._of(i, self._curves(around(points, self._box, _POINTS)))

    def of_part(self, part: Part) -> list[Floats]:
        """Return the curves of a part of a surface where it is a wall; each ends where it meets another curve."""
        surface, at = part.surface, pose(part.surface.motion, self._time)
        walls = [SmoothSurface(*one) for one in surface.level_sets()]
        known = None if surface.body_count() else surface.plane_curves(self._across)
        if known is not None:
            return self._cut(part, walls[0], [], [at.placed(curve.T).T for curve in known], at)
        low, high = (np.array(corner)[list(self._axes)] for corner in box_of(surface.filled(), self._time))
        low, high = np.maximum(low, self._box[0]), np.minimum(high, self._box[1])
        margin = _MARGIN * (high - low) / (_POINTS - 1.0)
        found = list[Floats]()
        for wall in walls if (low < high).all() else ():
            curves = self._lines(
                (low - margin, high + margin), _POINTS,
                lambda points: np.nan_to_num(wall.phi(at.given(points.T).T), nan=1.0),  # noqa: B023
            )  # fmt: skip
            found += self._cut(part, wall, [other for other in walls if other is not wall], curves, at)
        return found

    def _cut(
        self, part: Part, wall: SmoothSurface, others: list[SmoothSurface], curves: list[Floats], at: Pose
    ) -> list[Floats]:
        """Return the parts of curves on a smooth wall that are a wall of the scene."""
        size = float((self._box[1] - self._box[0]).max())
        side = -1.0 if part.surface.is_solid() else 1.0

        def level(points: Floats) -> Floats:
            given = at.given(points.T).T
            outwards = side * at.turned(wall.normals(given).T).T
            found = part.level(points, outwards, size, list(part.covers))
            return np.asarray(np.max([found, *(other.distance(given) for other in others)], axis=0))

        found = []
        for curve in curves:
            for a, b in spans(level(curve) <= 0.0):
                first = [_end(level, curve[a], curve[a - 1])] if a else []
                last = [_end(level, curve[b - 1], curve[b])] if b < len(curve) else []
                if len(first) + len(last) + b - a > 1:
                    found.append(np.array([*first, *curve[a:b], *last]))
        return found

    def strip(self, curves: list[Floats]) -> Strip:
        """Return the ribbon on curves: vertices, triangles and normals."""
        vertices, triangles, normals, first = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], [np.empty((0, 3))], 0
        up = np.zeros(3)
        up[self._across] = 0.5 * self.height
        for curve in curves:
            n = len(curve)
            vertices += [curve - up, curve + up]
            k = first + np.arange(n - 1)
            triangles += [np.stack([k, k + 1, k + n], axis=1), np.stack([k + 1, k + n + 1, k + n], axis=1)]
            ahead = np.gradient(curve, axis=0)
            normals += [normalized(np.cross(ahead, up), 1)] * 2
            first += 2 * n
        return np.concatenate(vertices), np.concatenate(triangles), np.concatenate(normals)

    # --- On a grid ---

    def _curves(self, box: Corners) -> list[Floats]:
        """Return the curves of all walls in a box."""

        def largest_gap(points: Floats) -> Floats:
            gap = self._scene.gaps(points.T, self._time).max(axis=0)
            return np.asarray(np.where(np.isfinite(gap), gap, np.max(gap, where=np.isfinite(gap), initial=1.0)))

        return self._lines(box, _POINTS, largest_gap)

    def _lines(self, box: Corners, count: int, level: Level) -> list[Floats]:
        """Return the curves in a box of the plane at which a level is 0, from a grid with `count` points a side."""
        sides = [np.linspace(low, high, count) for low, high in zip(*box, strict=True)]
        with np.errstate(all="ignore"):
            values = level(self._placed(np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)))
        lines = contourpy.contour_generator(sides[0], sides[1], values.reshape(count, count)).lines(0.0)
        return [self._placed(np.asarray(line)) for line in lines]

    def _of(self, i: int, curves: list[Floats]) -> list[Floats]:
        """Return the parts of curves that belong to surface i, without its openings."""
        found, pieces = [], self._scene.pieces
        for curve in curves:
            with np.errstate(all="ignore"):
                gaps = self._scene.gaps(curve.T, self._time)
            owner = np.asarray(np.nan_to_num(gaps, nan=-np.inf).argmax(axis=0))
            for k, *volumes in zip(pieces.owners, pieces.volumes, pieces.doorways, strict=True):
                owner[(owner == k) & are_open((*volumes[0], *volumes[1]), curve.T, self._time)] = -1
            found += runs(curve, owner == i)
        return found

    def _around(self, solid: Surface) -> list[Floats]:
        """Return the curves of one of many bodies."""
        reach, center = 2.0 * solid.size(), np.array(getattr(solid, "center", (0.0, 0.0, 0.0)))[list(self._axes)]
        low, high = self._box
        if np.isfinite(reach):
            far = _BEYOND * (solid.extent() - float(np.abs(center).max()))
            reach = max(reach, far)
            low, high = center - reach, center + reach
        return self._lines((low, high), _BODY, lambda points: solid.phi(points.T))

    def _placed(self, points: Floats) -> Floats:
        """Return points of the plane (N, 2) in space (N, 3)."""
        found = np.zeros((len(points), 3))
        found[:, list(self._axes)] = points
        return found


def _end(level: Level, within: Floats, beyond: Floats) -> Floats:
    """Return the point between two points on a curve up to which a level is not above 0."""
    for _ in range(_BISECTIONS):
        middle = 0.5 * (within + beyond)
        if level(middle[None])[0] <= 0.0:
            within = middle
        else:
            beyond = middle
    return within


def _extent(surface: Surface, axes: tuple[int, int]) -> float:
    """Return the distance from the origin within which a surface lies in the plane, up to its open faces."""
    box = np.array(surface.enclosing_box())
    if faces := surface.open_faces():
        box = np.array(polyhedron_bounds(faces, *box))
    corners = np.abs(box[:, list(axes)])
    return float(corners.max()) if np.isfinite(corners).all() else surface.extent()
