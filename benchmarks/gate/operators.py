"""Mutations: small changes of a function's source, each at one place."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from textwrap import indent
from typing import Final, TypeAlias

FunctionNode: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
_Found: TypeAlias = Iterator[tuple[str, "Place"]]

_COMPARISONS: Final[dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_ARITHMETIC: Final[dict[type[ast.operator], type[ast.operator]]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.BitXor: ast.BitAnd,
}
_DROPPED: Final = (
    ast.Assign, ast.AugAssign, ast.Return, ast.Raise, ast.Delete, ast.Assert, ast.Break, ast.Continue,
)  # fmt: skip


@dataclass(frozen=True)
class Place:
    """Where a function can be mutated.

    Attributes:
        node: Its part of the source is replaced.
        variants: By one of these.
    """

    node: ast.expr | ast.stmt
    variants: tuple[str, ...]

    def applied(self, source: str, variant: int) -> str:
        """The source of the whole file, mutated."""
        data = source.encode()
        starts = [0]
        for line in data.splitlines(keepends=True):
            starts.append(starts[-1] + len(line))
        node = self.node
        end_line, end_column = node.end_lineno or node.lineno, node.end_col_offset or node.col_offset
        begin, end = starts[node.lineno - 1] + node.col_offset, starts[end_line - 1] + end_column
        return (data[:begin] + self.variants[variant].encode() + data[end:]).decode()


def without_docstring(node: FunctionNode | ast.ClassDef) -> list[ast.stmt]:
    """What a body does."""
    return node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body


def places(function: ast.AST) -> dict[str, list[Place]]:
    """Every place by operator, in the order of the text; the same for functions whose normalised text is equal."""
    found: dict[str, list[Place]] = defaultdict(list)
    elifs: set[ast.AST] = set()
    for node in _mutable(function):
        if isinstance(node, ast.If) and _has_elif(node):
            elifs.add(node.orelse[0])
        for operator, place in _of(node):
            # An elif cannot be written anew without the statement that it belongs to.
            if place.node is not node or node not in elifs:
                found[operator].append(place)
    return dict(found)


def _has_elif(node: ast.If) -> bool:
    return len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If) and node.orelse[0].col_offset == node.col_offset


def _mutable(node: ast.AST) -> Iterator[ast.AST]:
    """What can be mutated below a node: no annotations, decorators or docstrings.

    Nothing in f-strings either: it makes texts for people, and Python 3.11 does not know where in them it stands.
    """
    children: list[ast.AST]
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        children = [*_defaults(node.args), *without_docstring(node)]
    elif isinstance(node, ast.Lambda):
        children = [*_defaults(node.args), node.body]
    elif isinstance(node, ast.ClassDef):
        children = [*without_docstring(node)]
    elif isinstance(node, ast.AnnAssign):
        children = [] if node.value is None else [node.value]
    elif isinstance(node, ast.JoinedStr):
        children = []
    else:
        children = list(ast.iter_child_nodes(node))
    for child in children:
        yield child
        yield from _mutable(child)


def _defaults(arguments: ast.arguments) -> list[ast.expr]:
    return [*arguments.defaults, *(value for value in arguments.kw_defaults if value is not None)]


def _of(node: ast.AST) -> _Found:
    if isinstance(node, ast.If | ast.While | ast.IfExp | ast.Assert) and not _is_not(node.test):
        yield "boolean", _instead(node.test, _negated(node.test))
    if isinstance(node, ast.comprehension):
        for test in node.ifs:
            yield "boolean", _instead(test, _negated(test))
    if isinstance(node, ast.Compare):
        yield from _comparisons(node)
    elif isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        yield "arithmetic", _instead(node, _with(node, op=_ARITHMETIC[type(node.op)]()))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "arithmetic", _instead(node, node.operand)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield "boolean", _instead(node, node.operand)
    elif isinstance(node, ast.BoolOp):
        yield "boolean", _instead(node, _with(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And()))
    elif isinstance(node, ast.Constant):
        yield from _constants(node)
    elif isinstance(node, ast.IfExp):
        yield "branches", _instead(node, _with(node, body=node.orelse, orelse=node.body))
    elif isinstance(node, ast.stmt):
        yield from _statements(node)


def _comparisons(node: ast.Compare) -> _Found:
    for i, op in enumerate(node.ops):
        swapped = [_with(node, ops=[*node.ops[:i], other(), *node.ops[i + 1 :]]) for other in _COMPARISONS[type(op)]]
        yield "comparison", _instead(node, *swapped)


def _constants(node: ast.Constant) -> _Found:
    if isinstance(node.value, bool):
        yield "boolean", _instead(node, ast.Constant(not node.value))
    elif isinstance(node.value, int | float):
        yield "constant", _instead(node, ast.Constant(node.value + 1), ast.Constant(node.value - 1))


def _statements(node: ast.stmt) -> _Found:
    if isinstance(node, ast.AugAssign) and type(node.op) in _ARITHMETIC:
        yield "arithmetic", Place(node, (ast.unparse(_with(node, op=_ARITHMETIC[type(node.op)]())),))
    is_call = isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant)
    if isinstance(node, _DROPPED) or is_call or (isinstance(node, ast.AnnAssign) and node.value is not None):
        yield "statement", Place(node, ("pass",))
    if isinstance(node, ast.If) and node.orelse:
        swapped = ast.unparse(_with(node, body=node.orelse, orelse=node.body))
        yield "branches", Place(node, (indent(swapped, " " * node.col_offset).lstrip(),))


def _is_not(node: ast.expr) -> bool:
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)


def _negated(node: ast.expr) -> ast.expr:
    return ast.UnaryOp(ast.Not(), node)


def _with(node: ast.AST, **changed: object) -> ast.AST:
    other = copy(node)
    for name, value in changed.items():
        setattr(other, name, value)
    return other


def _instead(node: ast.expr, *others: ast.AST) -> Place:
    # In parentheses it means the same wherever it stands.
    return Place(node, tuple(f"({ast.unparse(other)})" for other in others))
