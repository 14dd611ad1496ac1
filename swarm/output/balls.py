"""Balls in pictures of matplotlib, as large as they are: discs in a plane, shaded balls in space."""

import math
from typing import Any

import numpy as np
from matplotlib.collections import EllipseCollection, PathCollection
from matplotlib.colors import to_rgb
from matplotlib.markers import MarkerStyle
from matplotlib.transforms import IdentityTransform
from mpl_toolkits.mplot3d import proj3d
from numpy.typing import ArrayLike

from ..state import Floats

# What a ball is drawn by, from the back to the front: the part of its radius, how far towards the light, as a part of
# it too, and the part of its colour, beyond 1 towards white.
_LAYERS = ((1.0, 0.0, 0.55), (0.86, 0.08, 0.8), (0.68, 0.2, 1.0), (0.36, 0.38, 1.25), (0.16, 0.46, 1.6))
# The light comes from above on the left.
_LIGHT = -0.6, 0.8
# The edge of a disc [points], and the part of its colour.
_EDGE, _DARK = 0.4, 0.5
# Towards the eye, as a part of a radius, so that a ball is behind all of one that is nearer.
_NEARER = 1e-3
_POINTS = 72.0


class Discs(EllipseCollection):
    """Discs in the axes of a plane, at points (n, 2) [m]."""

    def __init__(self, axes: Any, points: Floats, radius: Floats, colour: Any) -> None:
        super().__init__(
            2.0 * radius, 2.0 * radius, np.zeros(len(radius)), units="xy", offsets=points,
            offset_transform=axes.transData, zorder=2, clip_on=False, linewidths=_EDGE,
        )  # fmt: skip
        self._count = len(radius)
        self.paint(colour)
        axes.add_collection(self, autolim=False)

    def paint(self, colour: Any) -> None:
        """Give them colours (n, 3), or one."""
        rows: Any = colours_of(colour, self._count)
        self.set_facecolor(rows)
        self.set_edgecolor(_DARK * rows)


class Balls(PathCollection):
    """Balls in 3-D axes, at points (n, 3) [m], whose sizes follow from where the axes are when they are drawn."""

    def __init__(self, axes: Any, points: Floats, radius: Floats, colour: Any) -> None:
        marker = MarkerStyle("o")
        path = marker.get_path().transformed(marker.get_transform())
        super().__init__((path,), np.ones(len(_LAYERS) * len(radius)), offset_transform=axes.transData, zorder=2,
                         linewidths=0.0, clip_on=False)  # fmt: skip
        self.set_transform(IdentityTransform())
        self._radius, self._points = radius, np.asarray(points)
        self._shades = np.empty((0, 3))
        self.paint(colour)
        axes.add_collection3d(self, autolim=False)

    def place(self, points: Floats) -> None:
        """Move them to points (n, 3) [m]."""
        self._points = points

    def paint(self, colour: Any) -> None:
        """Give them colours (n, 3), or one."""
        rows = colours_of(colour, len(self._radius))
        self._shades = np.stack([_shade(rows, part) for _size, _way, part in _LAYERS])

    def do_3d_projection(self) -> float:
        """Find where and how large the layers are, from the farthest ball to the nearest."""
        axes: Any = self.axes
        right, up, eye = _axes_of_view(axes)
        radius = self._radius[:, None]
        light = _LIGHT[0] * right + _LIGHT[1] * up
        places = np.stack([
            self._points + radius * (way * light + k * _NEARER * eye) for k, (_size, way, _part) in enumerate(_LAYERS)
        ])  # fmt: skip
        # Without perspective across the picture: where the middle of a ball is, so wide is it.
        middle, beside = (_on_screen(axes, one) for one in (self._points, self._points + radius * right))
        wide = np.sqrt(((beside - middle) ** 2).sum(axis=1)) * _POINTS / axes.get_figure(root=True).dpi
        x, y, depth = proj3d.proj_transform(*places.reshape(-1, 3).T, axes.get_proj())
        order = np.argsort(depth)[::-1]
        sizes = np.concatenate([(2.0 * size * wide) ** 2 for size, _way, _part in _LAYERS])
        self.set_offsets(np.ma.column_stack([x, y])[order])
        self.set_sizes(sizes[order])
        shades: Any = self._shades.reshape(-1, 3)[order]
        self.set_facecolor(shades)
        return float(np.min(depth)) if len(depth) else math.nan


def colours_of(colour: Any, n: int) -> Floats:
    """Colours (n, 3) from those, or from one."""
    rows: ArrayLike = [to_rgb(colour)] if isinstance(colour, str) else colour
    return np.broadcast_to(np.asarray(rows, np.float64)[:, :3], (n, 3))


def _shade(rows: Floats, part: float) -> Floats:
    """A part of colours, beyond 1 on the way to white."""
    return part * rows if part <= 1.0 else rows + (part - 1.0) * (1.0 - rows)


def _axes_of_view(axes: Any) -> tuple[Floats, Floats, Floats]:
    """The directions to the right, up, and towards the eye, of axes of equal scale."""
    turn, height = math.radians(axes.azim), math.radians(axes.elev)
    eye = np.array([math.cos(height) * math.cos(turn), math.cos(height) * math.sin(turn), math.sin(height)])
    right = np.array([-math.sin(turn), math.cos(turn), 0.0])
    return right, np.cross(eye, right), eye


def _on_screen(axes: Any, points: Floats) -> Floats:
    """Where points (n, 3) are in the picture [pixels]."""
    x, y, _depth = proj3d.proj_transform(*points.T, axes.get_proj())
    return np.asarray(axes.transData.transform(np.column_stack([x, y])))
