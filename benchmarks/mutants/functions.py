"""The functions of a checkout, by what they say and not by where they stand."""

from __future__ import annotations

import ast
import copy
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from benchmarks.house import modules_of

FunctionNode: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
_Body: TypeAlias = FunctionNode | ast.ClassDef | ast.Module


@dataclass(frozen=True)
class Function:
    """A function or method; functions within functions are part of the outer one.

    Attributes:
        name: With its classes, as ``Kinematics.update``.
        text: What it says: without docstrings, comments, layout, and where it imports from.
        file: Relative to the checkout.
        node: In the tree of the whole file.
    """

    name: str
    text: str
    file: str
    node: FunctionNode

    @property
    def key(self) -> tuple[str, str]:
        return self.name, self.text


def functions_of(checkout: Path) -> list[Function]:
    """Every function of the four roots that does anything."""
    found = []
    for path in modules_of(checkout).values():
        file = str(path.relative_to(checkout))
        found += functions_in(path.read_text(encoding="utf-8"), file)
    return found


def functions_in(source: str, file: str) -> list[Function]:
    """The same of one file."""
    named = _named(ast.parse(source, file), "")
    return [Function(name, normalised(node), file, node) for name, node in named if not is_stub(node)]


def _named(body: ast.Module | ast.ClassDef, within: str) -> Iterator[tuple[str, FunctionNode]]:
    for node in body.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield within + node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from _named(node, f"{within}{node.name}.")


def unique(functions: list[Function]) -> dict[tuple[str, str], Function]:
    """Those that no other one equals in name and text."""
    by_key: dict[tuple[str, str], list[Function]] = defaultdict(list)
    for function in functions:
        by_key[function.key].append(function)
    return {key: ones[0] for key, ones in by_key.items() if len(ones) == 1}


def without_docstring(node: _Body) -> list[ast.stmt]:
    """What a body does."""
    return node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body


def is_stub(node: FunctionNode) -> bool:
    """Whether it only says what others have to do."""
    body = without_docstring(node)
    if not body:
        return True
    only = body[0] if len(body) == 1 else None
    if isinstance(only, ast.Raise):
        return "NotImplementedError" in ast.unparse(only)
    return isinstance(only, ast.Pass) or (isinstance(only, ast.Expr) and isinstance(only.value, ast.Constant))


def normalised(node: FunctionNode) -> str:
    """The text that is compared."""
    node = copy.deepcopy(node)
    for inner in ast.walk(node):
        if isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            inner.body = without_docstring(inner) or [ast.Pass()]
        elif isinstance(inner, ast.ImportFrom) and (inner.level or (inner.module or "").startswith("palpate")):
            inner.module, inner.level = "palpate", 0
        elif isinstance(inner, ast.Import):
            for alias in inner.names:
                alias.name = "palpate" if alias.name.startswith("palpate.") else alias.name
    return ast.unparse(node)
