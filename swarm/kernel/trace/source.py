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
# Nodes that have a place in the text, and nodes with such nodes inside.
_WITH_PLACES = ast.stmt, ast.expr, ast.arguments, ast.arg, ast.keyword, ast.comprehension, ast.withitem


def node_of(code: types.CodeType) -> Any:
    """Return the syntax of a function, or None if its file is not known or does not contain it any more."""
    lines = _lines(code.co_filename)
    found = _nodes_at(lines, code.co_firstlineno, code.co_name)
    for node in found:
        is_lambda = isinstance(node, ast.Lambda)
        body = [ast.copy_location(ast.Return(node.body), node)] if is_lambda else node.body
        given = ast.copy_location(definition(_TWIN, node.args, body), node)
        if len(found) == 1 or _compared(_inner(compiled(given, code))) == _compared(code):
            return given if _is_as_written(code, lines) else None
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
    _place(outer, node.lineno, node.col_offset)
    whole = compile(ast.Module([outer], []), code.co_filename, "exec", dont_inherit=True)
    return _inner(whole)


def _place(node: Any, line: int, column: int) -> None:
    """Give each node without a place in the text the place of its parent, in half the time that `ast` takes for it."""
    if node._attributes:
        try:
            line, column = node.lineno, node.col_offset
        except AttributeError:
            node.lineno, node.col_offset = line, column
    for field in node._fields:
        inside = getattr(node, field, None)
        for one in inside if isinstance(inside, list) else (inside,):
            if isinstance(one, _WITH_PLACES):
                _place(one, line, column)


def _inner(code: types.CodeType) -> types.CodeType:
    return next(one for one in code.co_consts if isinstance(one, types.CodeType))


def _compared(code: types.CodeType) -> Any:
    """Return the parts that distinguish two functions of one line; code itself depends on the imports of the file."""
    return code.co_names, code.co_varnames, code.co_freevars, [one for one in code.co_consts if one is not None]


def _lines(file: str) -> list[str]:
    linecache.checkcache(file)
    return linecache.getlines(file)


def _is_as_written(code: types.CodeType, lines: list[str]) -> bool:
    """Whether a function is still as in its file: a user may edit the file during a session."""
    with contextlib.suppress(OSError):
        found = os.stat(code.co_filename)
        if max(found.st_mtime, found.st_ctime) < _STARTED:
            return True  # 0.1 s sooner than by its code
    return code in _codes(code.co_filename, "".join(lines))


@functools.cache
def _codes(file: str, text: str) -> set[types.CodeType]:
    found = [compile(text, file, "exec", dont_inherit=True)]
    for code in found:
        found.extend(one for one in code.co_consts if isinstance(one, types.CodeType))
    return set(found)


def _nodes_at(lines: list[str], line: int, name: str) -> list[Any]:
    """Return the functions of that name that begin in a line of a text."""
    if name != "<lambda>":
        alone = _definition_alone(lines, line)
        named = _definitions("".join(lines)) if alone is None else [alone]
        return [one for one in named if one.name == name and _first_line(one) == line]
    inside = [one for one in _statements("".join(lines)) if one.lineno <= line <= one.end_lineno]
    found = (one for statement in inside for one in ast.walk(statement))
    # A lambda in a function is found in the function as well as in the statement around it.
    return list({id(one): one for one in found if isinstance(one, ast.Lambda) and one.lineno == line}.values())


def _definition_alone(lines: list[str], line: int) -> Any:
    """The function that begins in a line, parsed without the rest of the text; None where that fails.

    It ends before the next statement that is indented no more. A string that such a line is in, or a bracket that it
    leaves open, would end in the middle: that fails.
    """
    first, margin = line - 1, _margin("".join(lines[line - 1 : line]))
    left = (k for k in range(first, len(lines)) if _margin(lines[k]) <= margin)
    statements = (k for k in left if lines[k].lstrip()[:1] not in ("", "#", ")", "]", "}"))
    next((k for k in statements if not lines[k].lstrip().startswith("@")), None)
    text = "".join(lines[first : next(statements, len(lines))])
    # Behind lines without a text, for it to have its own numbers of lines.
    whole = "\n" * first + text if margin == 0 else "\n" * (first - 1) + "if True:\n" + text
    statement = _parsed(whole)[:1]
    found = statement[0].body[:1] if margin and statement else statement
    return found[0] if found and isinstance(found[0], ast.FunctionDef) else None


def _margin(line: str) -> int:
    return len(line) - len(line.lstrip())


def _first_line(node: ast.FunctionDef) -> int:
    return min([node.lineno, *(one.lineno for one in node.decorator_list)])


def _parsed(text: str) -> list[Any]:
    try:
        return ast.parse(text).body
    except SyntaxError:
        return []


_statements = functools.cache(_parsed)


@functools.cache
def _definitions(text: str) -> list[ast.FunctionDef]:
    """Return the functions of a text, also those in functions, classes and branches."""
    statements = list(_statements(text))
    for one in statements:
        for block in ("body", "orelse", "finalbody"):
            statements.extend(getattr(one, block, ()))
    return [one for one in statements if isinstance(one, ast.FunctionDef)]
