"""Twins of functions for traces: the same statements, with control flow and calls that go through a `CallFrame`.

    if x > 0.0:          def then():
        y = x                nonlocal y
    else:                    y = x
        y = f(x)             return frame.NEXT
                         ...
                         if frame.branch(x > 0.0, then, other, get, put) is not frame.NEXT:
                             return False

The twin has the globals and the cells of the function, so that names mean what they mean there, and its line numbers.
"""

import ast
import functools
import itertools
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .expressions import Expressions, load, of_frame, without_arguments
from .frame import CallFrame
from .source import FRAME, arguments, compiled, definition, node_of
from .values import UNDEFINED, TraceError


def twin_of(function: Any, frame: CallFrame) -> Callable[..., Any]:
    """The twin of a function for one call of it.

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


# What a function may refer to: what may change later is not known when a kernel is compiled.
_LASTING = (tuple, str, bytes, int, float, complex, type(None), range, np.generic, np.ndarray, types.ModuleType)


@functools.cache
def _maker(function: Any) -> Any:
    """The function (frame, cells) that gives the twin."""
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
    """The code of a function (frame, cells) that gives the twin."""
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
    """The names that statements assign, in their order."""
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
    """The variables in what is assigned to."""
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


class _TwinWriter(Expressions, ast.NodeTransformer):
    """Writes the twin of one function."""

    def __init__(self, node: Any, code: types.CodeType) -> None:
        self._node, self._code = node, code
        self._numbers = itertools.count()
        self._locals = {*code.co_varnames, *code.co_cellvars}

    def written(self) -> Any:
        """The twin."""
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
        """The node of the twin for a node."""
        if isinstance(node, _REFUSED) or (isinstance(node, ast.stmt) and not isinstance(node, _STATEMENTS)):
            raise self._refused(node, f"`{type(node).__name__.lower()}`")
        return super().visit(node)

    # --- Statements ---

    def _block(self, statements: Any, last: bool = False) -> list[Any]:
        """Statements; those that nothing reaches are left out."""
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
        """A block of statements as a function."""
        names = [one for one in _assigned(statements) if one in self._locals]
        body = self._block(statements)
        body.append(ast.Return(ast.Attribute(load(FRAME), "NEXT", ast.Load())))
        if names:
            body.insert(0, ast.Nonlocal(names))
        return definition(name, arguments(), body)

    def _variables(self, number: int, names: list[str]) -> list[Any]:
        """The functions that get and put variables."""
        values = ast.Tuple([load(name) for name in names], ast.Load())
        get = definition(f".get{number}", arguments(), [ast.Return(values)])
        body: list[Any] = [ast.Pass()]
        if names:
            target = ast.Tuple([ast.Name(name, ast.Store()) for name in names], ast.Store())
            body = [ast.Nonlocal(names), ast.Assign([target], load(".values"))]
        return [get, definition(f".put{number}", arguments(".values"), body)]

    def _goes_on(self, call: ast.expr) -> ast.If:
        """The statements that are reached only where the call says so."""
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
