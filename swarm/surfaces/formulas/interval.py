"""Intervals in arrays: bounds that hold for every point of many cells at once."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# The functions of the system's library are off by less than this.
_ULPS = 4


class Interval:
    """[low, high] in each element, rounded outward; what is not known is [-inf, inf]."""

    def __init__(self, low: Any, high: Any) -> None:
        self.low, self.high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)

    def __neg__(self) -> "Interval":
        return Interval(-self.high, -self.low)

    def __add__(self, other: "Interval") -> "Interval":
        return _wider(self.low + other.low, self.high + other.high, 1)

    def __mul__(self, other: "Interval") -> "Interval":
        with np.errstate(invalid="ignore"):
            products = np.array(
                np.broadcast_arrays(*(a * b for a in (self.low, self.high) for b in (other.low, other.high)))
            )
        # 0 x inf: every number of the one times every number of the other
        products = np.where(np.isnan(products), 0.0, products)
        return _wider(products.min(axis=0), products.max(axis=0), 1)

    def inverse(self) -> "Interval":
        """1/[low, high]"""
        with np.errstate(divide="ignore"):
            low, high = 1.0 / self.high, 1.0 / self.low
        # A zero at one end leaves a half line, one between the ends the whole.
        low = np.where((self.low < 0.0) & (self.high >= 0.0), -np.inf, low)
        high = np.where((self.low <= 0.0) & (self.high > 0.0), np.inf, high)
        none = (self.low == 0.0) & (self.high == 0.0)
        return _wider(np.where(none, -np.inf, low), np.where(none, np.inf, high), 1)

    def power(self, n: int) -> "Interval":
        """[low, high]**n for a whole n."""
        if n < 0:
            return self.power(-n).inverse()
        low, high = self.low**n, self.high**n
        if n % 2 == 0:
            smallest = np.where((self.low <= 0.0) & (self.high >= 0.0), 0.0, np.minimum(low, high))
            low, high = smallest, np.maximum(low, high)
        wide = _wider(low, high, _ULPS)
        return Interval(np.maximum(wide.low, 0.0), wide.high) if n % 2 == 0 else wide

    def root(self, exponent: float) -> "Interval":
        """[low, high]**exponent for any exponent; nothing is known where all of it is below 0."""
        low, high = np.maximum(self.low, 0.0), np.maximum(self.high, 0.0)
        with np.errstate(divide="ignore"):
            a, b = low**exponent, high**exponent
        return self._where_known(np.minimum(a, b), np.maximum(a, b))

    def log(self) -> "Interval":
        """The logarithm; nothing is known where all of it is below 0."""
        with np.errstate(divide="ignore"):
            return self._where_known(np.log(np.maximum(self.low, 0.0)), np.log(np.maximum(self.high, 0.0)))

    def _where_known(self, low: Floats, high: Floats) -> "Interval":
        known = self.high >= 0.0
        return _wider(np.where(known, low, -np.inf), np.where(known, high, np.inf), _ULPS)

    def rising(self, name: str) -> "Interval":
        """A function that rises everywhere."""
        function = getattr(np, name)
        return _wider(function(self.low), function(self.high), _ULPS)

    def cosh(self) -> "Interval":
        """The hyperbolic cosine."""
        a, b = np.cosh(self.low), np.cosh(self.high)
        across = (self.low <= 0.0) & (self.high >= 0.0)
        return _wider(np.where(across, 1.0, np.minimum(a, b)), np.maximum(a, b), _ULPS)

    def cos(self) -> "Interval":
        """The cosine."""
        with np.errstate(invalid="ignore"):
            a, b = np.cos(self.low), np.cos(self.high)
        wide = _wider(
            np.where(self._passes(math.pi, 2.0 * math.pi), -1.0, np.fmin(a, b)),
            np.where(self._passes(0.0, 2.0 * math.pi), 1.0, np.fmax(a, b)),
            _ULPS,
        )
        return Interval(np.maximum(wide.low, -1.0), np.minimum(wide.high, 1.0))

    def sin(self) -> "Interval":
        """The sine."""
        return (self + Interval(-0.5 * math.pi, -0.5 * math.pi)).cos().loosened()

    def tan(self) -> "Interval":
        """The tangent; nothing is known of a cell with a pole."""
        pole = self._passes(0.5 * math.pi, math.pi)
        with np.errstate(invalid="ignore"):
            a, b = np.tan(self.low), np.tan(self.high)
        return _wider(np.where(pole, -np.inf, a), np.where(pole, np.inf, b), _ULPS)

    def loosened(self) -> "Interval":
        """Wider by the round-off of an argument near 1."""
        slack = 1e-15 * (1.0 + np.maximum(np.abs(self.low), np.abs(self.high)))
        return Interval(self.low - slack, self.high + slack)

    def _passes(self, start: float, period: float) -> Any:
        """Whether start + k period is in the interval; where that is uncertain, yes."""
        slack = 1e-12 * (1.0 + np.maximum(np.abs(self.low), np.abs(self.high)))
        with np.errstate(invalid="ignore"):
            first = np.ceil((self.low - slack - start) / period) * period + start
            return ~(first > self.high + slack)


def _wider(low: Any, high: Any, ulps: int) -> Interval:
    low, high = np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)
    for _ in range(ulps):
        low, high = np.nextafter(low, -np.inf), np.nextafter(high, np.inf)
    return Interval(low, high)


def bounds_of(expression: Any, cells: dict[Any, Interval], known: dict[Any, Interval]) -> Interval:
    """Bounds of a SymPy expression in cells of its symbols; `known` keeps those of its parts."""
    if expression in cells:
        return cells[expression]
    if expression not in known:
        with np.errstate(over="ignore"):
            known[expression] = _bounds_of(expression, cells, known)
    return known[expression]


def _bounds_of(expression: Any, cells: dict[Any, Interval], known: dict[Any, Interval]) -> Interval:
    if expression.is_number:
        return Interval(float(expression), float(expression))
    parts = [bounds_of(part, cells, known) for part in expression.args]
    if expression.is_Add or expression.is_Mul:
        total = parts[0]
        for part in parts[1:]:
            total = total + part if expression.is_Add else total * part
        return total
    if expression.is_Pow and expression.exp.is_number:
        power = expression.exp
        return parts[0].power(int(power)) if power.is_Integer else parts[0].root(float(power))
    name = expression.func.__name__
    if name in ("sin", "cos", "tan", "cosh", "log"):
        return getattr(parts[0], name)()  # type: ignore[no-any-return]
    # exp, and what else rises: sinh, tanh
    assert name in ("exp", "sinh", "tanh"), name
    return parts[0].rising(name)
