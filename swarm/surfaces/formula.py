"""A surface by a formula: its derivatives by SymPy, its bounds by interval arithmetic, then a surface of one's own.

The formula's text is never evaluated (see `expression`). What is compiled is text of our own, written from the tree of
the derivatives.
"""

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np

from .. import checks
from ..checks import Vector
from ..errors import SceneError
from . import base, own
from .expression import COORDINATES, FUNCTIONS, parse
from .form import Form
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


@dataclass(frozen=True, repr=False, init=False)
class Formula(base.Surface):
    """A surface by a formula for phi(x, y, z), with its derivatives; in a scene file the formula's key is phi.

    Args:
        formula: phi in x, y, z, numbers, pi, the parameters' names, + - * / **, parentheses and sqrt, exp, log, sin,
            cos, tan, sinh, cosh, tanh; constant exponents. Below 0 inside, 0 on the surface, above 0 outside.
        parameters: numbers by their names; other values of them need no new compilation.
        bounds: ((x, y, z), (x, y, z)), the lower and the upper corner of a box around the cavity or the solid, in the
            coordinates of the formula. None: found where the cavity or the solid is bounded. Where it is open, the box
            that particles stay in.
        size: a characteristic length [m]. None: half the smallest extent of the bounds.
        center: where the origin of the formula's coordinates is [m].
        side: "inside" or "outside", the admissible part.
        curvature: a number that the second derivative of phi in any direction never exceeds in the bounds or, without
            bounds, wherever particles go. None: found by interval arithmetic, which is a proof; then the first hit of a
            flight is never missed. It must be given where phi is no quadric and there are no bounds.

    Raises:
        SceneError: the formula holds anything else, an argument is out of its range, or phi is not finite, has no
            surface in the bounds, or no gradient on it.

    >>> Formula("x**2/0.25 + y**2/0.25 + z**4 - 1").phi([[1.0], [0.0], [0.0]])
    array([3.])
    """

    formula: str = field(metadata={"key": "phi"})
    parameters: dict[str, float] | None = None
    # A surface has methods of these names.
    box: tuple[Vector, Vector] | None = field(default=None, metadata={"key": "bounds"})
    length: float | None = field(default=None, metadata={"key": "size"})
    center: Vector = (0.0, 0.0, 0.0)
    side: str = "inside"
    curvature: float | None = None

    def __init__(
        self,
        formula: str,
        *,
        parameters: Mapping[str, float] | None = None,
        bounds: Any = None,
        size: float | None = None,
        **common: Any,
    ) -> None:
        given = {"formula": formula, "parameters": parameters, "box": bounds, "length": size}
        for one in fields(self):
            if one.name not in given:
                given[one.name] = common.pop(one.name, one.default)
        if common:
            raise SceneError(
                f"Formula has no argument {next(iter(common))!r}{checks.closest(next(iter(common)), given)}"
            )
        for name, value in given.items():
            object.__setattr__(self, name, value)
        self.__post_init__()

    def __post_init__(self) -> None:
        super().__post_init__()
        set_ = functools.partial(object.__setattr__, self)
        set_("box", own.box_of(self.box))
        set_("length", None if self.length is None else checks.length("size", self.length))
        set_("curvature", None if self.curvature is None else checks.at_least("curvature", self.curvature, 0.0))
        set_("parameters", _parameters(self.parameters))
        set_("_found", self._shaped())

    def __repr__(self) -> str:
        """The call that makes it, without what is as it is by default."""
        said = [f for f in fields(self) if f.name != "formula" and getattr(self, f.name) != f.default]
        rest = "".join(f", {f.metadata.get('key', f.name)}={getattr(self, f.name)!r}" for f in said)
        return f"Formula({self.formula!r}{rest})"

    def _shaped(self) -> Form:
        names = tuple(self.parameters or ())
        values = tuple((self.parameters or {}).values())
        code = _derived(self.formula, names)
        exact = code.with_values(values)
        box = self.box or exact.found_box()
        size = self.length
        if size is None:
            size = math.inf if box is None else min(b - a for a, b in zip(*box, strict=True)) / 2.0
        kind = own.code_of(_Flat(values), code.phi, code.gradient, code.hessian)
        form = Form(kind, values, box, size, self.side)
        if box is not None:
            form.check()
        if self.curvature is None:
            return form.bent(exact.bend(form))
        return form.bent(Bend.of_magnitude(self.curvature))

    @property
    def _form(self) -> Form:
        found: Form = self.__dict__["_found"]
        return found

    def numbers(self) -> Any:
        return self._form.numbers(self.own_center())

    def size(self) -> float:
        return self._form.size

    def bounds(self) -> base.Box:
        return self._form.bounds(self.center, self.rotation)

    def extent(self) -> float:
        return base.farthest(self.center) + self._form.reach()


class _Flat(tuple[float, ...]):
    """Parameters of generated code, which takes them by their index."""

    _fields = ()


def _parameters(parameters: Any) -> dict[str, float] | None:
    if parameters is None:
        return None
    if not isinstance(parameters, Mapping):
        raise SceneError(f"parameters must be numbers by their names, got {parameters!r}")
    for name in parameters:
        taken = (*COORDINATES, "pi", *FUNCTIONS)
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            raise SceneError(f"parameters must have names other than {', '.join(taken)}, got {name!r}")
    return {name: checks.number(f"parameters.{name}", value) for name, value in parameters.items()}


# --- Derivatives -----------------------------------------------------------------------------------------


@functools.lru_cache(maxsize=64)
def _derived(text: str, names: tuple[str, ...]) -> "_Code":
    """The formula and its derivatives, as expressions and as functions."""
    import sympy

    phi = parse(text, names)
    x, y, z = axes = tuple(map(sympy.Symbol, COORDINATES))
    gradient = [sympy.diff(phi, axis) for axis in axes]
    _check_length(gradient)
    pairs = [(0, x), (1, y), (2, z), (0, y), (1, z), (2, x)]
    hessian = [sympy.diff(gradient[i], axis) / 2 for i, axis in pairs]
    _check_length(hessian)
    functions = (_function(name, rows) for name, rows in (("phi", [phi]), ("gradient", gradient), ("hessian", hessian)))
    return _Code(
        phi, tuple(gradient), tuple(hessian), tuple(sympy.Symbol(f"p{i}") for i in range(len(names))), axes, *functions
    )


def _check_length(rows: Sequence[Any]) -> None:
    import sympy

    count = int(sympy.count_ops(rows))
    if count > _MOST_OPERATIONS:
        raise SceneError(f"phi must have derivatives of at most {_MOST_OPERATIONS} operations, got {count}; shorten it")


def _function(name: str, rows: Sequence[Any]) -> Any:
    """A function (p, x, y, z) of these expressions, from text that is written here."""
    import sympy

    shared, rows = sympy.cse(rows, symbols=sympy.numbered_symbols("s"), order="none")
    writer = _Writer()
    for symbol, expression in shared:
        writer.known[symbol] = writer.name_of(expression)
    results = ", ".join(map(writer.name_of, rows))
    lines = [f"def {name}(p, x, y, z):", *writer.lines, f"return {results}"]
    scope: dict[str, Any] = {"np": np, "__name__": __name__}
    exec("\n    ".join(lines), scope)
    return scope[name]


class _Writer:
    """One assignment for every operation of an expression."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.known: dict[Any, str] = {}

    def name_of(self, expression: Any) -> str:
        """The name that holds an expression, or the number itself."""
        if expression not in self.known:
            self.known[expression] = self._written(expression)
        return self.known[expression]

    def _assign(self, text: str) -> str:
        self.lines.append(f"t{len(self.lines)} = {text}")
        return f"t{len(self.lines) - 1}"

    def _written(self, expression: Any) -> str:
        if expression.is_number:
            return _literal(expression)
        if expression.is_Symbol:
            name = expression.name
            return self._assign(f"p[{int(name[1:])}]") if name.startswith("p") else str(name)
        if expression.is_Add:
            return self._assign(" + ".join(map(self.name_of, expression.args)))
        if expression.is_Mul:
            return self._product(expression)
        if expression.is_Pow:
            return self._power(self.name_of(expression.base), expression.exp)
        return self._assign(f"np.{expression.func.__name__}({self.name_of(expression.args[0])})")

    def _product(self, expression: Any) -> str:
        above: list[str] = []
        below: list[str] = []
        for factor in expression.args:
            divides = factor.is_Pow and factor.exp.is_number and factor.exp < 0
            (below if divides else above).append(self.name_of(1 / factor if divides else factor))
        top = " * ".join(above) or "1.0"
        return self._assign(f"({top}) / ({' * '.join(below)})" if below else top)

    def _power(self, base_name: str, exponent: Any) -> str:
        if exponent < 0:
            return self._assign(f"1.0 / {self._power(base_name, -exponent)}")
        if not (2 * exponent).is_Integer:
            return self._assign(f"{base_name} ** {_literal(exponent)}")
        factors = [self._assign(f"np.sqrt({base_name})")] if not exponent.is_Integer else []
        n, square = int(exponent), base_name
        while n:
            if n % 2:
                factors.append(square)
            n //= 2
            if n:
                square = self._assign(f"{square} * {square}")
        return self._assign(" * ".join(factors)) if len(factors) > 1 else factors[0]


def _literal(number: Any) -> str:
    """A constant as a float; in parentheses where it has a sign."""
    try:
        value = float(number)
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise SceneError(f"phi must have constants that are real numbers, got {number} in it or its derivatives")
    return f"({value!r})" if value < 0.0 else repr(value)


# --- Bounds ----------------------------------------------------------------------------------------------


class _Code(NamedTuple):
    """A formula, its first and (half) its second derivatives as expressions, and as functions."""

    expression: Any
    slopes: tuple[Any, ...]
    seconds: tuple[Any, ...]
    symbols: tuple[Any, ...]
    axes: tuple[Any, ...]
    phi: Any
    gradient: Any
    hessian: Any

    def with_values(self, values: tuple[float, ...]) -> "_Code":
        """The expressions with numbers in place of the parameters."""
        import sympy

        numbers = {symbol: sympy.Rational(value) for symbol, value in zip(self.symbols, values, strict=True)}
        slopes, seconds = (tuple(one.subs(numbers) for one in rows) for rows in (self.slopes, self.seconds))
        return self._replace(expression=self.expression.subs(numbers), slopes=slopes, seconds=seconds)

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

    def bend(self, form: Form) -> Bend:
        """Bounds of side H over the box of a form, a solid's with its margin.

        Raises:
            SceneError: H is not bounded there, or there is no box and H is no constant.
        """
        side = base.side_sign(form.side)
        if not any(one.free_symbols for one in self.seconds):
            entries = side * np.array([float(one) for one in self.seconds])
            return Bend.of_entries(entries[:, None], entries[:, None])
        if form.box is None:
            raise SceneError(
                "bounds must be given: none were found that hold all of phi <= 0; or give curvature, a number that the "
                "second derivative of phi in any direction never exceeds"
            )
        low, high = np.array(form.box)
        room = 0.5 * form.outer_margin() * (high - low).min()
        lower, _upper, cells = self.cells((low - room, high + room), (_CELLS, _CELLS, _CELLS))
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
