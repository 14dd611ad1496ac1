"""Functions written from SymPy's expressions: text of our own, one assignment for every operation, compiled here."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import SceneError


def function_of(name: str, rows: Sequence[Any]) -> Any:
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
    scope[name].same_in_python = writer.same_in_python
    return scope[name]


class _Writer:
    """One assignment for every operation of an expression."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.known: dict[Any, str] = {}
        # Whether there is only + - * / and sqrt.
        self.same_in_python = True

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
        self.same_in_python = False
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
            self.same_in_python = False
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
