"""Names and outputs of a machine as people read them in pictures and tables, and the machine in the DOT language.

A name stands as it is when nothing can be mistaken in it, otherwise in quotes as in JSON. Sets stand in braces. Symbols
that lead from one state to the same next one share an edge: ``a, b``.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from palpate.core.automata.machine import Kind, Machine, Output

_MARKS: Final = frozenset('",{}/\\')
_TRUTH: Final = ("true", "false")


@dataclass(frozen=True, slots=True)
class Edge:
    """All transitions from one state to another.

    Attributes:
        label: The symbols.
    """

    source: int
    target: int
    label: str


def edges(machine: Machine) -> tuple[Edge, ...]:
    """The edges, by state and by the first symbol of each."""
    found: list[Edge] = []
    for source, row in enumerate(machine.transitions):
        groups: dict[int, list[str]] = {}
        for symbol, target in enumerate(row):
            if target is not None:
                groups.setdefault(target, []).append(machine.alphabet[symbol])
        found += [Edge(source, target, shown_names(names)) for target, names in groups.items()]
    return tuple(found)


def shown_name(name: str) -> str:
    """A name, in quotes where it might be misread."""
    plain = name.isprintable() and name.strip() == name != "" and not _MARKS.intersection(name)
    return name if plain else json.dumps(name, ensure_ascii=not name.isprintable())


def shown_names(names: Iterable[str]) -> str:
    """Several names."""
    return ", ".join(map(shown_name, names))


def shown_output(output: Output) -> str:
    """An output; a name that reads like a truth value is in quotes."""
    if isinstance(output, bool):
        return "true" if output else "false"
    if isinstance(output, tuple):
        return f"{{{shown_names(output)}}}"
    return json.dumps(output) if output in _TRUTH else shown_name(output)


def to_dot_text(machine: Machine) -> str:
    """The text of a DOT file; equal machines give equal texts."""
    lines = [
        "digraph automaton {",
        f"  kind={_quoted(machine.kind.value)};",
        f"  alphabet={_quoted(shown_names(machine.alphabet))};",
        "  rankdir=LR;",
        '  start [shape=point, label=""];',
    ]
    for state, name in enumerate(machine.names):
        shape, label = "circle", shown_name(name)
        if machine.kind is Kind.DFA and machine.state_outputs[state]:
            shape = "doublecircle"
        if machine.kind is Kind.MOORE:
            label = f"{label}\n{shown_output(machine.state_outputs[state])}"
        lines.append(f"  q{state} [shape={shape}, label={_quoted(label)}];")
    lines.append(f"  start -> q{machine.start};")
    for edge in edges(machine):
        lines.append(f"  q{edge.source} -> q{edge.target} [label={_quoted(edge.label)}];")
    return "\n".join([*lines, "}", ""])


def _quoted(text: str) -> str:
    # Graphviz replaces \N and the like, and entities such as &lt;, in labels.
    escaped = text.replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
