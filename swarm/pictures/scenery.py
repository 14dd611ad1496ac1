"""The picture of walls among which particles are placed.

From the back to the front: the far inner sides of cavities and lines on them, solids and all opaque parts,
particles, and the near edges.
"""

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from ..state import Floats
from ..triangles.curves import finer, joined, runs, turning, zeros
from ..triangles.shape import Shape
from .balls import colours_of, size_of_dots
from .colours import Colours
from .eye import Eye
from .framed import eye_of, window
from .raster import Raster, corners_of, lit
from .style import CAVITY_LINE, SOLID, SOLID_LINE, backdrop
from .triad import BAR, STRIP, draw_triad, say_beyond

# The margin around a vessel, as a part of its width or height; pixels of a raster for each of the picture, and at most.
_ROOM, _FINE, _MOST = 0.025, 1.5, 1600.0
# A line on a wall is behind the pixels of that wall by less than this part of the picture.
_ON = 0.006
# The opacity of a cavity's colour where it faces the eye, and where it turns away.
_CLEAR, _TINTED = 0.30, 0.95
Ties = tuple[Floats, Colours]
NO_TIES: Ties = np.empty((0, 0, 3)), np.empty(0, np.uint32)
# Triangles nearly parallel to the direction of the eye turn away from it by round-off only.
_ROUND_OFF = 1e-9


def red_green_blue(packed: Colours) -> Floats:
    """0xRRGGBBAA as three numbers from 0 to 1: (N, 3)."""
    return np.stack([(packed >> shift & 0xFF) / 255.0 for shift in (24, 16, 8)], axis=1)


class Scenery:
    """The picture of walls in axes, with particles among them; its artists are in `still`, `solid` and `front`."""

    def __init__(self, axes: Any, shapes: list[Shape], found: list[Floats]) -> None:
        self.axes, self.shapes = axes, shapes
        self.eye = eye_of(shapes, found)
        low, high = window(self.eye, found)
        room = _ROOM * float((high - low).max())
        box = axes.get_figure(root=False).bbox
        dpi = axes.get_figure(root=True).dpi
        spec = axes.get_subplotspec()
        rows, columns = (1, 1) if spec is None else spec.get_gridspec().get_geometry()
        pixels = np.array([box.width / columns, box.height / rows])
        strip = STRIP * dpi / 72.0
        # Below the vessel, or beside it if there is room.
        wide, tall = high - low
        beside = wide * pixels[1] / tall + 3.0 * strip < pixels[0]
        rest = pixels - ((3.0 * strip, 0.0) if beside else (0.0, min(strip, 0.5 * pixels[1])))
        scale = float((rest / (high - low)).min())
        low, high = low - room, high + room
        self.low = low - np.array([1.5 * strip, 0.0] if beside else [0.0, strip]) / scale
        self.high = high + np.array([1.5 * strip, 0.0] if beside else [0.0, 0.0]) / scale
        axes.set(xlim=(self.low[0], self.high[0]), ylim=(self.low[1], self.high[1]), aspect="equal")
        axes.set_axis_off()
        draw_triad(axes, self.eye, 1.4 * strip / scale if beside else BAR * float(high[0] - low[0]))
        largest = float((self.high - self.low).max())
        self._scale = min(_FINE * scale, _MOST / largest)
        self._on = _ON * largest
        self._back, self.opaque = self._raster(), self._raster()
        self.still: list[Any] = []
        self.front: list[Any] = []
        self._outside: Any = None

    def _raster(self) -> Raster:
        return Raster(self.low, self.high, self._scale)

    # --- Walls -------------------------------------------------------------------------------------------

    def walls(self) -> None:
        """Draw the far inner sides of cavities, and solids, and the lines on them."""
        self._back, self.opaque = self._raster(), self._raster()
        for shape in self.shapes:
            raster, paint = (self.opaque, _solid) if shape.solid else (self._back, _glass)
            facing = shape.normals @ self.eye.near > 0.0
            chosen = shape.triangles[facing[shape.triangles].any(axis=1)]
            if len(chosen):
                normals = self.eye.seen(shape.normals)
                raster.triangles(self.eye.seen(shape.vertices), chosen, paint(normals))
        self._show(self._back, 0.5)
        far, self._near_curves = self._sorted()
        for lines, colour, wide, alpha in far:
            self._lines(lines, colour, wide, alpha, 1.0, self.still)
        if np.isfinite(self.opaque.depth).any():
            self._show(self.opaque, 1.5)
        for shape in self.shapes:
            if shape.solid and not shape.many:
                edges, levels = shape.edges + silhouette(shape, self.eye), shape.levels
                for curves, wide, alpha in ((edges, 0.9, 1.0), (levels, 0.4, 0.6)):
                    seen = self._cut([self._fine(curve) for curve in curves])
                    self._lines(seen, SOLID_LINE, wide, alpha, 1.6, self.still)

    def _sorted(self) -> tuple[list[tuple[list[Floats], str, float, float]], list[Floats]]:
        """The lines of cavities behind particles, and those in front of them."""
        far, near = [], list[Floats]()
        for shape in self.shapes:
            if shape.solid:
                continue
            before, behind = self._split(shape.edges)
            near += before
            far += [
                (behind, CAVITY_LINE, 0.9, 0.9),
                (self._split(shape.levels)[1], CAVITY_LINE, 0.5, 0.45),
                ([self.eye.seen(curve) for curve in silhouette(shape, self.eye)], CAVITY_LINE, 1.2, 1.0),
            ]
        return far, near

    def _split(self, curves: list[Floats]) -> tuple[list[Floats], list[Floats]]:
        """The parts of curves in front of the far side, and those on it."""
        before, behind = list[Floats](), list[Floats]()
        for curve in curves:
            seen = self._fine(curve)
            moved = seen - (0.0, 0.0, 2.0 * self._on)
            is_near = ~self._back.hides(moved) & self._covered(seen)
            before += runs(seen, is_near)
            behind += runs(seen, ~is_near)
        return before, behind

    def _covered(self, seen: Floats) -> NDArray[np.bool_]:
        """Whether there is a far side at points in coordinates of the eye."""
        far = seen.copy()
        far[:, 2] = -np.finfo(np.float64).max
        return self._back.hides(far)

    def _cut(self, curves: list[Floats]) -> list[Floats]:
        """The parts of curves, in coordinates of the eye, that no opaque pixel hides."""
        return [run for seen in curves for run in runs(seen, ~self.opaque.hides(seen, self._on))]

    def _fine(self, curve: Floats) -> Floats:
        """A curve in coordinates of the eye, with points close enough for cuts."""
        return finer(self.eye.seen(curve), float((self.high - self.low).max()) / 250.0)

    def clear(self) -> None:
        """Remove the artists of walls."""
        for artist in (*self.still, *self.front):
            artist.remove()
        self.still, self.front = [], []

    def near_lines(self) -> None:
        """Draw the near edges of cavities, which are in front of the particles."""
        self._lines(self._cut(self._near_curves), CAVITY_LINE, 0.8, 0.7, 4.0, self.front)

    def _lines(self, curves: list[Floats], colour: Any, wide: float, alpha: float, order: float, to: list[Any]) -> None:
        if curves:
            drawn = LineCollection(
                [curve[:, :2] for curve in curves], colors=colour, linewidths=wide, alpha=alpha, zorder=order,
                capstyle="round", joinstyle="round",
            )  # fmt: skip
            self.axes.add_collection(drawn, autolim=False)
            to.append(drawn)

    def _show(self, raster: Raster, order: float) -> None:
        self.still.append(self.axes.imshow(
            raster.image(), extent=raster.extent, origin="lower", aspect="equal", zorder=order,
            interpolation="antialiased", interpolation_stage="rgba",
        ))  # fmt: skip
        self.axes.set(xlim=(self.low[0], self.high[0]), ylim=(self.low[1], self.high[1]))

    # --- Particles and bodies ----------------------------------------------------------------------------

    def matter(
        self, points: Floats, packed: Colours, lines: Ties = NO_TIES, faces: Ties = NO_TIES,
        radius: Floats | None = None,
    ) -> list[Any]:  # fmt: skip
        """Draw particles or bodies; return their artists."""
        there = (packed & 0xFF > 0) & ~np.isnan(points[:, 0])
        seen, colour = self.eye.seen(points[there]), red_green_blue(packed[there])
        drawn: list[Any] = []
        if len(faces[0]) or radius is not None:
            raster = self.opaque.copy()
            if len(faces[0]):
                tints = red_green_blue(faces[1].ravel()).reshape(-1, 3, 3).mean(axis=1)
                raster.triangles(*corners_of(self.eye, faces[0], tints))
            elif radius is not None:
                raster.balls(seen, radius[there], colour)
            before = len(self.still)
            self._show(raster, 2.0)
            drawn += self.still[before:]
            del self.still[before:]
        else:
            drawn += self._bonds(*lines)
            drawn.append(self.dots(seen, colour, len(points)))
        outside = ((seen[:, :2] < self.low) | (seen[:, :2] > self.high)).any(axis=1).sum()
        drawn += say_beyond(self.axes, int(outside))
        return drawn

    def dots(self, seen: Floats, colour: Floats, count: int) -> Any:
        """Draw dots for particles that no solid hides, the nearer ones before others."""
        kept = np.flatnonzero(~self.opaque.hides(seen))
        kept = kept[np.argsort(seen[kept, 2])]
        tints, size = colours_of(colour[kept], len(kept)), size_of_dots(count)
        return self.axes.scatter(*seen[kept, :2].T, c=tints, s=size, linewidths=0.0, zorder=2.0)

    def _bonds(self, lines: Floats, packed: Colours) -> list[Any]:
        """Draw the lines of bodies, wider for fewer lines."""
        if not len(lines):
            return []
        seen = self.eye.seen(lines)
        kept = np.flatnonzero(~self.opaque.hides(seen.mean(axis=1)))
        kept = kept[np.argsort(seen[kept].mean(axis=1)[:, 2])]
        width = float(np.clip(300.0 / len(lines), 0.9, 2.0))
        drawn = LineCollection(
            list(seen[kept, :, :2]), colors=red_green_blue(packed)[kept], linewidths=width, zorder=2.0
        )
        self.axes.add_collection(drawn, autolim=False)
        return [drawn]


def _solid(normals: Floats) -> Floats:
    """The colours of a solid with normals (n, 3) in coordinates of the eye."""
    return 0.15 + 0.85 * lit(np.broadcast_to(to_rgb(SOLID), normals.shape), normals)


def _glass(normals: Floats) -> Floats:
    """The colours of the inner side of a cavity: clear where it faces the eye."""
    part = (_CLEAR + (_TINTED - _CLEAR) * (1.0 - normals[:, 2].clip(0.0)) ** 1.5)[:, None]
    part = part * (1.0 - 0.25 * normals[:, 1:2])
    paper, tint = (np.array(to_rgb(colour)) for colour in backdrop())
    return np.asarray((1.0 - part) * paper + part * tint)


def silhouette(shape: Shape, eye: Eye) -> list[Floats]:
    """The curves (k, 3) [m] at which normals turn away from the eye, and the edges between facets at which they do."""
    if not len(shape.triangles):
        return []
    towards = shape.normals @ eye.near
    towards = np.where(np.abs(towards) < _ROUND_OFF, _ROUND_OFF, towards)
    return zeros(shape.vertices, shape.triangles, towards) + _of_facets(shape, towards)


def _of_facets(shape: Shape, towards: Floats) -> list[Floats]:
    """The edges between a facet that faces the eye and one that does not, if facets have corners of their own."""
    corners = towards[shape.triangles]
    if (np.ptp(corners, axis=1) > 1e-12).any():
        return []  # smooth walls: their creases are edges
    points, places = np.unique(shape.vertices, axis=0, return_inverse=True)
    triangles = places.reshape(-1)[shape.triangles]
    return joined(points, turning(points, triangles, corners[:, 0] > 0.0))
