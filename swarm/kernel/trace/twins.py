"""Twins of functions for traces: the same statements, with control flow and calls that go through a `CallFrame`.

    if x > 0.0:          def then():
        y = x                nonlocal y
    else:                    y = x
        y = f(x)             return frame.NEXT
                         ...
                         if frame.branch(x > 0.0, then, other, get, put) is not frame.NEXT:
                             return False

The twin has the globals and the cells of the function, so that names keep their meaning, and its line numbers.
"""

import ast
import copy
import functools
import itertools
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .frame import CallFrame
from .source import FRAME, arguments, compiled, definition, node_of
from .values import UNDEFINED, TraceError


def twin_of(function: Any, frame: CallFrame) -> Callable[..., Any]:
    """Return the twin of a function for one call of it.

    Raises:
        TraceError: its source is not known, or has a statement that no kernel has.
    """
    cells = [_content(cell) for cell in function.__closure__ or ()]
    twin: Any = _maker(function)(frame, *cells)
    twin.__defaults__, twin.__kwdefaults__ = function.__defaults__, function.__kwdefaults__
    return twin  # type: ignore[no-any-return]


def _content(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:
        return UNDEFINED


# Values that a function may refer to: others may change after a kernel is compiled.
_LASTING = (tuple, str, bytes, int, float, complex, type(None), range, np.generic, np.ndarray, types.ModuleType)


@functools.cache
def _maker(function: Any) -> Any:
    """Return the function (frame, cells) that makes the twin."""
    factory = _factory(function.__code__)
    if factory is None:
        raise TraceError(f"the source of {function.__name__} is not known")
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if not callable(value) and not isinstance(value, _LASTING):
            raise TraceError(f"{function.__name__} uses {name}, a {type(value).__name__}")
    return types.FunctionType(factory, function.__globals__)


_factories: dict[types.CodeType, types.CodeType | str | None] = {}


def _factory(code: types.CodeType) -> types.CodeType | None:
    """Return the code of a function (frame, cells) that makes the twin."""
    if code not in _factories:
        node = node_of(code)
        try:
            _factories[code] = None if node is None else compiled(_TwinWriter(node, code).written(), code)
        except TraceError as refused:
            _factories[code] = str(refused)
    found = _factories[code]
    if isinstance(found, str):
        raise TraceError(found)
    return found


# --- The twin --------------------------------------------------------------------------------------------


def _assigned(statements: Any) -> list[str]:
    """Return the names that statements assign, in order."""
    names: dict[str, None] = {}
    for one in statements:
        if isinstance(one, ast.FunctionDef):
            names[one.name] = None
        elif isinstance(one, (ast.If, ast.While, ast.For)):
            names |= dict.fromkeys(_assigned([*one.body, *one.orelse]))
        targets = one.targets if isinstance(one, ast.Assign) else [getattr(one, "target", one)]
        names |= dict.fromkeys(name for target in targets for name in _names(target))
    return list(names)


def _names(target: Any) -> Iterator[str]:
    """Yield the variables in the target of an assignment."""
    if isinstance(target, ast.Name):
        yield target.id
    elif isinstance(target, (ast.Tuple, ast.Starred)):
        for part in ast.iter_child_nodes(target):
            yield from _names(part)


_STATEMENTS = (
    ast.AnnAssign, ast.Assert, ast.Assign, ast.AugAssign, ast.Break, ast.Continue, ast.Expr, ast.For, ast.FunctionDef,
    ast.If, ast.Pass, ast.Raise, ast.Return, ast.While,
)  # fmt: skip
_REFUSED = (
    ast.Await, ast.Dict, ast.DictComp, ast.List, ast.ListComp, ast.NamedExpr, ast.Set, ast.SetComp, ast.Yield,
    ast.YieldFrom,
)  # fmt: skip


def load(name: str) -> ast.Name:
    """Return a variable."""
    return ast.Name(name, ast.Load())


def of_frame(name: str, *given: ast.expr) -> ast.Call:
    """Return a call of a method of the frame."""
    return ast.Call(ast.Attribute(load(FRAME), name, ast.Load()), list(given), [])


def without_arguments(body: Any) -> ast.Lambda:
    """Return an expression as a function."""
    return ast.Lambda(arguments(), body)


class _TwinWriter(ast.NodeTransformer):
    """The writer of the twin of one function."""

    def __init__(self, node: Any, code: types.CodeType) -> None:
        self._node, self._code = node, code
        self._numbers = itertools.count()
        self._locals = {*code.co_varnames, *code.co_cellvars}

    def written(self) -> Any:
        """Return the twin."""
        node = self._node
        parameters = node.args
        names = {one.arg for one in [*parameters.posonlyargs, *parameters.args, *parameters.kwonlyargs]}
        names |= {one.arg for one in (parameters.vararg, parameters.kwarg) if one is not None}
        undefined = [
            ast.Assign([ast.Name(name, ast.Store())], ast.Attribute(load(FRAME), "UNDEFINED", ast.Load()))
            for name in _assigned(node.body) if name not in names
        ]  # fmt: skip
        given = ast.arguments(
            [ast.arg(one.arg) for one in parameters.posonlyargs], [ast.arg(one.arg) for one in parameters.args],
            parameters.vararg and ast.arg(parameters.vararg.arg), [ast.arg(one.arg) for one in parameters.kwonlyargs],
            [None] * len(parameters.kwonlyargs), parameters.kwarg and ast.arg(parameters.kwarg.arg), [],
        )  # fmt: skip
        made = definition(node.name, given, [*undefined, *self._block(node.body, last=True)])
        return ast.copy_location(made, node)

    def _refused(self, node: Any, what: str) -> TraceError:
        code = self._code
        return TraceError(f"{code.co_name} has {what}, {code.co_filename}, line {node.lineno}")

    def visit(self, node: Any) -> Any:
        """Return the node of the twin for a node."""
        if isinstance(node, _REFUSED) or (isinstance(node, ast.stmt) and not isinstance(node, _STATEMENTS)):
            raise self._refused(node, f"`{type(node).__name__.lower()}`")
        return super().visit(node)

    # --- Statements ---

    def _block(self, statements: Any, last: bool = False) -> list[Any]:
        """Return statements without unreachable ones."""
        made: list[Any] = []
        for statement in statements:
            written = self.visit(statement)
            written = written if isinstance(written, list) else [written]
            made.extend(ast.copy_location(one, statement) for one in written if one is not None)
            if isinstance(statement, (ast.Return, ast.Break, ast.Continue)):
                return made
        if last:
            made.append(ast.Expr(of_frame("give", ast.Constant(None))))
        return made

    def _as_function(self, name: str, statements: Any) -> ast.FunctionDef:
        """Return a block of statements as a function."""
        names = [one for one in _assigned(statements) if one in self._locals]
        body = self._block(statements)
        body.append(ast.Return(ast.Attribute(load(FRAME), "NEXT", ast.Load())))
        if names:
            body.insert(0, ast.Nonlocal(names))
        return definition(name, arguments(), body)

    def _variables(self, number: int, names: list[str]) -> list[Any]:
        """Return the functions that get and put variables."""
        values = ast.Tuple([load(name) for name in names], ast.Load())
        get = definition(f".get{number}", arguments(), [ast.Return(values)])
        body: list[Any] = [ast.Pass()]
        if names:
            target = ast.Tuple([ast.Name(name, ast.Store()) for name in names], ast.Store())
            body = [ast.Nonlocal(names), ast.Assign([target], load(".values"))]
        return [get, definition(f".put{number}", arguments(".values"), body)]

    def _goes_on(self, call: ast.expr) -> ast.If:
        """Return the test that goes on to the following statements only if the call returns NEXT."""
        test = ast.Compare(call, [ast.IsNot()], [ast.Attribute(load(FRAME), "NEXT", ast.Load())])
        return ast.If(test, [ast.Return(ast.Constant(False))], [])

    def visit_Return(self, node: ast.Return) -> Any:
        value = ast.Constant(None) if node.value is None else self.visit(node.value)
        return ast.Return(of_frame("give", value))

    def visit_If(self, node: ast.If) -> Any:
        number = next(self._numbers)
        names = [one for one in _assigned([*node.body, *node.orelse]) if one in self._locals]
        test = self.visit(node.test)
        first, second = self._as_function(f".then{number}", node.body), self._as_function(f".else{number}", node.orelse)
        names_of = [f"{one}{number}" for one in (".then", ".else", ".get", ".put")]
        call = of_frame("branch", test, *map(load, names_of))
        return [first, second, *self._variables(number, names), self._goes_on(call)]

    def visit_While(self, node: ast.While) -> Any:
        if node.orelse:
            raise self._refused(node, "an `else` of a loop")
        number = next(self._numbers)
        names = [one for one in _assigned(node.body) if one in self._locals]
        test, body = without_arguments(self.visit(node.test)), self._as_function(f".body{number}", node.body)
        call = of_frame("repeat", test, *(load(f"{one}{number}") for one in (".body", ".get", ".put")))
        return [body, *self._variables(number, names), self._goes_on(call)]

    def visit_For(self, node: ast.For) -> Any:
        if node.orelse:
            raise self._refused(node, "an `else` of a loop")
        number = next(self._numbers)
        names = [one for one in _assigned([node]) if one in self._locals]
        taken = [one for one in _names(node.target) if one in self._locals]
        assign = [ast.Nonlocal(taken), ast.Assign([node.target], load(".value"))]
        take = definition(f".take{number}", arguments(".value"), assign)
        body = self._as_function(f".body{number}", node.body)
        names_of = [f"{one}{number}" for one in (".take", ".body", ".get", ".put")]
        call = of_frame("each", self.visit(node.iter), *map(load, names_of))
        return [take, body, *self._variables(number, names), self._goes_on(call)]

    def visit_Break(self, node: ast.Break) -> Any:
        return ast.Return(of_frame("leave"))

    def visit_Continue(self, node: ast.Continue) -> Any:
        return ast.Return(of_frame("again"))

    def visit_AnnAssign(self, node: ast.AnnAssign) -> Any:
        if node.value is None:
            return ast.Pass()
        return ast.Assign([self.visit(node.target)], self.visit(node.value))

    def visit_FunctionDef(self, node: ast.FunctionDef) -> Any:
        return node

    # --- Expressions: calls and decisions go through the frame ---

    def visit_Call(self, node: ast.Call) -> Any:
        """`function(...)`"""
        given = [self.visit(one) for one in node.args]
        named = [ast.keyword(one.arg, self.visit(one.value)) for one in node.keywords]
        if isinstance(node.func, ast.Name) and node.func.id == "super" and not given:
            # Python finds both arguments by itself, but not in the blocks of a twin.
            given = [load("__class__"), load(self._code.co_varnames[0])]
        made = of_frame("call", self.visit(node.func), *given)
        made.keywords = named
        return ast.copy_location(made, node)

    def visit_IfExp(self, node: ast.IfExp) -> Any:
        """`first if test else second`"""
        ways = (without_arguments(self.visit(one)) for one in (node.body, node.orelse))
        return ast.copy_location(of_frame("choose", self.visit(node.test), *ways), node)

    def visit_BoolOp(self, node: ast.BoolOp) -> Any:
        """`and`, `or`"""
        first, *rest = node.values
        other = rest[0] if len(rest) == 1 else ast.copy_location(ast.BoolOp(node.op, rest), node)
        name = "both" if isinstance(node.op, ast.And) else "either"
        return ast.copy_location(of_frame(name, self.visit(first), without_arguments(self.visit(other))), node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Any:
        """`not`"""
        if not isinstance(node.op, ast.Not):
            return self.generic_visit(node)
        return ast.copy_location(of_frame("negate", self.visit(node.operand)), node)

    def visit_Compare(self, node: ast.Compare) -> Any:
        """`in`, `is`, and comparisons in a row"""
        if len(node.ops) == 1:
            made, (asked,) = self.generic_visit(node), node.ops
            if isinstance(asked, (ast.In, ast.NotIn)):
                found = of_frame("contains", node.comparators[0], node.left)
            elif isinstance(asked, (ast.Is, ast.IsNot)):
                found = of_frame("same", node.left, node.comparators[0])
            else:
                return made
            found = of_frame("negate", found) if isinstance(asked, (ast.NotIn, ast.IsNot)) else found
            return ast.copy_location(found, node)
        terms = [node.left, *node.comparators]
        # A term in two comparisons needs a copy for each.
        pairs = zip(terms, node.ops, map(copy.deepcopy, terms[1:]), strict=False)
        return self.visit(
            ast.copy_location(ast.BoolOp(ast.And(), [ast.Compare(a, [op], [b]) for a, op, b in pairs]), node)
        )

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """Write an element through the frame."""
        if not isinstance(node.ctx, ast.Load):
            return self.generic_visit(node)
        return ast.copy_location(of_frame("item", self.visit(node.value), self._place(node.slice)), node)

    def _place(self, node: Any) -> Any:
        if isinstance(node, ast.Tuple):
            return ast.Tuple([self._place(one) for one in node.elts], ast.Load())
        if isinstance(node, ast.Slice):
            parts = [
                ast.Constant(None) if one is None else self.visit(one) for one in (node.lower, node.upper, node.step)
            ]
            return ast.Call(load("slice"), parts, [])
        return self.visit(node)

    def visit_Lambda(self, node: ast.Lambda) -> Any:
        """Keep a function, which is traced where it is called."""
        return node
