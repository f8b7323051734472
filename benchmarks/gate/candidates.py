"""What can be mutated: what a trial runs, and no refusals of settings, texts or annotations."""

from __future__ import annotations

import ast
import hashlib
import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.gate.operators import FunctionNode, Place, places, without_docstring

_REFUSING: Final = ("check", "_check_index", "__post_init__", "require", "_require")
"""How functions are called, or begin, that refuse what was set before any trial."""
_CHECKING: Final = {
    "Range", "check_known", "check_names", "require_finite", "require_floor", "require_keys", "require_names",
    "require_one_of", "require_room", "require_whole",
}  # fmt: skip
"""Functions that only refuse settings and files, or numbers that the filter has refused before; what they are called
with is no behaviour of a trial."""
_SETTING: Final = re.compile(r"[a-z_]+(\.\w+)+")
"""How a setting is called where it is checked: with the table that it stands in."""
_MODULE: Final = "<module>"


@dataclass(frozen=True)
class Mutant:
    """One small change.

    Attributes:
        id: The same for the same change of the same function.
        package: Such as ``tasks`` or ``replay``.
        file: Relative to the checkout.
        line: Where the change is.
        function: With its classes; ``<module>`` for none.
        operator: Kind of the change.
        was: What is replaced.
        becomes: By this.
    """

    id: str
    package: str
    file: str
    line: int
    function: str
    operator: str
    was: str
    becomes: str


@dataclass(frozen=True)
class Candidate:
    """A mutant, its place, and the lines of which a log has to run one to show it; none if every log can."""

    mutant: Mutant
    place: Place
    variant: int
    lines: frozenset[int]


def candidates(checkout: Path, lines: Mapping[str, Collection[int]], packages: Collection[str]) -> list[Candidate]:
    """All mutants of lines that are run, in these packages; in all of them if there are none."""
    found: list[Candidate] = []
    for file, run in sorted(lines.items()):
        package = Path(file).parts[3].removesuffix(".py")
        if not packages or package in packages:
            found += _candidates(package, file, (checkout / file).read_text(encoding="utf-8"), run)
    return found


def draw(found: Collection[Candidate], count: int, seed: int) -> list[Candidate]:
    """Places by their digests with the seed, one change at each, so that changes elsewhere draw no others."""
    by_place: dict[int, list[Candidate]] = defaultdict(list)
    for one in found:
        by_place[id(one.place)].append(one)
    ranked = sorted(((_rank(seed, ones[0].mutant.id), ones) for ones in by_place.values()), key=lambda pair: pair[0])
    return [ones[rank % len(ones)] for rank, ones in ranked[:count]]


def _rank(seed: int, id_: str) -> int:
    return int.from_bytes(hashlib.sha256(f"{seed} {id_}".encode()).digest(), "big")


def _candidates(package: str, file: str, source: str, run: Collection[int]) -> Iterator[Candidate]:
    module = ast.parse(source)
    bodies: list[tuple[str, ast.AST]] = list(_functions(module, ""))
    inside = {node for _, function in bodies for node in ast.walk(function)}
    bodies += [
        (_MODULE, one)
        for one in module.body
        if isinstance(one, ast.Assign | ast.AnnAssign) and one not in inside and not _unread(one, module, run)
    ]
    for name, node in bodies:
        if name.rpartition(".")[2].startswith(_REFUSING):
            continue
        text, starts, idle = ast.unparse(node), _statement_lines(node), _idle(node)
        for operator, ones in sorted(places(node).items()):
            if operator == "statement" and name == _MODULE:
                continue  # without it nothing can even be imported
            for number, place in enumerate(ones):
                ours = frozenset({place.node.lineno, starts.get(place.node, -1)} & set(run))
                if place.node in idle or (name != _MODULE and not ours):
                    continue
                for variant, becomes in enumerate(place.variants):
                    key = "\0".join((Path(file).name, name, text, operator, str(number), str(variant)))
                    digest = hashlib.sha256(key.encode()).hexdigest()[:10]
                    was, line = ast.unparse(place.node), place.node.lineno
                    mutant = Mutant(digest, package, file, line, name, operator, was, becomes)
                    yield Candidate(mutant, place, variant, frozenset() if name == _MODULE else ours)


def _functions(body: ast.Module | ast.ClassDef, within: str) -> Iterator[tuple[str, FunctionNode]]:
    """Functions and methods that do anything; functions within functions are part of the outer one."""
    for node in body.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            if without_docstring(node):
                yield within + node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from _functions(node, f"{within}{node.name}.")


def _unread(constant: ast.Assign | ast.AnnAssign, module: ast.Module, run: Collection[int]) -> bool:
    """Whether this is a module's own constant, and no line that is run reads it."""
    target = constant.target if isinstance(constant, ast.AnnAssign) else constant.targets[0]
    name, lines = ast.unparse(target), _statement_lines(module)
    read = {*run, *(one.lineno for one in module.body if not isinstance(one, ast.FunctionDef | ast.ClassDef))}
    found = (node for node in ast.walk(module) if isinstance(node, ast.Name) and node.id == name and node is not target)
    return name.startswith("_") and not any({node.lineno, lines[node]} & read for node in found)


def _idle(function: ast.AST) -> set[ast.AST]:
    """What no trial can show: what only refuses settings, zip's ``strict=``, a return where a function ends anyway."""
    found: set[ast.AST] = set()
    for node in ast.walk(function):
        if _names_accepted(node) or (isinstance(node, ast.If) and not node.orelse and all(map(_refuses, node.body))):
            found |= set(ast.walk(node))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and _checks(node.value):
            found |= set(ast.walk(node))
        elif isinstance(node, ast.Call) and _checks(node):
            found |= {inner for inner in ast.walk(node) if isinstance(inner, ast.Constant)}
        elif isinstance(node, ast.keyword) and node.arg == "strict":
            found.add(node.value)
        elif isinstance(node, ast.FunctionDef) and _returns_nothing(node.body[-1]):
            found |= set(ast.walk(node.body[-1]))
    return found


def _refuses(statement: ast.stmt) -> bool:
    raises = isinstance(statement, ast.Raise) and "ConfigurationError" in ast.unparse(statement)
    return raises or _names_accepted(statement)


def _names_accepted(node: ast.AST) -> bool:
    """Whether this is the text of a refusal: what would be accepted."""
    return isinstance(node, ast.Assign) and [ast.unparse(target) for target in node.targets] == ["accepted"]


def _checks(call: ast.Call) -> bool:
    """Whether it is called for what it refuses: by its name, or with a setting's name first."""
    name = ast.unparse(call.func).rpartition(".")[2]
    first = call.args[0] if call.args else None
    setting = isinstance(first, ast.Constant) and _SETTING.fullmatch(str(first.value)) is not None
    return name in _CHECKING or setting


def _returns_nothing(statement: ast.stmt) -> bool:
    value = statement.value if isinstance(statement, ast.Return) else statement
    return value is None or (isinstance(value, ast.Constant) and value.value is None)


def _statement_lines(function: ast.AST) -> dict[ast.AST, int]:
    """The line on which the statement begins that a node is part of."""
    found: dict[ast.AST, int] = {}

    def walk(node: ast.AST, line: int) -> None:
        here = node.lineno if isinstance(node, ast.stmt) else line
        found[node] = here
        for child in ast.iter_child_nodes(node):
            walk(child, here)

    walk(function, getattr(function, "lineno", -1))
    return found
