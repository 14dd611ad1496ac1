"""The derivatives of a formula by SymPy, and functions of them; their bounds, and its box, by intervals."""

import functools
import hashlib
import itertools
import linecache
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import SceneError
from ...kernel.elementary import exponential, hyperbolic, hyperbolic_tangent, logarithm, power, sine_and_cosine
from ..surface import Box, side_sign
from .expression import COORDINATES, NonSmoothTerm, parse
from .form import Form
from .interval import IntervalBoxes, check_constants, check_smooth
from .numbers import Bend
from .series import DEGREE, HALF_PULL, VELOCITY, LevelSeries

# The most operations of the derivatives: beyond, to derive and compile them would take minutes.
_MOST_OPERATIONS = 4000
# Cells along an edge of the box, for the bounds of the second derivatives.
_CELLS = 16
# The search for a cavity is in cubes with these powers of 2 as half widths [m].
_SMALLEST, _LARGEST = -40, 24
# The box is found by cutting layers off its sides, each this part of it, of this number of cells along an edge; a cube
# in which a cavity is sought has the last number of cells.
_LAYERS, _LAYER_CELLS, _CUBES = tuple(0.5**k for k in range(2, 11)), 24, 8
# The third derivatives: an entry of H, the axis of the differentiation, and the number of orders in which each occurs.
_THIRDS = (
    (0, 0, 1), (1, 1, 1), (2, 2, 1), (0, 1, 3), (0, 2, 3), (1, 0, 3), (1, 2, 3), (2, 0, 3), (2, 1, 3), (3, 2, 6)
)  # fmt: skip
# A factor above the round-off of the sum of their squares
_UPWARDS = 1.0 + 1e-12
# Room around the box that was found, relative to it.
_ROOM = 1e-3


@functools.lru_cache(maxsize=64)
def derived(text: str, names: tuple[str, ...]) -> "Derived":
    """Return the formula and its derivatives, as expressions and as functions."""
    import sympy

    pieces: list[NonSmoothTerm] = []
    phi = parse(text, names, pieces)
    x, y, z = axes = tuple(map(sympy.Symbol, COORDINATES))
    gradient = tuple(sympy.diff(phi, axis) for axis in axes)
    _check_length(gradient)
    pairs = ((0, x), (1, y), (2, z), (0, y), (1, z), (2, x))
    hessian = tuple(sympy.diff(gradient[i], axis) / 2 for i, axis in pairs)
    _check_length(hessian)
    functions = (_function("phi", (phi,)), _function("gradient", gradient), _function("hessian", hessian))
    along = _along(phi)
    along_fall = _along_fall(phi) if along is not None and along.degree > 2 else None
    return Derived(phi, gradient, hessian, tuple(pieces), axes, functions, along, along_fall)


def _check_length(rows: Sequence[Any]) -> None:
    import sympy

    count = int(sympy.count_ops(rows))
    if count > _MOST_OPERATIONS:
        raise SceneError(f"phi must have derivatives of at most {_MOST_OPERATIONS} operations, got {count}; shorten it")


class Derived(NamedTuple):
    """A formula, its gradient and H, half its second derivatives, as expressions and as functions."""

    phi: Any
    gradient: tuple[Any, ...]
    hessian: tuple[Any, ...]
    pieces: tuple[NonSmoothTerm, ...]
    axes: tuple[Any, ...]
    functions: tuple[Any, ...]
    along: Any  # the function of the coefficients of a polynomial along a straight flight, or None
    along_fall: Any  # the function for a fall, for degrees 3 and 4; else None

    def with_values(self, values: tuple[float, ...]) -> "Derived":
        """Return the expressions with numbers in place of the parameters."""
        import sympy

        numbers = {sympy.Symbol(f"p{i}"): sympy.Rational(value) for i, value in enumerate(values)}
        pieces = tuple(one._replace(argument=one.argument.subs(numbers)) for one in self.pieces)
        check_constants(pieces)
        gradient, hessian = (tuple(one.subs(numbers) for one in rows) for rows in (self.gradient, self.hessian))
        return self._replace(phi=self.phi.subs(numbers), gradient=gradient, hessian=hessian, pieces=pieces)

    def found_box(self) -> Box | None:
        """Return a box that surely holds all of phi <= 0 up to the largest cube; None if the cavity is open.

        A formula that lacks a coordinate is a cylinder: the box has no ends along that axis.
        """
        across = [k for k, axis in enumerate(self.axes) if axis in self.phi.free_symbols] or [0, 1, 2]
        for k in range(_LARGEST, _SMALLEST, -1):
            half = 2.0**k
            cells = IntervalBoxes.grid(self.axes, ((-half,) * 3, (half,) * 3), _shape(across, _CUBES))
            shell = (np.maximum(-cells.lower, cells.upper) > 0.5 * half)[across].any(axis=0)
            if not (cells.bounds(self.phi).low > 0.0)[shell].all():
                return None if k == _LARGEST else self._tightened(half, across)
        raise SceneError("phi must be 0 somewhere, got above 0 everywhere")

    def _tightened(self, half: float, across: list[int]) -> Box:
        """Return the cube without the layers that surely hold none of phi <= 0, cut off along the axes `across`."""
        box = np.array([[-half] * 3, [half] * 3])
        for part in _LAYERS:
            for axis, end in itertools.product(across, range(2)):
                while self._is_empty(layer := _layer(box, axis, end, part), across):
                    box[end, axis] = layer[1 - end, axis]
                    if box[1, axis] - box[0, axis] < 2.0**_SMALLEST * half:
                        raise SceneError("phi must be 0 somewhere, got above 0 everywhere")
        room = _ROOM * (box[1] - box[0])
        room[[k for k in range(3) if k not in across]] = math.inf
        return tuple((box[0] - room).tolist()), tuple((box[1] + room).tolist())

    def _is_empty(self, layer: Any, across: list[int]) -> bool:
        thin = layer[1] - layer[0]
        along = [k for k in across if not thin[k] < 0.5 * thin[across].max()]
        cells = IntervalBoxes.grid(self.axes, layer, _shape(along, _LAYER_CELLS))
        if (cells.bounds(self.phi).low > 0.0).all():
            return True
        return bool((cells.centred(self.phi, self.gradient).low > 0.0).all())

    def check(self, form: Form, needs_box: bool) -> None:
        """Raise if phi may have a corner or a pole where particles go, or if a box is needed and `form` has no box."""
        if needs_box and form.box is None and self._varies():
            raise SceneError(
                "bounds must be given: none were found that hold all of phi <= 0; or give curvature, a number that the "
                "second derivative of phi in any direction never exceeds"
            )
        # The bounds of second derivatives may hide a corner or a pole.
        check_smooth(self.pieces, self.phi, self.axes, side_sign(form.side), form.domain(), form.reach())

    def _varies(self) -> bool:
        return any(one.free_symbols for one in self.hessian)

    def is_convex(self, side: str) -> bool:
        """Whether the formula is a quadric that is surely convex on this side."""
        return not self._varies() and self._constant_bend(side_sign(side)).least > 0.0

    def _constant_bend(self, side: float) -> Bend:
        entries = side * np.array([float(one) for one in self.hessian])[:, None]
        return Bend.of_entries(entries, entries)._replace(third=0.0)

    def bend(self, form: Form) -> Bend:
        """Return the bounds of side H over the box of a form, for a solid with its margin.

        Raises:
            SceneError: H is not bounded there.
        """
        side = side_sign(form.side)
        if not self._varies():
            return self._constant_bend(side)
        cells = IntervalBoxes.grid(self.axes, form.domain(), (_CELLS, _CELLS, _CELLS))
        # Flights are in the admissible part only, so the cells of this part are enough.
        admissible = cells.may_be_admissible(self.phi, side)
        parts = [cells.bounds(one) for one in self.hessian]
        ends = [(part.low, part.high) if side > 0.0 else (-part.high, -part.low) for part in parts]
        low, high = np.array(ends)[:, :, admissible].transpose(1, 0, 2)
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            raise SceneError(
                f"curvature must be given: the second derivatives of phi are not bounded in the bounds {form.box}; "
                "it is a number that the second derivative in any direction never exceeds"
            )
        return Bend.of_entries(low, high)._replace(third=self._third(cells, admissible))

    def _third(self, cells: IntervalBoxes, some: Any) -> float:
        """A bound of the third derivative in any direction in some cells; infinite if it takes too many operations."""
        import sympy

        if self.along is not None:
            return math.inf  # a flight to a polynomial does not need it
        # d^3 phi/dx_i dx_j dx_k, and the number of its occurrences among all
        thirds = [(2 * sympy.diff(self.hessian[h], self.axes[k]), count) for h, k, count in _THIRDS]
        if int(sympy.count_ops([one for one, _count in thirds])) > _MOST_OPERATIONS:
            return math.inf
        squares = np.zeros(int(np.count_nonzero(some)))
        for one, count in thirds:
            part = cells.bounds(one)
            squares += count * np.maximum(np.abs(part.low), np.abs(part.high))[some] ** 2
        return _UPWARDS * float(np.sqrt(squares.max(initial=0.0)))


def _shape(along: list[int], cells: int) -> list[int]:
    """Return `cells` along some axes, and 1 along all others."""
    return [cells if k in along else 1 for k in range(3)]


def _layer(box: Any, axis: int, end: int, part: float) -> Any:
    """Return the part of a box along one of its sides."""
    layer = box.copy()
    layer[1 - end, axis] = box[end, axis] + part * (box[1 - end, axis] - box[end, axis])
    return layer


# --- Functions from text that is written here: one assignment for every operation ------------------------


def _function(name: str, rows: Sequence[Any]) -> Any:
    """Return a function (p, x, y, z) of these expressions."""
    import sympy

    shared, rows = sympy.cse(rows, symbols=sympy.numbered_symbols("s"), order="none")
    writer = _DerivativeWriter()
    for symbol, expression in shared:
        writer.known[symbol] = writer.name_of(expression)
    return _made(name, COORDINATES, writer, list(map(writer.name_of, rows)))


def _along(phi: Any) -> Any:
    """Return a function (p, x, y, z, u, v, w) of the coefficients of phi along a flight, None above degree 4."""
    writer = _DerivativeWriter()
    found = LevelSeries(writer, falls=False).of(phi)
    if found is None:
        return None
    coefficients = found + ["0.0"] * ((2 if len(found) <= 3 else DEGREE) + 1 - len(found))
    function = _made("along", (*COORDINATES, *VELOCITY), writer, coefficients)
    function.degree = len(coefficients) - 1
    return function


def _along_fall(phi: Any) -> Any:
    """Return such a function (p, x, y, z, u, v, w, a, b, c) for a fall; (a, b, c) is half its acceleration."""
    writer = _DerivativeWriter()
    found = LevelSeries(writer, falls=True).of(phi) or []
    function = _made("along_fall", (*COORDINATES, *VELOCITY, *HALF_PULL), writer, found)
    function.degree = len(found) - 1
    return function


def _made(name: str, arguments: Sequence[str], writer: "_DerivativeWriter", results: list[str]) -> Any:
    """Return the function with the lines of a writer."""
    lines = [f"def {name}(p, {', '.join(arguments)}):", *writer.lines, f"return {', '.join(results)}"]
    scope: dict[str, Any] = {"np": np, **_COMPUTED, "__name__": __name__}
    text = "\n    ".join(lines)
    file = f"<{name} {hashlib.sha256(text.encode()).hexdigest()}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file  # kernels are made of its text
    exec(compile(text, file, "exec"), scope)
    return scope[name]


# The functions for those of a formula: for functions with one value by SymPy's names, and for all of them
_OF_ONE = {"exp": "exponential", "log": "logarithm", "tanh": "hyperbolic_tangent"}
_COMPUTED = {
    "sine_and_cosine": sine_and_cosine, "exponential": exponential, "logarithm": logarithm, "hyperbolic": hyperbolic,
    "hyperbolic_tangent": hyperbolic_tangent, "power": power,
}  # fmt: skip


class _DerivativeWriter:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.known: dict[Any, str] = {}
        # The names of the sine and the cosine of an argument, by the call that computes both
        self.sines: dict[tuple[str, str], tuple[str, str]] = {}

    def name_of(self, expression: Any) -> str:
        """Return the name of the variable that holds an expression, or the number itself."""
        if expression not in self.known:
            self.known[expression] = self._written(expression)
        return self.known[expression]

    def assign(self, text: str) -> str:
        self.lines.append(f"t{len(self.lines)} = {text}")
        return f"t{len(self.lines) - 1}"

    def _written(self, expression: Any) -> str:
        if expression.is_number:
            return _literal(expression)
        if expression.is_Symbol:
            name = str(expression.name)
            return self.assign(f"p[{int(name[1:])}]") if name.startswith("p") else name
        if expression.is_Add:
            return self.assign(" + ".join(map(self.name_of, expression.args)))
        if expression.is_Mul:
            return self._product(expression)
        if expression.is_Pow:
            return self._power(self.name_of(expression.base), expression.exp)
        name, argument = expression.func.__name__, self.name_of(expression.args[0])
        if name in _OF_ONE:
            return self.assign(f"{_OF_ONE[name]}({argument})")
        both = "hyperbolic" if name in ("sinh", "cosh") else "sine_and_cosine"
        if (both, argument) not in self.sines:
            sine, cosine = self.sines[both, argument] = f"t{len(self.lines)}s", f"t{len(self.lines)}c"
            self.lines.append(f"{sine}, {cosine} = {both}({argument})")
        sine, cosine = self.sines[both, argument]
        if name == "tan":
            return self.assign(f"{sine} / {cosine}")
        return sine if name.startswith("sin") else cosine

    def _product(self, expression: Any) -> str:
        above: list[str] = []
        below: list[str] = []
        for factor in expression.args:
            divides = factor.is_Pow and factor.exp.is_number and factor.exp < 0
            (below if divides else above).append(self.name_of(1 / factor if divides else factor))
        top = " * ".join(above) or "1.0"
        return self.assign(f"({top}) / ({' * '.join(below)})" if below else top)

    def _power(self, base: str, exponent: Any) -> str:
        if exponent < 0:
            return self.assign(f"1.0 / {self._power(base, -exponent)}")
        if not (2 * exponent).is_Integer:
            return self.assign(f"power({base}, {_literal(exponent)})")
        factors = [self.assign(f"np.sqrt({base})")] if not exponent.is_Integer else []
        n, square = int(exponent), base
        while n:
            if n % 2:
                factors.append(square)
            n //= 2
            if n:
                square = self.assign(f"{square} * {square}")
        return self.assign(" * ".join(factors)) if len(factors) > 1 else factors[0]


def _literal(number: Any) -> str:
    """Return a constant as a float; in parentheses where it has a sign."""
    try:
        value = float(number)
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise SceneError(f"phi must have constants that are real numbers, got {number} in it or its derivatives")
    return f"({value!r})" if value < 0.0 else repr(value)
