"""A formula from a scene file as an expression: a list of allowed nodes, and an error for every other one.

The text is never evaluated: Python's parser only builds a tree of it, and every node of the tree that is on the list
below becomes a SymPy node.
"""

import ast
import math
import operator
import warnings
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, NoReturn

from ...common.checks import closest
from ...errors import SceneError

COORDINATES = ("x", "y", "z")
FUNCTIONS: dict[str, Callable[[float], float]] = {
    name: getattr(math, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh")
}
# Long enough for any surface that is written by hand, short enough for its derivatives.
_LONGEST, _DEEPEST, _MOST_NODES = 2000, 60, 400
_LARGEST_EXPONENT = 64.0
# Numbers up to this have squares and inverse squares that are finite.
_LARGEST = 1e150
# Exact fractions longer than this are rounded, so that powers of powers stay short.
_BITS = 1000

_WANTED = {"sqrt": "above 0", "log": "above 0", "tan": "no pole"}
_NOT_SMOOTH = ("abs", "min", "max", "floor", "ceil", "round", "sign", "fabs")
_WORDS: dict[type, str] = {
    ast.Attribute: "an attribute", ast.Subscript: "an index", ast.Lambda: "a lambda", ast.Compare: "a comparison",
    ast.BoolOp: "'and' or 'or'", ast.IfExp: "'if'", ast.JoinedStr: "a string", ast.NamedExpr: "an assignment",
    ast.Tuple: "a tuple", ast.List: "a list", ast.Dict: "a dict", ast.Set: "a set", ast.Starred: "a star",
    ast.ListComp: "a comprehension", ast.GeneratorExp: "a comprehension",
}  # fmt: skip
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip


class NonSmoothTerm(NamedTuple):
    """A root, power, quotient, log or tan of a formula, which is smooth only where its argument is `wanted`."""

    argument: Any
    wanted: str  # "above 0", "not 0" or "no pole"
    place: str


def parse(text: Any, parameters: Iterable[str] = (), pieces: list[NonSmoothTerm] | None = None) -> Any:
    """The SymPy expression of a formula in x, y, z and `parameters`; their symbols are p0, p1, ... in this order.

    SymPy simplifies as it builds, so that sqrt(x**2)**2 becomes x**2. Terms that are smooth only in places are appended
    to `pieces` as they are read, inner ones first, even if simplification removes them.

    Raises:
        SceneError: the text is not a formula of numbers, these names, + - * / ** and the functions of the list.

    >>> parse("x**2/0.09 + sin(y) - 1")
    100*x**2/9 + sin(y) - 1
    """
    import sympy  # only where a formula is used

    if not isinstance(text, str):
        raise SceneError(f"phi must be a formula in quotes, got {text!r}")
    if not text.strip():
        raise SceneError("phi must be a formula in x, y, z, got nothing")
    if len(text) > _LONGEST:
        raise SceneError(f"phi must have at most {_LONGEST} characters, got {len(text)}")
    line = "".join(" " if c.isspace() else c for c in text)
    lead = len(line) - len(line.lstrip())
    names = {name: sympy.Symbol(name) for name in COORDINATES}
    names |= {name: sympy.Symbol(f"p{i}") for i, name in enumerate(parameters)}
    expression = _FormulaReader(line.strip(), lead, names, sympy, [] if pieces is None else pieces).expression()
    if not expression.free_symbols & {names[name] for name in COORDINATES}:
        raise SceneError(f"phi must depend on x, y or z, got {text.strip()!r}")
    return expression


class _FormulaReader:
    """A reader of the tree of one text, node by node."""

    def __init__(self, text: str, lead: int, names: dict[str, Any], sympy: Any, pieces: list[NonSmoothTerm]) -> None:
        self._text, self._lead, self._names, self._sympy, self._pieces = text, lead, names, sympy, pieces
        self._nodes = 0

    def expression(self) -> Any:
        try:
            with warnings.catch_warnings():
                # Such as "invalid decimal literal": these come as errors below.
                warnings.simplefilter("ignore")
                tree = ast.parse(self._text, mode="eval")
        except SyntaxError as error:
            column = (error.offset or 1) + self._lead
            raise SceneError(f"phi is not a formula: {error.msg} at column {column} of {self._text!r:.80}") from None
        except (ValueError, RecursionError, MemoryError):
            raise SceneError("phi is not a formula: it is nested too deeply, or holds a zero character") from None
        return self._read(tree.body, 0)

    def _read(self, node: ast.expr, depth: int) -> Any:
        """Return the expression of a node."""
        self._nodes += 1
        if self._nodes > _MOST_NODES:
            raise SceneError(f"phi must have at most {_MOST_NODES} numbers, names and operations, got more")
        if depth > _DEEPEST:
            self._refuse(node, f"phi is nested more than {_DEEPEST} deep")
        match node:
            case ast.Constant():
                return self._number(node)
            case ast.Name():
                return self._name(node)
            case ast.UnaryOp(op=ast.USub()):
                return -self._read(node.operand, depth + 1)
            case ast.UnaryOp(op=ast.UAdd()):
                return self._read(node.operand, depth + 1)
            case ast.BinOp(op=ast.BitXor()):
                self._refuse(node, "phi has ^, write ** for a power")
            case ast.BinOp() if type(node.op) in (ast.Pow, *_OPERATORS):
                return self._operation(node, self._read(node.left, depth + 1), self._read(node.right, depth + 1))
            case ast.Call():
                return self._call(node, depth)
        what = _WORDS.get(type(node), "this")
        return self._refuse(
            node, f"phi must not have {what}, only numbers, x, y, z, + - * / ** and {', '.join(FUNCTIONS)}"
        )

    def _operation(self, node: ast.BinOp, left: Any, right: Any) -> Any:
        if isinstance(node.op, ast.Pow):
            return self._power(node, left, right)
        if isinstance(node.op, ast.Div):
            if right == 0:
                self._refuse(node, "phi divides by 0")
            self._note(node, right, "not 0")
        return self._checked(node, _OPERATORS[type(node.op)](left, right))

    def _number(self, node: ast.Constant) -> Any:
        if type(node.value) not in (int, float):
            self._refuse(node, f"phi must have real numbers only, got {node.value!r:.40}")
        if not self._is_small(node.value):
            self._refuse(node, f"phi must have numbers below {_LARGEST:g} and not below {1 / _LARGEST:g}")
        # As it is written: 0.09 and not the nearest binary fraction, so that 1/0.09 is rounded once.
        return self._sympy.Rational(repr(node.value))

    def _name(self, node: ast.Name) -> Any:
        if node.id in self._names:
            return self._names[node.id]
        if node.id == "pi":
            return self._sympy.Rational(math.pi)
        if node.id in FUNCTIONS:
            self._refuse(node, f"phi has {node.id} without its argument, write {node.id}(...)")
        known = [*self._names, "pi", *FUNCTIONS]
        return self._refuse(node, f"phi has an unknown name {node.id!r}", closest(node.id, known))

    def _power(self, node: ast.BinOp, base: Any, exponent: Any) -> Any:
        if not exponent.is_number:
            self._refuse(node.right, "phi must have constant exponents")
        if abs(exponent) > _LARGEST_EXPONENT:
            self._refuse(node.right, f"phi must have exponents up to {_LARGEST_EXPONENT:g}")
        if not base.is_number:
            if not exponent.is_Integer or exponent < 0:
                self._note(node, base, "not 0" if exponent.is_Integer else "above 0")
            return base**exponent
        if base == 0 and exponent < 0:
            self._refuse(node, "phi divides by 0")
        if not exponent.is_Integer:
            return self._computed(node, lambda: float(base) ** float(exponent))
        return self._checked(node, base**exponent)

    def _call(self, node: ast.Call, depth: int) -> Any:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            name = node.func.id if isinstance(node.func, ast.Name) else ""
            if name in _NOT_SMOOTH:
                self._refuse(node, f"phi must be smooth, which {name} is not")
            hint = closest(name, FUNCTIONS) if name else ""
            self._refuse(node, f"phi must call only {', '.join(FUNCTIONS)}", hint)
        if len(node.args) != 1 or node.keywords:
            self._refuse(node, f"phi must call {node.func.id} with one argument")
        argument = self._read(node.args[0], depth + 1)
        if argument.is_number:
            return self._computed(node, lambda: FUNCTIONS[node.func.id](float(argument)))  # type: ignore[attr-defined]
        if node.func.id in _WANTED:
            self._note(node, argument, _WANTED[node.func.id])
        return getattr(self._sympy, node.func.id)(argument)

    def _computed(self, node: ast.expr, value: Callable[[], Any]) -> Any:
        """Return a constant that is no fraction, rounded."""
        try:
            number = value()
        except (TypeError, ValueError, ArithmeticError):
            number = math.nan
        if isinstance(number, complex) or not math.isfinite(number):
            self._refuse(node, "phi has a constant that is not a real number")
        return self._checked(node, self._sympy.Rational(number))

    def _checked(self, node: ast.expr, value: Any) -> Any:
        """Return a result; constants are kept small and short."""
        if not value.is_number:
            return value
        if not value.is_Rational:
            return self._computed(node, lambda: float(value))
        if not self._is_small(value):
            self._refuse(node, f"phi must have constants below {_LARGEST:g} and not below {1 / _LARGEST:g}")
        if value.p.bit_length() > _BITS or value.q.bit_length() > _BITS:
            return self._sympy.Rational(float(value))
        return value

    @staticmethod
    def _is_small(value: Any) -> bool:
        return bool(value == 0) or bool(1 / _LARGEST <= abs(value) <= _LARGEST)

    def _note(self, node: ast.expr, argument: Any, wanted: str) -> None:
        if not argument.is_number:
            self._pieces.append(NonSmoothTerm(argument, wanted, self._place(node)))

    def _refuse(self, node: ast.expr, why: str, hint: str = "") -> NoReturn:
        raise SceneError(f"{why}, got {self._place(node)}{hint}")

    def _place(self, node: ast.expr) -> str:
        piece = ast.get_source_segment(self._text, node) or ""
        column = len(self._text.encode()[: node.col_offset].decode(errors="replace")) + 1 + self._lead
        shown = piece if len(piece) <= 40 else piece[:37] + "..."
        return f"{shown!r} at column {column}"
