"""Particles in a scene of two dimensions, from above: walls as lines, the inside light, solids filled."""

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from ..plane import along, shown_as
from ..state import Floats
from .balls import Discs
from .shape import Shape
from .style import CAVITY, CAVITY_LINE, SOLID, SOLID_LINE
from .triad import INK

_FEW_WIRES = 300
# Around a vessel, as a part of its width.
_ROOM = 0.02
# Ends of curves so near to each other, as a part of the width of all, are one point.
_SAME = 2e-3


def ends_in_plane(across: int, found: list[Floats]) -> tuple[Floats, Floats]:
    """The lower left and the upper right corner of what is seen of points, with room in directions without any."""
    seen = np.concatenate([shown_as(across, one) for one in found])
    low, high = seen.min(axis=0), seen.max(axis=0)
    wide, far = float((high - low).max()), float(np.abs(seen).max())
    # All at one point: the room is as large as its distance from the origin, so that round-off does not take it.
    room = wide if wide > 1e-9 * far else far or 1.0
    none = np.where(high - low <= 1e-9 * room, 0.5 * room, 0.0)
    return low - none, high + none


def flat(
    axes: Any, across: int, points: Floats, colour: Any, shapes: list[Shape],
    found: list[Floats] | None = None, radius: Floats | None = None,
) -> tuple[Any, list[Any]]:  # fmt: skip
    """Particles (N, 3), or discs of a `radius`, and walls, in axes of their plane around the points that are `found`.

    Returns the artists of the particles, and those of the walls.
    """
    if found is None:
        some = [np.concatenate(shape.edges) for shape in shapes if shape.edges]
        there = points[~np.isnan(points[:, 0])]
        found = some if any(shape.edges and not shape.solid for shape in shapes) else [*some, there]
    found = [one for one in found if len(one)] or [np.zeros((1, 3))]
    low, high = ends_in_plane(across, found)
    room = _ROOM * float((high - low).max())
    drawn = draw_walls(axes, across, shapes, float((high - low).max()))
    dot = float(np.clip(2.5e4 / max(1, len(points)), 0.3, 24.0))
    dots: Any = None
    if radius is None:
        dots = axes.scatter(*shown_as(across, points).T, c=colour, s=dot, linewidths=0.0, zorder=2)
    else:
        dots = Discs(axes, shown_as(across, points), radius, colour)
    axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room), aspect="equal")
    for axis, k in zip((axes.xaxis, axes.yaxis), along(across), strict=True):
        axis.set_major_locator(MaxNLocator(5, min_n_ticks=2))
        axis.set_tick_params(colors=INK, labelsize=8)
        axis.set_label_text(f"{'xyz'[k]} [m]", fontsize=9, color=INK)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return dots, drawn


def draw_walls(axes: Any, across: int, shapes: list[Shape], wide: float) -> list[Any]:
    """Walls as lines; what is within closed ones is light, what is within solids filled. Returns the artists."""
    drawn: list[Any] = []
    lines = {
        solid: [shown_as(across, c) for s in shapes if s.solid == solid for c in s.edges] for solid in (False, True)
    }
    for solid, inside in ((False, CAVITY), (True, SOLID)):
        closed = _loops(lines[solid], _SAME * wide)
        if closed:
            path = Path.make_compound_path(*(Path(loop, closed=True) for loop in closed))
            alpha = 1.0 if solid else 0.28
            drawn.append(axes.add_patch(PathPatch(path, facecolor=inside, edgecolor="none", alpha=alpha,
                                                  zorder=0.6 if solid else 0.5)))  # fmt: skip
        if lines[solid]:
            few = min(1.0, (_FEW_WIRES / len(lines[solid])) ** 0.35)
            drawn.append(LineCollection(
                lines[solid], colors=SOLID_LINE if solid else CAVITY_LINE, linewidths=1.7 * few, zorder=3,
                capstyle="round", joinstyle="round",
            ))  # fmt: skip
            axes.add_collection(drawn[-1], autolim=False)
    return drawn


def _loops(lines: list[Floats], same: float) -> list[Floats]:
    """The closed curves that lines form whose ends are so near to each other [m]."""
    alone = [line for line in lines if len(line) > 2 and np.abs(line[0] - line[-1]).max() <= same]
    others = [line for line in lines if len(line) > 1 and np.abs(line[0] - line[-1]).max() > same]
    found = list(alone)
    while others:
        loop = others.pop()
        while others and np.abs(loop[0] - loop[-1]).max() > same:
            ends = np.array([(one[0], one[-1]) for one in others])
            far = np.abs(ends - loop[-1]).max(axis=2)
            k, end = np.unravel_index(far.argmin(), far.shape)
            if far[k, end] > same:
                break
            one = others.pop(int(k))
            loop = np.concatenate([loop, one[::-1] if end else one])
        if len(loop) > 2 and np.abs(loop[0] - loop[-1]).max() <= same:
            found.append(loop)
    return found
