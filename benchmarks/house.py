"""How the sources are laid out: rooms, arrows between them, floors, circles, lines, names of several things.

    python -m benchmarks.house                           this checkout
    python -m benchmarks.house --checkout ../before --json before.json

A room is a package or module directly below a root's package (``palpate.core``, ``palpate.adapters``, ...). An arrow is
an ordered pair of rooms of one root, where some file of the first imports something of the second: anywhere in the
file, also inside functions and for type checkers only. Nothing is imported here, only text is read, so that a checkout
need not be installed. A root's floors are the rooms of the longest chain of arrows.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TypeAlias

ROOTS = ("core", "adapters", "drivers", "simulation")
# As entry points and tables of commands name them: `palpate.adapters.cli.main` or `palpate.adapters.cli.main:main`.
MODULE_NAME = re.compile(r"palpate(\.\w+)+(:[\w.]+)?")
Graph: TypeAlias = dict[str, set[str]]


@dataclass(frozen=True)
class Root:
    """Figures of one root.

    Attributes:
        rooms: On the top floor, by name.
        floors: Rooms of the longest chain; a circle's rooms stand on one floor.
        arrows: Rooms that each room imports from.
        arrows_by_name: Arrows that only a module's name in a string makes ("A -> B"); they are not among ``arrows``.
        room_circles: Rooms that import each other, directly or through others.
        file_circles: Files that do.
        files: Python files.
        lines: Lines in them.
    """

    rooms: list[str]
    floors: int
    arrows: dict[str, list[str]]
    arrows_by_name: list[str]
    room_circles: list[list[str]]
    file_circles: list[list[str]]
    files: int
    lines: int

    @property
    def arrow_count(self) -> int:
        return sum(map(len, self.arrows.values()))


@dataclass(frozen=True)
class House:
    """Figures of a checkout; ``repeated_classes`` are the places of each class name that is defined more than once."""

    roots: dict[str, Root]
    source_lines: int
    tests_lines: int
    repeated_classes: dict[str, list[str]]

    def as_dict(self) -> dict[str, object]:
        roots = {name: {**asdict(root), "arrow_count": root.arrow_count} for name, root in self.roots.items()}
        return {**asdict(self), "roots": roots}


def modules_of(checkout: Path) -> dict[str, Path]:
    """Every module of the four roots, by its dotted name; a package's is that of its ``__init__.py``."""
    found = {}
    for root in ROOTS:
        for path in sorted((checkout / root).glob("palpate/**/*.py")):
            parts = path.relative_to(checkout / root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name: str, tree: ast.Module, modules: Mapping[str, Path]) -> set[str]:
    """Modules that one module's import statements name; of a package's members the package, unless they are modules."""
    is_package = modules[name].name == "__init__.py"
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            source = _absolute(name, is_package, node)
            members = {f"{source}.{alias.name}" for alias in node.names}
            found |= {member if member in modules else source for member in members}
    return {module for module in found if module in modules and module != name}


def _absolute(name: str, is_package: bool, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    parts = name.split(".")
    base = parts[: len(parts) - node.level + is_package]
    return ".".join([*base, *([node.module] if node.module else [])])


def named(name: str, tree: ast.Module, modules: Mapping[str, Path]) -> set[str]:
    """Modules that strings of one module name, whole: what tables for importlib import."""
    texts = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str))
    found = {text.partition(":")[0] for text in texts if MODULE_NAME.fullmatch(text)}
    return {module for module in found if module in modules and module != name}


def room_of(module: str) -> str:
    """The room that a module belongs to; empty for a root's own ``__init__.py``."""
    return ".".join(module.split(".")[2:3])


def between_rooms(files: Graph, root: str) -> Graph:
    """Arrows between the rooms of one root."""
    found: Graph = defaultdict(set)
    for importer, targets in files.items():
        for target in targets:
            ends = room_of(importer), room_of(target)
            if _root_of(importer) == _root_of(target) == root and "" not in ends and ends[0] != ends[1]:
                found[ends[0]].add(ends[1])
    return dict(found)


def _root_of(module: str) -> str:
    return ".".join(module.split(".")[1:2])


def circles(graph: Graph) -> list[list[str]]:
    """Strongly connected sets of more than one node, each sorted (Tarjan's algorithm, without recursion)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    open_nodes: list[str] = []
    is_open: set[str] = set()
    found = []
    for first in sorted(graph):
        if first in order:
            continue
        path: list[tuple[str, Iterator[str]]] = [(first, iter(sorted(graph[first])))]
        order[first] = low[first] = len(order)
        open_nodes.append(first)
        is_open.add(first)
        while path:
            node, targets = path[-1]
            target = next(targets, None)
            if target is None:
                path.pop()
                if path:
                    low[path[-1][0]] = min(low[path[-1][0]], low[node])
                if low[node] == order[node]:
                    at = open_nodes.index(node)
                    members, open_nodes[at:] = open_nodes[at:], []
                    is_open -= set(members)
                    if len(members) > 1:
                        found.append(sorted(members))
            elif target not in order:
                order[target] = low[target] = len(order)
                open_nodes.append(target)
                is_open.add(target)
                path.append((target, iter(sorted(graph.get(target, ())))))
            elif target in is_open:
                low[node] = min(low[node], order[target])
    return sorted(found)


def floors(graph: Graph, nodes: list[str]) -> int:
    """Nodes of the longest chain; the members of a circle count as one."""
    place = {member: circle[0] for circle in circles(graph) for member in circle}
    one: Graph = defaultdict(set)
    for node, targets in graph.items():
        here = place.get(node, node)
        one[here] |= {place.get(target, target) for target in targets} - {here}
    heights: dict[str, int] = {}

    def height(node: str) -> int:
        if node not in heights:
            heights[node] = 1 + max((height(below) for below in one.get(node, ())), default=0)
        return heights[node]

    return max((height(place.get(node, node)) for node in nodes), default=0)


def repeated_classes(trees: Mapping[str, ast.Module]) -> dict[str, list[str]]:
    """Where each class name that several definitions share is defined; nested classes too."""
    places: dict[str, list[str]] = defaultdict(list)
    for module, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(module)
    return {name: sorted(where) for name, where in sorted(places.items()) if len(where) > 1}


def line_count(path: Path) -> int:
    return len(path.read_bytes().splitlines())


def house(checkout: Path) -> House:
    """Read a checkout."""
    modules = modules_of(checkout)
    if not modules:
        raise SystemExit(f"{checkout}: no palpate sources below {', '.join(ROOTS)}")
    trees = {name: ast.parse(path.read_bytes(), str(path)) for name, path in modules.items()}
    files = {name: imported(name, tree, modules) for name, tree in trees.items()}
    strings = {name: named(name, tree, modules) for name, tree in trees.items()}
    roots = {}
    for root in ROOTS:
        own = {name: path for name, path in modules.items() if _root_of(name) == root}
        arrows, by_name = between_rooms(files, root), between_rooms(strings, root)
        rooms = sorted({room_of(name) for name in own} - {""})
        roots[root] = Root(
            rooms=rooms,
            floors=floors(arrows, rooms),
            arrows={room: sorted(arrows[room]) for room in sorted(arrows)},
            arrows_by_name=sorted(f"{a} -> {b}" for a in by_name for b in by_name[a] - arrows.get(a, set())),
            room_circles=circles(arrows),
            file_circles=circles({name: files[name] & own.keys() for name in own}),
            files=len(own),
            lines=sum(map(line_count, own.values())),
        )
    tests = sum(map(line_count, (checkout / "tests").rglob("*.py")))
    return House(roots, sum(root.lines for root in roots.values()), tests, repeated_classes(trees))


def text(found: House) -> str:
    """The figures, for people."""
    lines = [f"{'root':<12}{'rooms':>7}{'floors':>8}{'arrows':>8}{'files':>7}{'lines':>9}"]
    for name, root in found.roots.items():
        figures = f"{len(root.rooms):>7}{root.floors:>8}{root.arrow_count:>8}{root.files:>7}{root.lines:>9,}"
        lines.append(f"{name:<12}{figures}")
    lines.append(f"source {found.source_lines:,} lines, tests {found.tests_lines:,} lines of Python")
    for name, root in found.roots.items():
        for kind, ones in (("rooms", root.room_circles), ("files", root.file_circles)):
            lines += [f"circle of {kind} in {name}: {', '.join(one)}" for one in ones]
        lines += [f"in {name} by a module's name in a string: {arrow}" for arrow in root.arrows_by_name]
    if not any(root.room_circles or root.file_circles for root in found.roots.values()):
        lines.append("no circle of rooms or files")
    names = found.repeated_classes
    counts = ", ".join(
        f"{name} {len(names[name])}" for name in sorted(names, key=lambda name: (-len(names[name]), name))
    )
    lines.append(f"class names defined more than once: {len(names)} ({counts})" if names else "no class name twice")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--checkout", type=Path, default=Path(__file__).parent.parent)
    parser.add_argument("--json", type=Path, help="write the figures here too")
    options = parser.parse_args()
    found = house(options.checkout)
    if options.json:
        options.json.write_text(json.dumps(found.as_dict(), indent=1) + "\n", encoding="utf-8")
    print(text(found))


if __name__ == "__main__":
    main()
