"""What can be mutated of the core: what a trial runs, and no refusals of settings, texts or annotations."""

from __future__ import annotations

import ast
import hashlib
import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from benchmarks.mutants.functions import functions_in, normalised
from benchmarks.mutants.operators import Place, places

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
class CoreMutant:
    """One small change of the core.

    Attributes:
        id: The same for the same change of the same function.
        file: Relative to the checkout.
        line: Where the change is.
        function: In which function; ``<module>`` for none.
        operator: Kind of the change.
        was: What is replaced.
        becomes: By this.
    """

    id: str
    file: str
    line: int
    function: str
    operator: str
    was: str
    becomes: str


@dataclass(frozen=True)
class Candidate:
    """A mutant, how it is made, and the lines of which a log runs one if it can show it; none if every log can."""

    mutant: CoreMutant
    place: Place
    variant: int
    lines: frozenset[int]


def candidates(checkout: Path, lines: Mapping[str, Collection[int]]) -> dict[str, list[Candidate]]:
    """All mutants of lines that are run, by file."""
    found: dict[str, list[Candidate]] = {}
    for file, run in sorted(lines.items()):
        source = (checkout / file).read_text(encoding="utf-8")
        ours = list(_candidates(file, source, run))
        if ours:
            found[file] = ours
    return found


def _candidates(file: str, source: str, run: Collection[int]) -> Iterator[Candidate]:
    named = functions_in(source, file)
    bodies: list[tuple[str, str, Any]] = [(f.name, normalised(f.node), f.node) for f in named]
    inside = {node for _, _, function in bodies for node in ast.walk(function)}
    module = ast.parse(source)
    # Texts of a module's own statements are told apart by where they stand among them.
    bodies += [
        (_MODULE, ast.unparse(one), one)
        for one in module.body
        if isinstance(one, ast.Assign | ast.AnnAssign) and one not in inside and not _unread(one, module, run)
    ]
    for name, text, node in bodies:
        if name.rpartition(".")[2].startswith(_REFUSING):
            continue
        starts, idle = _statement_lines(node), _idle(node)
        for operator, ones in sorted(places(node).items()):
            if operator == "statement" and name == _MODULE:
                continue  # without it nothing can even be imported
            for number, place in enumerate(ones):
                if place.node in idle:
                    continue
                ours = frozenset({place.node.lineno, starts.get(place.node, -1)} & set(run))
                if name != _MODULE and not ours:
                    continue
                for variant, becomes in enumerate(place.variants):
                    key = "\0".join((Path(file).name, name, text, operator, str(number), str(variant)))
                    yield Candidate(
                        CoreMutant(
                            hashlib.sha256(key.encode()).hexdigest()[:10],
                            file,
                            place.node.lineno,
                            name,
                            operator,
                            ast.unparse(place.node),
                            becomes,
                        ),
                        place,
                        variant,
                        frozenset() if name == _MODULE else ours,
                    )


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


def draw(found: dict[str, list[Candidate]], one_in: int, seed: int) -> list[Candidate]:
    """One place in so many, by its own digest with the seed, and one of every file; one change at each place.

    What changes in one function leaves the places of the others drawn or not, as they were. Only of a file that would
    have none is that of the least digest drawn, whichever function it is in.
    """
    most, chosen = 2**256 // one_in, list[Candidate]()
    for ones in found.values():
        by_place: dict[int, list[Candidate]] = defaultdict(list)
        for one in ones:
            by_place[id(one.place)].append(one)
        ranked = [(_rank(seed, variants[0].mutant.id), variants) for variants in by_place.values()]
        kept = [one for one in ranked if one[0] < most] or [min(ranked, key=lambda one: one[0])]
        drawn = (variants[rank % len(variants)] for rank, variants in kept)
        chosen += sorted(drawn, key=lambda one: one.mutant.line)
    return chosen


def _rank(seed: int, id_: str) -> int:
    return int.from_bytes(hashlib.sha256(f"{seed} {id_}".encode()).digest(), "big")
