"""Interval arithmetic: bounds that hold for every point of many cells at once, and where a formula is surely smooth."""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np

from ...errors import SceneError
from ...state import Floats
from ..surface import Box
from .expression import NonSmoothTerm

# The functions of the system's library are less inexact than this.
_ULPS = 4


class Interval:
    """[low, high] in each element, rounded outward; an unknown interval is [-inf, inf]."""

    def __init__(self, low: Any, high: Any) -> None:
        self.low, self.high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)

    def __add__(self, other: "Interval") -> "Interval":
        return _wider(self.low + other.low, self.high + other.high, 1)

    def __mul__(self, other: "Interval") -> "Interval":
        with np.errstate(invalid="ignore"):
            products = np.array(
                np.broadcast_arrays(*(a * b for a in (self.low, self.high) for b in (other.low, other.high)))
            )
        # 0 x inf is 0: an endless interval holds finite numbers only, and 0 times each of them is 0.
        products = np.where(np.isnan(products), 0.0, products)
        return _wider(products.min(axis=0), products.max(axis=0), 1)

    def inverse(self) -> "Interval":
        """1/[low, high]"""
        with np.errstate(divide="ignore"):
            low, high = 1.0 / self.high, 1.0 / self.low
        # A zero at one end leaves a half line, a zero between the ends the whole line.
        whole = (self.low == 0.0) & (self.high == 0.0)
        low = np.where(whole | ((self.low < 0.0) & (self.high >= 0.0)), -np.inf, low)
        high = np.where(whole | ((self.low <= 0.0) & (self.high > 0.0)), np.inf, high)
        return _wider(low, high, 1)

    def power(self, n: int) -> "Interval":
        """[low, high]**n for a whole n."""
        if n < 0:
            return self.power(-n).inverse()
        if n % 2:
            return self.monotonic(lambda x: x**n)
        wide = self.monotonic(lambda x: x**n, bottom=0.0)
        return Interval(np.maximum(wide.low, 0.0), wide.high)

    def monotonic(self, function: Callable[[Floats], Any], bottom: float | None = None) -> "Interval":
        """Return the interval of a function that is monotonic or, with `bottom`, rises from it to both sides of 0."""
        with np.errstate(divide="ignore"):
            a, b = function(self.low), function(self.high)
        low = np.minimum(a, b)
        if bottom is not None:
            low = np.where((self.low <= 0.0) & (self.high >= 0.0), bottom, low)
        return _wider(low, np.maximum(a, b), _ULPS)

    def above_zero(self, function: Callable[[Floats], Any]) -> "Interval":
        """A monotonic function that is defined from 0 on; the bounds are infinite where all numbers are below 0."""
        found = Interval(np.maximum(self.low, 0.0), np.maximum(self.high, 0.0)).monotonic(function)
        known = self.high >= 0.0
        return Interval(np.where(known, found.low, -np.inf), np.where(known, found.high, np.inf))

    def cos(self) -> "Interval":
        """Return the cosine."""
        with np.errstate(invalid="ignore"):
            a, b = np.cos(self.low), np.cos(self.high)
        low = np.where(self._passes(math.pi, 2.0 * math.pi), -1.0, np.fmin(a, b))
        wide = _wider(low, np.where(self._passes(0.0, 2.0 * math.pi), 1.0, np.fmax(a, b)), _ULPS)
        return Interval(np.maximum(wide.low, -1.0), np.minimum(wide.high, 1.0))

    def sin(self) -> "Interval":
        """Return the sine, by the cosine; wider by the round-off of an argument near 1."""
        cos = (self + Interval(-0.5 * math.pi, -0.5 * math.pi)).cos()
        slack = 1e-15 * (1.0 + np.maximum(np.abs(cos.low), np.abs(cos.high)))
        return Interval(cos.low - slack, cos.high + slack)

    def tan(self) -> "Interval":
        """Return the tangent; unknown in a cell with a pole."""
        pole = self._passes(0.5 * math.pi, math.pi)
        with np.errstate(invalid="ignore"):
            a, b = np.tan(self.low), np.tan(self.high)
        return _wider(np.where(pole, -np.inf, a), np.where(pole, np.inf, b), _ULPS)

    def _passes(self, start: float, period: float) -> Any:
        """Whether start + k period is in the interval; true where that is uncertain."""
        slack = 1e-12 * (1.0 + np.maximum(np.abs(self.low), np.abs(self.high)))
        with np.errstate(invalid="ignore"):
            first = np.ceil((self.low - slack - start) / period) * period + start
            return ~(first > self.high + slack)


def _wider(low: Any, high: Any, ulps: int) -> Interval:
    low, high = np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
    for _ in range(ulps):
        low, high = np.nextafter(low, -np.inf), np.nextafter(high, np.inf)
    return Interval(low, high)


def bounds_of(expression: Any, known: dict[Any, Interval]) -> Interval:
    """Return the bounds of a SymPy expression by those of its symbols; `known` also keeps those of its parts."""
    if expression not in known:
        with np.errstate(over="ignore"):
            known[expression] = _bounds_of(expression, known)
    return known[expression]


def _bounds_of(expression: Any, known: dict[Any, Interval]) -> Interval:
    if expression.is_number:
        return Interval(float(expression), float(expression))
    first, *rest = (bounds_of(part, known) for part in expression.args)
    if expression.is_Add or expression.is_Mul:
        for part in rest:
            first = first + part if expression.is_Add else first * part
        return first
    if expression.is_Pow and expression.exp.is_number:
        power = expression.exp
        return first.power(int(power)) if power.is_Integer else first.above_zero(lambda x: x ** float(power))
    name = expression.func.__name__
    if name in ("sin", "cos", "tan"):
        return getattr(first, name)()  # type: ignore[no-any-return]
    if name == "log":
        return first.above_zero(np.log)
    assert name in ("exp", "sinh", "cosh", "tanh"), name
    return first.monotonic(getattr(np, name), bottom=1.0 if name == "cosh" else None)


class IntervalBoxes:
    """Many boxes, in which expressions of their axes are bounded: corners (3, cells)."""

    def __init__(self, axes: Sequence[Any], lower: Floats, upper: Floats) -> None:
        self.lower, self.upper = lower, upper
        self._cells = {axis: Interval(*ends) for axis, *ends in zip(axes, lower, upper, strict=True)}
        self._known = dict(self._cells)

    @classmethod
    def grid(cls, axes: Sequence[Any], box: Any, shape: Any) -> "IntervalBoxes":
        """Return a box cut into `shape` cells along its edges."""
        low, high = np.array(box)[:, :, None, None, None]
        index, counts = np.indices(tuple(shape)), np.array(shape)[:, None, None, None]
        lower, upper = ((low + (high - low) * ((index + end) / counts)).reshape(3, -1) for end in (0, 1))
        return cls(axes, lower, upper)

    def bounds(self, expression: Any) -> Interval:
        """Return the bounds of an expression in each cell."""
        found = bounds_of(expression, self._known)
        return Interval(*(np.broadcast_to(end, self.lower[0].shape) for end in (found.low, found.high)))

    def centred(self, expression: Any, gradient: Sequence[Any]) -> Interval:
        """`bounds` by f(m) + grad f.(r - m), m the middle: closer for small cells where a coordinate occurs twice."""
        with np.errstate(invalid="ignore"):
            middle = 0.5 * (self.lower + self.upper)
            found = IntervalBoxes(tuple(self._cells), middle, middle).bounds(expression)
            for cell, m, slope in zip(self._cells.values(), middle, gradient, strict=True):
                found = found + self.bounds(slope) * (cell + Interval(-m, -m))
        return found

    def may_be_admissible(self, phi: Any, side: float) -> Any:
        """Whether side * phi may be 0 or below in each cell."""
        level = self.bounds(phi)
        return ~((level.low if side > 0.0 else -level.high) > 0.0)


# --- Where a formula may have a corner or a pole ---------------------------------------------------------

# Cells along an edge at first, the most halvings, and the operations of one turn: seconds.
_CELLS, _HALVINGS, _MOST_WORK = 8, 14, 2**22
_REASONS = {
    "above 0": ("its argument may be 0 or below", ", or add a small constant, as in sqrt(x**2 + 1e-6)"),
    "not 0": ("it may divide by 0", ", or add a small constant, as in 1/(x**2 + 1e-6)"),
    "no pole": ("it may have a pole", ""),
}


def check_constants(pieces: Sequence[NonSmoothTerm]) -> None:
    """Raise if a piece of constants only has no value; inner pieces come first."""
    for piece in pieces:
        if piece.argument.is_number and not _is_smooth(piece, bounds_of(piece.argument, {})):
            reason = _REASONS[piece.wanted][0]
            raise SceneError(f"phi must be smooth, got {piece.place}, where {reason} with these parameters")


def check_smooth(
    pieces: Sequence[NonSmoothTerm], phi: Any, axes: Sequence[Any], side: float, box: Box | None, scale: float
) -> None:
    """Raise unless every piece is surely smooth wherever side * phi may be 0 or below in a box.

    Cells that may hold a corner or a pole are halved until no such cell is left, or too many are. Each root, power,
    quotient, log and tan counts as it was read. The argument of a piece has been simplified, which does not change its
    value where the pieces within it, checked in the same cells, are smooth.

    Args:
        pieces: inner ones first.
        phi: as an expression.
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
    work = 1 + int(sympy.count_ops([phi, *(piece.argument for piece in pieces), *itertools.chain(*slopes)]))
    unit = IntervalBoxes.grid(axes, ((-1.0,) * 3, (1.0,) * 3), (_CELLS,) * 3)
    lower, upper = unit.lower, unit.upper
    for halving in range(_HALVINGS):
        if halving:
            lower, upper = _halved(lower, upper)
        cells = IntervalBoxes(axes, *_placed((lower, upper), box, scale))
        rough = np.array([_may_be_rough(*pair, cells) for pair in zip(pieces, slopes, strict=True)])
        kept = rough.any(axis=0) & cells.may_be_admissible(phi, side)
        lower, upper, rough = lower[:, kept], upper[:, kept], rough[:, kept]
        if not rough.size:
            return
        if 8 * rough.shape[1] * work > _MOST_WORK:
            break
    i = int(np.argmax(rough.any(axis=1)))
    lower, upper = lower[:, rough[i]], upper[:, rough[i]]
    nearest = np.abs(lower + upper).max(axis=0).argmin()
    _refuse(pieces[i], [end[:, nearest] for end in _placed((lower, upper), box, scale)])


def _may_be_rough(piece: NonSmoothTerm, slopes: Sequence[Any], cells: IntervalBoxes) -> Any:
    """Whether a piece may be other than smooth in each cell."""
    whole, centred = cells.bounds(piece.argument), cells.centred(piece.argument, slopes)
    return ~_is_smooth(piece, Interval(np.maximum(whole.low, centred.low), np.minimum(whole.high, centred.high)))


def _is_smooth(piece: NonSmoothTerm, argument: Interval) -> Any:
    if piece.wanted == "above 0":
        return argument.low > 0.0
    if piece.wanted == "not 0":
        return (argument.low > 0.0) | (argument.high < 0.0)
    tangent = argument.tan()
    return np.isfinite(tangent.low) & np.isfinite(tangent.high)


def _placed(corners: tuple[Floats, Floats], box: Box | None, scale: float) -> tuple[Floats, ...]:
    """Return the corners of cells in a box from those in a cube from -1 to 1."""
    if box is None:
        # All of space is in the cube: its faces are infinitely far
        with np.errstate(divide="ignore"):
            return tuple(scale * end / (1.0 - np.abs(end)) for end in corners)
    low, high = np.array(box)[:, :, None]
    return tuple(0.5 * ((1.0 - end) * low + (1.0 + end) * high) for end in corners)


def _halved(lower: Floats, upper: Floats) -> tuple[Floats, ...]:
    """Return each cell as eight."""
    edges = np.array([lower, 0.5 * (lower + upper), upper])
    parts = np.array(list(itertools.product((0, 1), repeat=3))).T[:, :, None]
    rows, cells = np.arange(3)[:, None, None], np.arange(lower.shape[1])
    return tuple(edges[parts + end, rows, cells].reshape(3, -1) for end in (0, 1))


def _refuse(piece: NonSmoothTerm, ends: Any) -> NoReturn:
    where = ", ".join(
        "0" if low <= 0.0 <= high else f"{0.5 * (low + high):.3g}" for low, high in zip(*ends, strict=True)
    )
    reason, fix = _REASONS[piece.wanted]
    raise SceneError(
        f"phi must be smooth wherever particles go, got {piece.place}, where {reason} near ({where}); "
        f"give bounds that leave this out{fix}"
    )
