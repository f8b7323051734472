"""A machine in the DOT language of Graphviz, for drawing; palpate reads automata as JSON only.

States are nodes with their names, and in a Moore machine the outputs below them; states that accept have a double
circle. An edge has all symbols that lead the same way (:mod:`palpate.core.automata.texts`). What Graphviz does not
draw, the kind and the order of the alphabet, stands in attributes that it ignores.
"""

from __future__ import annotations

from palpate.core.automata.machine import Kind, Machine
from palpate.core.automata.texts import edges, shown_name, shown_names, shown_output


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
        lines.append(f"  q{edge.source} -> q{edge.target} [label={_quoted(chr(10).join(edge.lines))}];")
    return "\n".join([*lines, "}", ""])


def _quoted(text: str) -> str:
    # Graphviz replaces \N and the like, and entities such as &lt;, in labels.
    escaped = text.replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
