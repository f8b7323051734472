"""Statements of supervision and tasks that no golden log runs, and why."""

from __future__ import annotations

import ast
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final

from benchmarks.mutants.functions import functions_in

THOROUGH: Final = ("core/palpate/core/supervision/", "core/palpate/core/tasks/")
"""Where no survivor stays unexplained, and every line is to be run, if a trial runs the module at all."""
NOT_RUN: Final = Path(__file__).with_name("not_run.json")
"""Why no trial that is recorded runs a statement, by its function and what it says."""


def unrun(checkout: Path, lines: Mapping[str, Collection[int]]) -> dict[str, str]:
    """Statements of the thorough files that no golden log runs, and why; empty where no reason is known."""
    reasons: dict[str, str] = json.loads(NOT_RUN.read_text(encoding="utf-8"))
    told = {}
    for file in sorted(lines):
        if not file.startswith(THOROUGH):
            continue
        source = (checkout / file).read_text(encoding="utf-8")
        for function in functions_in(source, file):
            for node in ast.walk(function.node):
                if isinstance(node, ast.stmt) and node is not function.node and not _is_text(node):
                    statement = f"{function.name}: {ast.unparse(node).splitlines()[0]}"
                    # A condition in brackets begins below its "elif".
                    if not {node.lineno, getattr(node, "test", node).lineno} & set(lines[file]):
                        told[f"{file}:{node.lineno} {statement}"] = reasons.get(statement, "")
    return told


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
