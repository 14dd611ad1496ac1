"""Where a formula may have a corner or a pole: cells that may hold one are halved until none does or too many do.

What counts is each root, power, quotient, log and tan as it was read, in the admissible part only: a particle is never
where phi is above 0. The argument of a piece has been simplified, which changes no value of it where the pieces within
it, checked in the same cells, are smooth.
"""

import itertools
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np

from ...errors import SceneError
from .. import base
from .expression import Piece
from .interval import Interval, bounds_of

# Cells along an edge at first, how often they are halved, and operations of one turn: seconds.
_CELLS, _HALVINGS, _MOST_WORK = 8, 14, 2**22
_REASONS = {
    "above 0": ("its argument may be 0 or below", ", or add a small constant, as in sqrt(x**2 + 1e-6)"),
    "not 0": ("it may divide by 0", ", or add a small constant, as in 1/(x**2 + 1e-6)"),
    "no pole": ("it may have a pole", ""),
}


def check_constants(pieces: Sequence[Piece]) -> None:
    """Raise if a piece of constants only has no value; inner pieces come first."""
    for piece in pieces:
        if piece.argument.is_number and not _is_smooth(piece, bounds_of(piece.argument, {}, {})):
            reason = _REASONS[piece.wanted][0]
            raise SceneError(f"phi must be smooth, got {piece.place}, where {reason} with these parameters")


def check(
    pieces: Sequence[Piece], level: Any, axes: Sequence[Any], side: float, box: base.Box | None, scale: float
) -> None:
    """Raise unless every piece is smooth wherever side * level may be 0 or below in a box.

    Args:
        pieces: inner ones first.
        level: phi as an expression.
        axes: the symbols of its coordinates.
        side: +1 or -1.
        box: None for all of space.
        scale: a length to begin with where there is no box.
    """
    import sympy

    pieces = [piece for piece in pieces if piece.argument.free_symbols]
    if not pieces:
        return
    slopes = [[sympy.diff(piece.argument, axis) for axis in axes] for piece in pieces]
    work = 1 + int(sympy.count_ops([level, *(piece.argument for piece in pieces), *itertools.chain(*slopes)]))
    ends = np.linspace(-1.0, 1.0, _CELLS + 1)
    corners = tuple(np.array(list(itertools.product(part, repeat=3))).T for part in (ends[:-1], ends[1:]))
    for halving in range(_HALVINGS):
        if halving:
            corners = _halved(*corners)
        rough = np.array(
            [
                _rough(piece, slope, axes, _placed(corners, box, scale))
                for piece, slope in zip(pieces, slopes, strict=True)
            ]
        )
        corners, rough = _chosen(corners, rough, rough.any(axis=0))
        phi = bounds_of(level, _cells(axes, _placed(corners, box, scale)), {})
        above = (phi.low if side > 0.0 else -phi.high) + 0.0 * corners[0][0] > 0.0
        corners, rough = _chosen(corners, rough, ~above)
        if not rough.size:
            return
        if 8 * rough.shape[1] * work > _MOST_WORK:
            break
    i = int(np.argmax(rough.any(axis=1)))
    corners, _rest = _chosen(corners, rough, rough[i])
    nearest = np.abs(corners[0] + corners[1]).max(axis=0).argmin()
    _refuse(pieces[i], [end[:, nearest] for end in _placed(corners, box, scale)])


def _rough(piece: Piece, slopes: Sequence[Any], axes: Sequence[Any], places: Any) -> Any:
    """In which cells a piece may be other than smooth."""
    cells, (low, high) = _cells(axes, places), places
    whole = bounds_of(piece.argument, cells, {})
    # f(r) = f(m) + grad f.(r - m), m the middle: closer for small cells where a coordinate occurs twice.
    with np.errstate(invalid="ignore"):
        middle = 0.5 * (low + high)
    centred, known = bounds_of(piece.argument, _cells(axes, (middle, middle)), {}), dict[Any, Interval]()
    for cell, m, slope in zip(cells.values(), middle, slopes, strict=True):
        with np.errstate(invalid="ignore"):
            centred = centred + bounds_of(slope, cells, known) * (cell + Interval(-m, -m))
    argument = Interval(np.maximum(whole.low, centred.low), np.minimum(whole.high, centred.high))
    return ~_is_smooth(piece, argument) | np.zeros(low.shape[1], dtype=bool)


def _is_smooth(piece: Piece, argument: Interval) -> Any:
    if piece.wanted == "above 0":
        return argument.low > 0.0
    if piece.wanted == "not 0":
        return (argument.low > 0.0) | (argument.high < 0.0)
    tangent = argument.tan()
    return np.isfinite(tangent.low) & np.isfinite(tangent.high)


def _placed(corners: Any, box: base.Box | None, scale: float) -> tuple[Any, Any]:
    """The corners of cells in a box from those in a cube from -1 to 1."""
    if box is None:
        # All of space is in the cube: its faces are infinitely far.
        with np.errstate(divide="ignore"):
            return tuple(scale * end / (1.0 - np.abs(end)) for end in corners)  # type: ignore[return-value]
    low, high = np.array(box)[:, :, None]
    return tuple(0.5 * ((1.0 - end) * low + (1.0 + end) * high) for end in corners)  # type: ignore[return-value]


def _cells(axes: Sequence[Any], places: Any) -> dict[Any, Interval]:
    return {axis: Interval(*ends) for axis, *ends in zip(axes, *places, strict=True)}


def _chosen(corners: Any, rough: Any, mask: Any) -> tuple[Any, Any]:
    return tuple(end[:, mask] for end in corners), rough[:, mask]


def _halved(lower: Any, upper: Any) -> tuple[Any, Any]:
    edges = np.array([lower, 0.5 * (lower + upper), upper])
    parts = np.array(list(itertools.product((0, 1), repeat=3))).T[:, :, None]
    rows, cells = np.arange(3)[:, None, None], np.arange(lower.shape[1])
    return tuple(edges[parts + end, rows, cells].reshape(3, -1) for end in (0, 1))  # type: ignore[return-value]


def _refuse(piece: Piece, ends: Any) -> NoReturn:
    where = ", ".join(
        "0" if low <= 0.0 <= high else f"{0.5 * (low + high):.3g}" for low, high in zip(*ends, strict=True)
    )
    reason, fix = _REASONS[piece.wanted]
    raise SceneError(
        f"phi must be smooth wherever particles go, got {piece.place}, where {reason} near ({where}); "
        f"give bounds that leave this out{fix}"
    )
