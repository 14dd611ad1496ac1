"""What is derived from a formula: derivatives by SymPy; bounds of them, and its box, by interval arithmetic."""

import functools
import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import SceneError
from .. import base
from . import corners
from .expression import COORDINATES, Piece, parse
from .form import Form
from .generated import function_of
from .interval import Interval, bounds_of
from .owned import Bend

# Operations of the derivatives: beyond, deriving and compiling them would take minutes.
_MOST_OPERATIONS = 4000
# Cells along an edge of the box, for the bounds of the second derivatives.
_CELLS = 16
# A cavity is looked for in cubes with these powers of 2 as half widths [m].
_SMALLEST, _LARGEST = -40, 24
# The box is found by cutting layers off its sides, each this part of it, of so many cells along an edge.
_LAYERS, _LAYER_CELLS = tuple(0.5**k for k in range(2, 11)), 24
# Room around the box that was found, relative to it.
_ROOM = 1e-3


@functools.lru_cache(maxsize=64)
def derived(text: str, names: tuple[str, ...]) -> "Derived":
    """The formula and its derivatives, as expressions and as functions."""
    import sympy

    pieces: list[Piece] = []
    phi = parse(text, names, pieces)
    x, y, z = axes = tuple(map(sympy.Symbol, COORDINATES))
    gradient = [sympy.diff(phi, axis) for axis in axes]
    _check_length(gradient)
    pairs = [(0, x), (1, y), (2, z), (0, y), (1, z), (2, x)]
    hessian = [sympy.diff(gradient[i], axis) / 2 for i, axis in pairs]
    _check_length(hessian)
    functions = (
        function_of(name, rows) for name, rows in (("phi", [phi]), ("gradient", gradient), ("hessian", hessian))
    )
    return Derived(
        phi,
        tuple(gradient),
        tuple(hessian),
        tuple(pieces),
        tuple(sympy.Symbol(f"p{i}") for i in range(len(names))),
        axes,
        *functions,
    )


def _check_length(rows: Sequence[Any]) -> None:
    import sympy

    count = int(sympy.count_ops(rows))
    if count > _MOST_OPERATIONS:
        raise SceneError(f"phi must have derivatives of at most {_MOST_OPERATIONS} operations, got {count}; shorten it")


class Derived(NamedTuple):
    """A formula, its first and (half) its second derivatives as expressions, and as functions."""

    expression: Any
    slopes: tuple[Any, ...]
    seconds: tuple[Any, ...]
    pieces: tuple[Piece, ...]
    symbols: tuple[Any, ...]
    axes: tuple[Any, ...]
    phi: Any
    gradient: Any
    hessian: Any

    def with_values(self, values: tuple[float, ...]) -> "Derived":
        """The expressions with numbers in place of the parameters."""
        import sympy

        numbers = {symbol: sympy.Rational(value) for symbol, value in zip(self.symbols, values, strict=True)}
        pieces = tuple(one._replace(argument=one.argument.subs(numbers)) for one in self.pieces)
        corners.check_constants(pieces)
        slopes, seconds = (tuple(one.subs(numbers) for one in rows) for rows in (self.slopes, self.seconds))
        return self._replace(expression=self.expression.subs(numbers), slopes=slopes, seconds=seconds, pieces=pieces)

    def in_cells(self, cells: dict[Any, Interval]) -> Interval:
        """Bounds of phi."""
        return bounds_of(self.expression, cells, {})

    def cells(self, box: Any, shape: tuple[int, ...]) -> tuple[Any, Any, dict[Any, Interval]]:
        """The corners of the cells of a box, (3, cells) each, and the cells of the coordinates."""
        low, high = np.array(box)[:, :, None, None, None]
        index, counts = np.indices(shape), np.array(shape)[:, None, None, None]
        lower, upper = ((low + (high - low) * ((index + end) / counts)).reshape(3, -1) for end in (0, 1))
        return lower, upper, {axis: Interval(lower[i], upper[i]) for i, axis in enumerate(self.axes)}

    def found_box(self) -> base.Box | None:
        """A box that surely holds all of phi <= 0 up to the largest cube; None if that is open."""
        for power in range(_LARGEST, _SMALLEST, -1):
            half = 2.0**power
            lower, upper, cells = self.cells(((-half,) * 3, (half,) * 3), (8, 8, 8))
            shell = (np.maximum(-lower, upper) > 0.5 * half).any(axis=0)
            if not (self.in_cells(cells).low + 0.0 * lower[0] > 0.0)[shell].all():
                return None if power == _LARGEST else self._tightened(half)
        raise SceneError("phi must be 0 somewhere, got above 0 everywhere")

    def _tightened(self, half: float) -> base.Box:
        """The cube without the layers that surely hold none of phi <= 0."""
        box = np.array([[-half] * 3, [half] * 3])
        for part in _LAYERS:
            for axis, end in itertools.product(range(3), range(2)):
                while self._is_empty(layer := _layer(box, axis, end, part)):
                    box[end, axis] = layer[1 - end, axis]
                    if box[1, axis] - box[0, axis] < 2.0**_SMALLEST * half:
                        raise SceneError("phi must be 0 somewhere, got above 0 everywhere")
        room = _ROOM * (box[1] - box[0])
        return tuple((box[0] - room).tolist()), tuple((box[1] + room).tolist())

    def _is_empty(self, layer: Any) -> bool:
        thin = layer[1] - layer[0]
        shape = tuple(np.where(thin < 0.5 * thin.max(), 1, _LAYER_CELLS).tolist())
        lower, upper, cells = self.cells(layer, shape)
        if (self.in_cells(cells).low > 0.0).all():
            return True
        # phi(r) >= phi(m) - sum |d phi| |r - m|, m the middle: closer for small cells where a coordinate occurs twice
        middle = {axis: Interval(m, m) for axis, m in zip(self.axes, 0.5 * (lower + upper), strict=True)}
        least, known = self.in_cells(middle).low, dict[Any, Interval]()
        for half, slope in zip(0.5 * (upper - lower), self.slopes, strict=True):
            change = bounds_of(slope, cells, known)
            with np.errstate(invalid="ignore"):
                least = least - half * np.maximum(np.abs(change.low), np.abs(change.high)) * (1.0 + 1e-12)
        return bool((least > 0.0).all())

    def _varies(self) -> bool:
        return any(one.free_symbols for one in self.seconds)

    def check_box(self, form: Form) -> None:
        """Raise if there is no box to find the bend in, and H is no constant."""
        if form.box is None and self._varies():
            raise SceneError(
                "bounds must be given: none were found that hold all of phi <= 0; or give curvature, a number that the "
                "second derivative of phi in any direction never exceeds"
            )

    def check_smooth(self, form: Form) -> None:
        """Raise if phi may have a corner or a pole where particles go; second derivatives may not show it."""
        side = base.side_sign(form.side)
        corners.check(self.pieces, self.expression, self.axes, side, form.domain(), form.reach())

    def bend(self, form: Form) -> Bend:
        """Bounds of side H over the box of a form, a solid's with its margin.

        Raises:
            SceneError: H is not bounded there.
        """
        side = base.side_sign(form.side)
        if not self._varies():
            entries = side * np.array([float(one) for one in self.seconds])
            return Bend.of_entries(entries[:, None], entries[:, None])
        lower, _upper, cells = self.cells(form.domain(), (_CELLS, _CELLS, _CELLS))
        phi = self.in_cells(cells)
        # Flights are in the admissible part only, so its cells are enough.
        admissible = ~((phi.low if side > 0.0 else -phi.high) + 0.0 * lower[0] > 0.0)
        known: dict[Any, Interval] = {}
        parts = [bounds_of(one, cells, known) for one in self.seconds]
        ends = [(part.low, part.high) if side > 0.0 else (-part.high, -part.low) for part in parts]
        lows, highs = (
            np.array([np.broadcast_to(pair[i], lower[0].shape)[admissible] for pair in ends]) for i in (0, 1)
        )
        if not (np.isfinite(lows).all() and np.isfinite(highs).all()):
            raise SceneError(
                f"curvature must be given: the second derivatives of phi are not bounded in the bounds {form.box}; "
                "it is a number that the second derivative in any direction never exceeds"
            )
        return Bend.of_entries(lows, highs)


def _layer(box: Any, axis: int, end: int, part: float) -> Any:
    """The part of a box along one of its sides."""
    layer = box.copy()
    layer[1 - end, axis] = box[end, axis] + part * (box[1 - end, axis] - box[end, axis])
    return layer
