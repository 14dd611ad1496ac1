"""Expressions in twins: calls and decisions go through a `Frame`."""

import ast
import copy
from types import CodeType
from typing import Any

from .source import FRAME, arguments


def load(name: str) -> ast.Name:
    """A variable."""
    return ast.Name(name, ast.Load())


def of_frame(name: str, *given: ast.expr) -> ast.Call:
    """A call of a method of the frame."""
    return ast.Call(ast.Attribute(load(FRAME), name, ast.Load()), list(given), [])


def without_arguments(body: Any) -> ast.Lambda:
    """An expression as a function."""
    return ast.Lambda(arguments(), body)


class Expressions(ast.NodeTransformer):
    """Writes the expressions of the twin of a function."""

    _code: CodeType

    def visit_Call(self, node: ast.Call) -> Any:
        """`function(...)`"""
        given = [self.visit(one) for one in node.args]
        named = [ast.keyword(one.arg, self.visit(one.value)) for one in node.keywords]
        if isinstance(node.func, ast.Name) and node.func.id == "super" and not given:
            # Python finds both by itself, but not in the blocks of a twin.
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
        # Of a term that stands in two comparisons each has its own.
        pairs = zip(terms, node.ops, map(copy.deepcopy, terms[1:]), strict=False)
        return self.visit(
            ast.copy_location(ast.BoolOp(ast.And(), [ast.Compare(a, [op], [b]) for a, op, b in pairs]), node)
        )

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        """An element."""
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
        """A function, which is traced where it is called."""
        return node
