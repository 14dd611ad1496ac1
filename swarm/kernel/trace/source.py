"""The syntax of a function that Python has compiled: the place of its source, and whether the source is unchanged."""

import ast
import contextlib
import functools
import linecache
import os
import time
import types
from typing import Any

_STARTED = time.time()

# Names that no function has: the syntax tree allows them, and no text does.
FRAME, _TWIN = ".frame", ".twin"


def node_of(code: types.CodeType) -> Any:
    """Return the syntax of a function, or None if its file is not known or does not contain it any more."""
    text = _text(code.co_filename)
    found = _nodes_at(text, code.co_firstlineno, code.co_name)
    for node in found:
        is_lambda = isinstance(node, ast.Lambda)
        body = [ast.copy_location(ast.Return(node.body), node)] if is_lambda else node.body
        given = ast.copy_location(definition(_TWIN, node.args, body), node)
        if len(found) == 1 or _compared(_inner(compiled(given, code))) == _compared(code):
            return given if _is_as_written(code, text) else None
    return None


def arguments(*names: str) -> ast.arguments:
    """Arguments without defaults."""
    return ast.arguments([], [ast.arg(name) for name in names], None, [], [], None, [])


def definition(name: str, arguments: ast.arguments, body: list[Any]) -> ast.FunctionDef:
    """Return the syntax of a function."""
    made = ast.FunctionDef(name, arguments, body, [], None, None)
    made.type_params = []  # type: ignore[attr-defined]  # from Python 3.12 on
    return made


def compiled(node: Any, code: types.CodeType) -> types.CodeType:
    """Return a function inside a function of its frame and its free variables."""
    result = ast.Return(ast.Name(node.name, ast.Load()))
    outer = definition("make", arguments(FRAME, *code.co_freevars), [node, result])
    tree = ast.fix_missing_locations(ast.Module([ast.copy_location(outer, node)], []))
    whole = compile(tree, code.co_filename, "exec", dont_inherit=True)
    return _inner(whole)


def _inner(code: types.CodeType) -> types.CodeType:
    return next(one for one in code.co_consts if isinstance(one, types.CodeType))


def _compared(code: types.CodeType) -> Any:
    """Return the parts that distinguish two functions of one line; code itself depends on the imports of the file."""
    return code.co_names, code.co_varnames, code.co_freevars, [one for one in code.co_consts if one is not None]


def _text(file: str) -> str:
    linecache.checkcache(file)
    return "".join(linecache.getlines(file))


def _is_as_written(code: types.CodeType, text: str) -> bool:
    """Whether a function is still as in its file: a user may edit the file during a session."""
    with contextlib.suppress(OSError):
        found = os.stat(code.co_filename)
        if max(found.st_mtime, found.st_ctime) < _STARTED:
            return True  # 0.1 s sooner than by its code
    return code in _codes(code.co_filename, text)


@functools.cache
def _codes(file: str, text: str) -> set[types.CodeType]:
    found = [compile(text, file, "exec", dont_inherit=True)]
    for code in found:
        found.extend(one for one in code.co_consts if isinstance(one, types.CodeType))
    return set(found)


def _nodes_at(text: str, line: int, name: str) -> list[Any]:
    """Return the functions of that name that begin in a line of a text."""
    if name != "<lambda>":
        return [one for one in _definitions(text) if one.name == name and _first_line(one) == line]
    inside = [one for one in _statements(text) if one.lineno <= line <= one.end_lineno]
    found = (one for statement in inside for one in ast.walk(statement))
    # A lambda in a function is found in the function as well as in the statement around it.
    return list({id(one): one for one in found if isinstance(one, ast.Lambda) and one.lineno == line}.values())


def _first_line(node: ast.FunctionDef) -> int:
    return min([node.lineno, *(one.lineno for one in node.decorator_list)])


@functools.cache
def _statements(text: str) -> list[Any]:
    try:
        return ast.parse(text).body
    except SyntaxError:
        return []


@functools.cache
def _definitions(text: str) -> list[ast.FunctionDef]:
    """Return the functions of a text, also those in functions, classes and branches."""
    statements = list(_statements(text))
    for one in statements:
        for block in ("body", "orelse", "finalbody"):
            statements.extend(getattr(one, block, ()))
    return [one for one in statements if isinstance(one, ast.FunctionDef)]
