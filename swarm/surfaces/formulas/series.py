"""A polynomial phi along a flight as a polynomial of time: the text of its coefficients, from the tree of phi.

Sums and products of polynomials of time keep the user's factors, which costs fewer operations than monomials and loses
fewer digits.
"""

from typing import Any

from .expression import COORDINATES

# The degree up to which the level along a flight is solved as a whole; the names of a flight's velocity and half pull.
DEGREE = 4
VELOCITY = ("u", "v", "w")
HALF_PULL = ("a", "b", "c")


class LevelSeries:
    """Coefficients of 1, t, t^2, ... of expressions along x + u t, y + v t, z + w t, as names of a writer.

    If it `falls`, along x + u t + a t^2, y + v t + b t^2, z + w t + c t^2.
    """

    def __init__(self, writer: Any, falls: bool) -> None:
        self._writer = writer
        self._names = (VELOCITY, HALF_PULL) if falls else (VELOCITY,)
        self._known: dict[Any, list[str] | None] = {}

    def of(self, expression: Any) -> list[str] | None:
        """Return the coefficients of an expression, or None: it is no polynomial, or one of a higher degree."""
        if expression not in self._known:
            self._known[expression] = self._of(expression)
        return self._known[expression]

    def _of(self, expression: Any) -> list[str] | None:
        if not any(symbol.name in COORDINATES for symbol in expression.free_symbols):
            return [self._writer.name_of(expression)]
        if expression.is_Symbol:
            k = COORDINATES.index(expression.name)
            return [expression.name, *(names[k] for names in self._names)]
        if expression.is_Pow:
            return self._power(expression.base, expression.exp)
        if not (expression.is_Add or expression.is_Mul):
            return None
        parts = [self.of(part) for part in expression.args]
        found: list[str] | None = parts[0]
        for part in parts[1:]:
            if found is None or part is None:
                return None
            found = self._sum(found, part) if expression.is_Add else self._product(found, part)
        return found

    def _power(self, base: Any, exponent: Any) -> list[str] | None:
        if not (exponent.is_Integer and exponent > 0):
            return None
        n, square = int(exponent), self.of(base)
        found: list[str] | None = None
        while n and square is not None:
            if n % 2:
                found = square if found is None else self._product(found, square)
                if found is None:
                    return None
            n //= 2
            if n:
                square = self._product(square, square)
        return found if square is not None else None

    def _sum(self, first: list[str], second: list[str]) -> list[str]:
        short, long = sorted((first, second), key=len)
        return [self._writer.assign(f"{a} + {b}") for a, b in zip(short, long, strict=False)] + long[len(short) :]

    def _product(self, first: list[str], second: list[str]) -> list[str] | None:
        degree = len(first) + len(second) - 2
        if degree > DEGREE * len(self._names):
            return None
        return [self._writer.assign(self._coefficient(first, second, k)) for k in range(degree + 1)]

    @staticmethod
    def _coefficient(first: list[str], second: list[str], k: int) -> str:
        """Return the coefficient of t^k in a product, which is a square if the factors are equal."""
        pairs = [(i, k - i) for i in range(len(first)) if 0 <= k - i < len(second)]
        if first is not second:
            return " + ".join(f"{first[i]} * {second[j]}" for i, j in pairs)
        twice = [f"{first[i]} * {first[j]}" for i, j in pairs if i < j]
        terms = [f"2.0 * ({' + '.join(twice)})"] if twice else []
        return " + ".join(terms + [f"{first[i]} * {first[i]}" for i, j in pairs if i == j])
