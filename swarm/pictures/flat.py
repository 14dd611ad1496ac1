"""Particles in a scene of two dimensions, from above: walls as lines, the inside light, solids filled."""

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from ..state import Floats
from ..surfaces.plane import along, shown_as
from ..triangles.shape import Shape
from .balls import Discs, size_of_dots
from .framed import near_most
from .style import CAVITY, CAVITY_LINE, SOLID, SOLID_LINE
from .triad import INK, say_beyond

_FEW_WIRES = 300
# The margin around a vessel, as a part of its width.
_ROOM = 0.02
# Ends of curves at a smaller distance, as a part of the total width, are one point.
_SAME = 2e-3
# An opening is at most this part of the length of the wall around it.
_OPEN = 0.34
# Steps between labels on the longer side.
_TICKS = 5


def ends_in_plane(across: int, found: list[Floats]) -> tuple[Floats, Floats]:
    """The lower left and the upper right corner of points in the plane, with room in directions without extent."""
    seen = np.concatenate([shown_as(across, one) for one in found])
    low, high = seen.min(axis=0), seen.max(axis=0)
    wide, far = float((high - low).max()), float(np.abs(seen).max())
    # If all points coincide, the room is their distance from the origin, so that round-off does not remove it.
    room = wide if wide > 1e-9 * far else far or 1.0
    none = np.where(high - low <= 1e-9 * room, 0.5 * room, 0.0)
    return low - none, high + none


def flat(
    axes: Any, across: int, points: Floats, colour: Any, shapes: list[Shape],
    found: list[Floats] | None = None, radius: Floats | None = None,
) -> tuple[Any, list[Any]]:  # fmt: skip
    """Draw particles (N, 3), or discs of a `radius`, and walls, in axes of their plane around the points `found`.

    Return the artists of the particles, and those of the walls.
    """
    if found is None:
        some = [np.concatenate(shape.edges) for shape in shapes if shape.edges]
        there = near_most(points[~np.isnan(points[:, 0])])
        found = some if any(shape.edges and not shape.solid for shape in shapes) else [*some, there]
    found = [one for one in found if len(one)] or [np.zeros((1, 3))]
    low, high = ends_in_plane(across, found)
    room = _ROOM * float((high - low).max())
    drawn = draw_walls(axes, across, shapes, float((high - low).max()))
    dots: Any = None
    at = shown_as(across, points)
    if radius is None:
        dots = axes.scatter(*at.T, c=colour, s=size_of_dots(len(points)), linewidths=0.0, zorder=2)
    else:
        dots = Discs(axes, at, radius, colour)
    low, high = low - room, high + room
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    say_beyond(axes, int(((at < low) | (at > high)).any(axis=1).sum()))
    parts = (high - low) / (high - low).max()
    for axis, k, part in zip((axes.xaxis, axes.yaxis), along(across), parts.tolist(), strict=True):
        # A narrow picture has room for few labels below it: the other axis shows the scale.
        steps = max(1, round(_TICKS * part))
        axis.set_major_locator(MaxNLocator(steps, min_n_ticks=min(steps, 2)))
        axis.set_tick_params(colors=INK, labelsize=8)
        axis.set_label_text(f"{'xyz'[k]} [m]", fontsize=9, color=INK)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return dots, drawn


def draw_walls(axes: Any, across: int, shapes: list[Shape], wide: float) -> list[Any]:
    """Draw walls as lines, the inside of closed ones light and solids filled; return the artists."""
    drawn: list[Any] = []
    lines = {
        solid: [shown_as(across, c) for s in shapes if s.solid == solid for c in s.edges] for solid in (False, True)
    }
    for solid, inside in ((False, CAVITY), (True, SOLID)):
        closed = _loops(lines[solid], _SAME * wide, 0.0 if solid else _OPEN)
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


def _loops(lines: list[Floats], same: float, opened: float) -> list[Floats]:
    """The closed curves of lines with ends at most `same` apart [m], or with the ends of an opening.

    An opening is at most the part `opened` of the length of the lines that it joins.
    """
    chains = [line for line in lines if len(line) > 1]
    found = [line for line in chains if len(line) > 2 and _apart(line[0], line[-1]) <= same]
    chains = _chained([line for line in chains if _apart(line[0], line[-1]) > same], same)
    if opened:
        chains = _across_openings(chains, opened)
    return found + [one for one in chains if len(one) > 2 and _apart(one[0], one[-1]) <= same]


def _apart(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).max())


def _chained(others: list[Floats], same: float) -> list[Floats]:
    """Lines joined into chains where their ends are at most `same` apart [m]."""
    found = []
    while others:
        chain = others.pop()
        turned = False
        while others and _apart(chain[0], chain[-1]) > same:
            ends = np.array([(one[0], one[-1]) for one in others])
            far = np.abs(ends - chain[-1]).max(axis=2)
            k, end = np.unravel_index(far.argmin(), far.shape)
            if far[k, end] > same:
                if turned:
                    break
                chain, turned = chain[::-1], True
                continue
            one = others.pop(int(k))
            chain = np.concatenate([chain, one[::-1] if end else one])
        found.append(chain)
    return found


def _across_openings(chains: list[Floats], opened: float) -> list[Floats]:
    """Join chains from end to end, the nearest ends first, where an opening is short relative to them."""
    ready, chains = list[Floats](), list(chains)
    while chains and len(chains) <= _FEW_WIRES:
        ends = np.array([(one[0], one[-1]) for one in chains]).reshape(-1, 2)
        far = np.sqrt(((ends[:, None] - ends) ** 2).sum(axis=2))
        np.fill_diagonal(far, np.inf)
        i, j = sorted(int(k) for k in np.unravel_index(far.argmin(), far.shape))
        one, other = chains[i // 2], chains[j // 2]
        within = _length(one) + (_length(other) if i // 2 != j // 2 else 0.0)
        if far[i, j] > opened * within:
            break
        chains = [chain for k, chain in enumerate(chains) if k not in (i // 2, j // 2)]
        if i // 2 == j // 2:
            ready.append(np.concatenate([one, one[:1]]))
        else:
            chains.append(np.concatenate([one if i % 2 else one[::-1], other[::-1] if j % 2 else other]))
    return ready + chains


def _length(chain: Floats) -> float:
    return float(np.sqrt((np.diff(chain, axis=0) ** 2).sum(axis=1)).sum())
