"""Drawing with matplotlib for contact sheets, plots and films: particles among their walls."""

import math
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from numpy.typing import ArrayLike

from ..plane import along, shown_as
from ..state import Floats
from .balls import Balls, Discs
from .colours import Colours
from .style import CAVITY_LINE, MAP, SOLID_LINE

LIGHT = "#5a5a62"
_FEW_WIRES = 300
# A direction in which a picture extends by less than this part of its widest one is drawn as flat.
_FLAT = 1e-9
# Around a vessel that is seen from above, as a part of its width.
_ROOM = 0.02
# Matplotlib leaves room around 3-D axes: with this zoom a cube fills its cell, seen from where it is by default.
_ZOOM, _AZIMUTH, _ELEVATION = 1.15, math.radians(-60.0), math.radians(30.0)
# What a width, a depth and a height add to the width and to the height of the picture.
_SEEN = np.abs(
    [
        [math.sin(_AZIMUTH), math.cos(_AZIMUTH), 0.0],
        [math.sin(_ELEVATION) * math.cos(_AZIMUTH), math.sin(_ELEVATION) * math.sin(_AZIMUTH), math.cos(_ELEVATION)],
    ]
)


def red_green_blue(packed: Colours) -> Floats:
    """0xRRGGBBAA as three numbers from 0 to 1: (N, 3)."""
    return np.stack([(packed >> shift & 0xFF) / 255.0 for shift in (24, 16, 8)], axis=1)


def ties(axes: Any, lines: tuple[Floats, Colours], faces: tuple[Floats, Colours]) -> list[Any]:
    """The faces of bodies, or else their lines, if there are any; returns their artists.

    Lines (S, 2, 3), wider the fewer there are, have colours (S,), 0xRRGGBBAA; triangles (T, 3, 3), which are shaded,
    have those of their corners (T, 3).
    """
    style: dict[str, Any] = {"zorder": 2, "clip_on": False}
    drawn: list[Any] = []
    if len(faces[0]):
        colour = red_green_blue(faces[1].ravel()).reshape(-1, 3, 3).mean(axis=1)
        drawn.append(Poly3DCollection(faces[0], facecolors=colour, shade=True, **style))
    elif len(lines[0]):
        width = float(np.clip(300.0 / len(lines[0]), 0.9, 2.0))
        drawn.append(Line3DCollection(lines[0], colors=red_green_blue(lines[1]), linewidths=width, **style))
    for one in drawn:
        axes.add_collection3d(one, autolim=False)
    return drawn


def frame(
    axes: Any,
    points: Floats,
    packed: Colours,
    wires: list[tuple[bool, list[Floats]]],
    lines: tuple[Floats, Colours],
    faces: tuple[Floats, Colours],
    across: int | None = None,
    radius: Floats | None = None,
) -> None:
    """A frame: `particles` of colours 0xRRGGBBAA, which bodies with faces do not show, and their `ties`.

    `across` is the axis across the plane of a scene of two dimensions, whose axes are `view`s of it; `radius` of balls
    (n,) [m].
    """
    if across is not None:
        flat(axes, across, points, red_green_blue(packed), wires, radius=radius)
        return
    particles(axes, points, red_green_blue(packed), wires, 0.0 if len(faces[0]) else 1.0, radius=radius)
    ties(axes, lines, faces)


def particles(
    axes: Any,
    positions: ArrayLike,
    colour: Any,
    wires: list[tuple[bool, list[Floats]]],
    size: float = 1.0,
    box: tuple[Floats, Floats] | None = None,
    radius: Floats | None = None,
) -> tuple[Any, list[Any]]:
    """Particles (N, 3) and the wire frames of the walls, of solids in their own colour, in 3-D axes of equal scale.

    The dots of particles are smaller the more there are; `size` enlarges them, and 0 shows none; balls have their
    `radius` (N,) [m]. The axes end at the corners of the box; None: around all that is drawn. Returns the artists of
    the dots, or the balls, and of the wires of each wall.
    """
    points = np.asarray(positions)
    axes.computed_zorder = False  # the particles would hide the solids among them
    drawn = []
    for solid, curves in wires:
        # Of thousands of solids no particle would be seen behind the wires.
        few = min(1.0, (_FEW_WIRES / max(1, len(curves))) ** 0.35)
        style = (
            {"colors": SOLID_LINE, "linewidths": 0.9 * few, "alpha": 0.7 * few, "zorder": 3 if few == 1.0 else 1}
            if solid
            else {"colors": CAVITY_LINE, "linewidths": 0.5, "alpha": 0.7}
        )
        # Corners of a box reach beyond the cell at this zoom.
        drawn.append(Line3DCollection(curves, clip_on=False, **style))
        axes.add_collection3d(drawn[-1], autolim=False)
    dot = size * float(np.clip(3e4 / len(points), 0.3, 1000.0)) ** 0.5
    dots: Any = None
    if radius is None:
        dots = axes.scatter(*points.T, c=colour, s=dot, linewidths=0.0, depthshade=False, zorder=2, clip_on=False)
    else:
        dots = Balls(axes, points, radius, colour)
    low, high = _roomy(*(around(points, wires, radius) if box is None else box))
    for axis, a, b in zip((axes.xaxis, axes.yaxis, axes.zaxis), low, high, strict=True):
        axis.set_pane_color((0.0, 0.0, 0.0, 0.0))
        axis.line.set_color(LIGHT)
        axis.set_tick_params(colors=LIGHT, labelsize=7, pad=-1)
        axis.label.set_color(LIGHT)
        axis.set_major_locator(MaxNLocator(3))
        axis.set_view_interval(a, b)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_xlabel("x [m]", labelpad=-4, fontsize=8)
    axes.set_ylabel("y [m]", labelpad=-4, fontsize=8)
    # At the end of its axis: beside it, it would lie beyond the cell.
    axes.text(*high, "z [m]\n", fontsize=8, color=LIGHT, ha="center", va="bottom", linespacing=0.3)
    # Matplotlib draws boxes of one diagonal in one size.
    relative = (high - low) / np.sqrt(((high - low) ** 2).mean())
    axes.set_box_aspect(high - low, zoom=_ZOOM * (_SEEN.sum(axis=1) / (_SEEN @ relative)).min())
    axes.grid(False)
    return dots, drawn


def view(figure: Any, across: int | None, *place: int) -> Any:
    """Axes for particles among their walls: 3-D ones, or those of a plane across an axis, seen from above."""
    return figure.add_subplot(*place, projection="3d" if across is None else None)


def flat(
    axes: Any, across: int, positions: ArrayLike, colour: Any, wires: list[tuple[bool, list[Floats]]],
    box: tuple[Floats, Floats] | None = None, radius: Floats | None = None,
) -> tuple[Any, list[Any]]:  # fmt: skip
    """`particles` of a scene of two dimensions, in axes of its plane, in which the picture fits the vessel."""
    points, drawn = np.asarray(positions), []
    for solid, curves in wires:
        few = min(1.0, (_FEW_WIRES / max(1, len(curves))) ** 0.35)
        drawn.append(
            LineCollection(
                [shown_as(across, curve) for curve in curves], colors=SOLID_LINE if solid else CAVITY_LINE,
                linewidths=1.6 * few, zorder=3, capstyle="round", clip_on=False,
            )
        )  # fmt: skip
        axes.add_collection(drawn[-1], autolim=False)
    dot = float(np.clip(3e4 / len(points), 0.3, 300.0)) ** 0.5
    dots: Any = None
    if radius is None:
        dots = axes.scatter(*shown_as(across, points).T, c=colour, s=dot, linewidths=0.0, zorder=2, clip_on=False)
    else:
        dots = Discs(axes, shown_as(across, points), radius, colour)
    low, high = (shown_as(across, one) for one in _roomy(*(around(points, wires, radius) if box is None else box)))
    room = _ROOM * (high - low).max()
    names = ["xyz"[k] for k in along(across)]
    axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room), aspect="equal")
    for axis, name in zip((axes.xaxis, axes.yaxis), names, strict=True):
        axis.set_major_locator(MaxNLocator(5))
        axis.set_tick_params(colors=LIGHT, labelsize=8)
        axis.set_label_text(f"{name} [m]", fontsize=9, color=LIGHT)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return dots, drawn


def around(
    points: Floats, wires: list[tuple[bool, list[Floats]]], radius: Floats | None = None
) -> tuple[Floats, Floats]:
    """The corners of the box around points (N, 3), or balls of a `radius`, and wires."""
    ends = [points] if radius is None else [points - radius[:, None], points + radius[:, None]]
    corners = np.vstack([*ends, *(curve for _solid, curves in wires for curve in curves)])
    corners = corners[~np.isnan(corners[:, 0])]
    if not len(corners):
        return np.zeros(3), np.zeros(3)
    return corners.min(axis=0), corners.max(axis=0)


def _roomy(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """The box, with room in directions in which it has none: axes between equal limits cannot be drawn."""
    low, high = low.astype(np.float64), high.astype(np.float64)
    wide, far = high - low, max(abs(low).max(), abs(high).max())
    # All at one point: the room is as large as its distance from the origin, so that round-off does not take it.
    room = wide.max() if wide.max() > _FLAT * far else far or 1.0
    flat = np.where(wide <= _FLAT * room, 0.5 * room, 0.0)
    return low - flat, high + flat


def colour_bar(figure: Any, axes: Any, quantity: str, low: float, high: float) -> None:
    """A colour bar for the particles, below these axes."""
    meaning = ScalarMappable(Normalize(low, high), MAP)
    bar = figure.colorbar(meaning, ax=axes, location="bottom", shrink=0.5, aspect=40, pad=0.02)
    bar.set_label(f"colour: {quantity}", color=LIGHT, fontsize=9)
    bar.ax.tick_params(colors=LIGHT, labelsize=8)
