"""The automaton file: a machine as JSON, a line for each state, with schema id ``palpate.automaton/1``.

::

    {
     "schema": "palpate.automaton/1",
     "kind": "dfa",
     "alphabet": ["a", "b"],
     "start": "even",
     "states": [
      {"name": "even", "output": true, "next": {"a": "odd", "b": "even"}},
      {"name": "odd", "output": false, "next": {"a": "even", "b": null}}
     ]
    }

``next`` has each symbol of the alphabet; null where nothing is known. In a Mealy machine (``"kind": "mealy"``) a state
has ``outputs``, by symbol as well, instead of ``output``. An output is true, false, a name, or a list of names. The
order of states and symbols is kept, and equal machines give equal bytes. A machine with inputs has ``"actions"`` beside
the alphabet of its symbols, and ``next`` and ``outputs`` by letters such as ``"+x:a"``, without those for which nothing
is known.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from palpate.core.automata.letters import letters_of
from palpate.core.automata.machine import Kind, Machine, Output
from palpate.core.automata.texts import shown_name
from palpate.core.errors import ConfigurationError
from palpate.core.ports import (
    Holds,
    OneOf,
    Settings,
    fitted,
    load_json,
    parse_json,
    require_keys,
    require_names,
    write_whole,
)

SCHEMA: Final = "palpate.automaton/1"

_WHOLE: Final = "automaton file"


def _is_output(value: Any) -> bool:
    return isinstance(value, (bool, str)) or (isinstance(value, list) and all(isinstance(one, str) for one in value))


_Output = Annotated[Any, Holds(_is_output, "true, false, a name, or a list of names")]


@dataclass(frozen=True)
class _State(Settings):
    """A state of an acceptor or a Moore machine."""

    name: str
    output: _Output
    next: dict[str, str | None]


@dataclass(frozen=True)
class _MealyState(Settings):
    """A state of a Mealy machine."""

    name: str
    next: dict[str, str | None]
    outputs: dict[str, _Output | None]


@dataclass(frozen=True)
class _AutomatonFile(Settings):
    TABLE: ClassVar[str] = _WHOLE

    schema: str
    kind: Annotated[str, OneOf(*(kind.value for kind in Kind))]
    alphabet: tuple[str, ...]
    start: str
    states: tuple[Any, ...]
    actions: tuple[str, ...] | None = None


def to_json_text(machine: Machine) -> str:
    """The text of the file."""
    names = machine.names
    head = {
        "schema": SCHEMA,
        "kind": machine.kind.value,
        "alphabet": machine.symbols,
        **({"actions": machine.actions} if machine.actions else {}),
        "start": names[machine.start],
    }
    lines = [f" {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    states = []
    for state, row in enumerate(machine.transitions):
        following = {
            symbol: None if target is None else names[target]
            for symbol, target in zip(machine.alphabet, row, strict=True)
            if target is not None or not machine.actions
        }
        entry: dict[str, Any] = {"name": names[state]}
        if machine.kind is Kind.MEALY:
            answers = dict(zip(machine.alphabet, machine.edge_outputs[state], strict=True))
            outputs = {symbol: answers[symbol] for symbol in following}
            entry |= {"next": following, "outputs": outputs}
        else:
            entry |= {"output": machine.state_outputs[state], "next": following}
        states.append(f"  {json.dumps(entry)}")
    return "\n".join(["{", *lines, ' "states": [', ",\n".join(states), " ]", "}", ""])


def from_json_text(text: str) -> Machine:
    """Read the text of a file.

    Raises:
        ConfigurationError: It is not an automaton file of this schema, or contradicts itself.
    """
    file = _AutomatonFile.read(parse_json(text, _WHOLE, SCHEMA))
    require_names("alphabet", file.alphabet, printable=False)
    if file.actions:
        require_names("actions", file.actions, printable=False)
    return _machine(file)


def save(machine: Machine, path: str | Path) -> None:
    """Write the file as a whole or not at all; an old file stays intact until the new one is complete.

    Raises:
        OutputError: The place cannot be written.
    """
    write_whole(Path(path), to_json_text(machine))


def load(path: str | Path) -> Machine:
    """Read a file.

    Raises:
        ConfigurationError: It cannot be read, or :func:`from_json_text` refuses it.
    """
    return load_json(path, _WHOLE, from_json_text)


def _machine(file: _AutomatonFile) -> Machine:
    kind = Kind(file.kind)
    entry_kind = _MealyState if kind is Kind.MEALY else _State
    entries: list[Any] = [fitted(f"states[{n}]", entry, entry_kind) for n, entry in enumerate(file.states)]
    labels = tuple(entry.name for entry in entries)
    alphabet = letters_of(file.alphabet, file.actions or ())
    require_names("states", labels, printable=False)
    number = {name: state for state, name in enumerate(labels)}
    rows, state_outputs, edge_outputs = [], [], []
    for n, entry in enumerate(entries):
        following = _by_symbol(f"states[{n}].next", entry.next, alphabet, file.actions)
        row = tuple(None if name is None else _number(where, name, number) for where, name in following)
        rows.append(row)
        if kind is Kind.MEALY:
            outputs = _by_symbol(f"states[{n}].outputs", entry.outputs, alphabet, file.actions)
            edge_outputs.append(tuple(_edge_output(*spot, to) for spot, to in zip(outputs, row, strict=True)))
        else:
            if kind is Kind.DFA and not isinstance(entry.output, bool):
                raise ConfigurationError(f"states[{n}].output", entry.output, "true or false")
            state_outputs.append(_output(entry.output))
    return Machine(
        kind,
        alphabet,
        transitions=tuple(rows),
        state_outputs=tuple(state_outputs),
        edge_outputs=tuple(edge_outputs),
        start=_number("start", file.start, number),
        labels=labels,
        actions=file.actions or (),
    )


def _by_symbol(
    where: str, entries: dict[str, Any], alphabet: tuple[str, ...], actions: tuple[str, ...] | None
) -> list[tuple[str, Any]]:
    """Where each entry is and what it holds, in the order of the alphabet; None for letters that are left out."""
    require_keys(where, dict.fromkeys(alphabet) | entries if actions else entries, alphabet)
    return [(f"{where}.{shown_name(symbol)}", entries.get(symbol)) for symbol in alphabet]


def _number(where: str, name: str, number: dict[str, int]) -> int:
    if name not in number:
        raise ConfigurationError(where, name, "the name of one of the states")
    return number[name]


def _output(value: Any) -> Output:
    output: Output = tuple(value) if isinstance(value, list) else value
    return output


def _edge_output(where: str, value: Any, target: int | None) -> Output | None:
    if (value is None) != (target is None):
        raise ConfigurationError(where, value, "an output where there is a next state, and null where there is none")
    return None if value is None else _output(value)
