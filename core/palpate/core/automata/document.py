"""The automaton file: a machine in JSON format, with one line per state and the schema id ``palpate.automaton/2``.

::

    {
     "schema": "palpate.automaton/2",
     "kind": "dfa",
     "alphabet": ["a", "b"],
     "start": "even",
     "states": [
      {"name": "even", "output": true, "next": {"a": "odd", "b": "even"}},
      {"name": "odd", "output": false, "next": {"a": "even", "b": null}}
     ]
    }

``next`` has an entry for each symbol in the alphabet; null denotes an unknown transition. An output is true or false in
an acceptor, and a name or a list of names in a Moore machine (``"kind": "moore"``). The order of states and symbols is
preserved, and identical machines produce identical bytes.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

from palpate.core.automata.machine import Kind, Machine, Output, shown_name, shown_names, shown_output
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Holds, OneOf, Settings, parse_json, require_keys, require_names

SCHEMA: Final = "palpate.automaton/2"

_WHOLE: Final = "automaton file"


def _is_output(value: Any) -> bool:
    return isinstance(value, (bool, str)) or (isinstance(value, list) and all(isinstance(one, str) for one in value))


_Output = Annotated[Any, Holds(_is_output, "true, false, a name, or a list of names")]


@dataclass(frozen=True)
class _State(Settings):
    name: str
    output: _Output
    next: dict[str, str | None]


@dataclass(frozen=True)
class _AutomatonFile(Settings):
    TABLE: ClassVar[str] = _WHOLE

    schema: str
    kind: Annotated[str, OneOf(*(kind.value for kind in Kind))]
    alphabet: tuple[str, ...]
    start: str
    states: tuple[_State, ...]


def to_json_text(machine: Machine) -> str:
    """Return the automaton file as text."""
    names = machine.names
    head = {
        "schema": SCHEMA,
        "kind": machine.kind.value,
        "alphabet": machine.alphabet,
        "start": names[machine.start],
    }
    lines = [f" {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    states = []
    for state, row in enumerate(machine.transitions):
        following = {
            symbol: None if target is None else names[target]
            for symbol, target in zip(machine.alphabet, row, strict=True)
        }
        entry = {"name": names[state], "output": machine.state_outputs[state], "next": following}
        states.append(f"  {json.dumps(entry)}")
    return "\n".join(["{", *lines, ' "states": [', ",\n".join(states), " ]", "}", ""])


def from_json_text(text: str) -> Machine:
    """Parse an automaton file's text.

    Raises:
        ConfigurationError: The text is not an automaton file with this schema, or is inconsistent.
    """
    file = _AutomatonFile.read(parse_json(text, _WHOLE, SCHEMA))
    require_names("alphabet", file.alphabet, printable=False)
    return _machine(file)


def _machine(file: _AutomatonFile) -> Machine:
    kind = Kind(file.kind)
    labels = tuple(entry.name for entry in file.states)
    require_names("states", labels, printable=False)
    number = {name: state for state, name in enumerate(labels)}
    rows = []
    for n, entry in enumerate(file.states):
        require_keys(f"states[{n}].next", entry.next, file.alphabet)
        targets = [(f"states[{n}].next.{shown_name(symbol)}", entry.next[symbol]) for symbol in file.alphabet]
        rows.append(tuple(None if name is None else _number(where, name, number) for where, name in targets))
        if kind is Kind.DFA and not isinstance(entry.output, bool):
            raise ConfigurationError(f"states[{n}].output", entry.output, "true or false")
    return Machine(
        kind,
        file.alphabet,
        transitions=tuple(rows),
        state_outputs=tuple(_output(entry.output) for entry in file.states),
        start=_number("start", file.start, number),
        labels=labels,
    )


def _number(where: str, name: str, number: dict[str, int]) -> int:
    if name not in number:
        raise ConfigurationError(where, name, "the name of one of the states")
    return number[name]


def _output(value: Any) -> Output:
    output: Output = tuple(value) if isinstance(value, list) else value
    return output


def to_dot_text(machine: Machine) -> str:
    """Return a DOT file as text; identical machines produce identical text."""
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
    for source, row in enumerate(machine.transitions):
        for target in (to for to in dict.fromkeys(row) if to is not None):
            names = (name for name, to in zip(machine.alphabet, row, strict=True) if to == target)
            lines.append(f"  q{source} -> q{target} [label={_quoted(shown_names(names))}];")
    return "\n".join([*lines, "}", ""])


def _quoted(text: str) -> str:
    # Graphviz replaces \N and the like, and entities such as &lt;, in labels.
    escaped = text.replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
