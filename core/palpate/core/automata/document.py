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
order of states and symbols is kept, and equal machines give equal bytes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NoReturn

from palpate.core.automata.machine import Kind, Machine, Output
from palpate.core.automata.texts import shown_name, shown_names
from palpate.core.errors import ConfigurationError, require_one_of
from palpate.core.files import write_whole

SCHEMA: Final = "palpate.automaton/1"

_WHOLE: Final = "automaton file"
_KEYS: Final = ("schema", "kind", "alphabet", "start", "states")


def to_json_text(machine: Machine) -> str:
    """The text of the file."""
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
        entry: dict[str, Any] = {"name": names[state]}
        if machine.kind is Kind.MEALY:
            said = dict(zip(machine.alphabet, machine.edge_outputs[state], strict=True))
            entry |= {"next": following, "outputs": said}
        else:
            entry |= {"output": machine.state_outputs[state], "next": following}
        states.append(f"  {json.dumps(entry)}")
    return "\n".join(["{", *lines, ' "states": [', ",\n".join(states), " ]", "}", ""])


def from_json_text(text: str, alphabet: Sequence[str] | None = None) -> Machine:
    """Read the text of a file.

    Args:
        text: What :func:`to_json_text` wrote, or the like.
        alphabet: The symbols it must be over, in their order; None for any.

    Raises:
        ConfigurationError: It is not an automaton file of this schema, contradicts itself, or is over other symbols.
    """
    raw = _object(_WHOLE, _parsed(text))
    # Before anything else: a file of another schema may have other keys.
    if raw.get("schema") != SCHEMA:
        raise ConfigurationError("schema", raw.get("schema"), f"{SCHEMA!r}; a newer schema needs a newer palpate")
    _object(_WHOLE, raw, _KEYS)
    require_one_of("kind", _text("kind", raw["kind"]), [kind.value for kind in Kind])
    kind = Kind(raw["kind"])
    symbols = _names("alphabet", raw["alphabet"])
    if alphabet is not None and symbols != tuple(alphabet):
        raise ConfigurationError("alphabet", symbols, f"{tuple(alphabet)}, in this order, as in this task")
    return _machine(kind, symbols, raw)


def save(machine: Machine, path: str | Path) -> None:
    """Write the file as a whole or not at all; an old file stays intact until the new one is complete.

    Raises:
        OutputError: The place cannot be written.
    """
    write_whole(Path(path), to_json_text(machine))


def load(path: str | Path, alphabet: Sequence[str] | None = None) -> Machine:
    """Read a file.

    Args:
        path: Where it is.
        alphabet: The symbols it must be over, in their order; None for any.

    Raises:
        ConfigurationError: It cannot be read, or :func:`from_json_text` refuses it.
    """
    try:
        return from_json_text(Path(path).read_text(encoding="utf-8"), alphabet)
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(_WHOLE, str(path), f"a readable file in UTF-8 ({error})") from error
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error.field}", error.value, error.accepted) from error


def _machine(kind: Kind, alphabet: tuple[str, ...], raw: dict[str, Any]) -> Machine:
    mealy = kind is Kind.MEALY
    keys = ("name", "next", "outputs") if mealy else ("name", "output", "next")
    entries = [_object(f"states[{n}]", entry, keys) for n, entry in enumerate(_list("states", raw["states"]))]
    labels = _names("states", [entry["name"] for entry in entries])
    number = {name: state for state, name in enumerate(labels)}
    rows, state_outputs, edge_outputs = [], [], []
    for n, entry in enumerate(entries):
        following = _by_symbol(f"states[{n}].next", entry["next"], alphabet)
        row = tuple(_state(where, name, number, or_none=True) for where, name in following)
        rows.append(row)
        if mealy:
            said = _by_symbol(f"states[{n}].outputs", entry["outputs"], alphabet)
            edge_outputs.append(tuple(_edge_output(*spot, to) for spot, to in zip(said, row, strict=True)))
        else:
            state_outputs.append(_output(f"states[{n}].output", entry["output"], kind))
    start = _state("start", raw["start"], number, or_none=False)
    return Machine(
        kind,
        alphabet,
        transitions=tuple(rows),
        state_outputs=tuple(state_outputs),
        edge_outputs=tuple(edge_outputs),
        start=0 if start is None else start,
        labels=labels,
    )


def _by_symbol(where: str, value: object, alphabet: tuple[str, ...]) -> list[tuple[str, object]]:
    """Where each entry is and what it holds, in the order of the alphabet."""
    entries = _object(where, value, alphabet)
    return [(f"{where}.{shown_name(symbol)}", entries[symbol]) for symbol in alphabet]


def _state(where: str, name: object, number: dict[str, int], *, or_none: bool) -> int | None:
    if name is None and or_none:
        return None
    if not isinstance(name, str) or name not in number:
        raise ConfigurationError(where, name, "the name of one of the states" + (", or null" if or_none else ""))
    return number[name]


def _output(where: str, value: object, kind: Kind) -> Output:
    if isinstance(value, bool):
        return value
    if kind is Kind.DFA:
        raise ConfigurationError(where, value, "true or false")
    if isinstance(value, list) and all(isinstance(name, str) for name in value):
        return tuple(value)
    if isinstance(value, str):
        return value
    raise ConfigurationError(where, value, "true, false, a name, or a list of names")


def _edge_output(where: str, value: object, target: int | None) -> Output | None:
    if (value is None) != (target is None):
        raise ConfigurationError(where, value, "an output where there is a next state, and null where there is none")
    return None if value is None else _output(where, value, Kind.MEALY)


def _parsed(text: str) -> object:
    """Strict JSON: no NaN, no infinity, no key twice."""
    try:
        return json.loads(text, object_pairs_hook=_without_repeats, parse_constant=_refuse_constant)
    except ConfigurationError:
        raise
    except (ValueError, RecursionError) as error:
        raise ConfigurationError(_WHOLE, text, f"JSON ({error})") from error


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) != len(pairs):
        keys = [key for key, _ in pairs]
        repeated = next(key for key in keys if keys.count(key) > 1)
        raise ConfigurationError(_WHOLE, repeated, "each key once in its object")
    return found


def _refuse_constant(name: str) -> NoReturn:
    raise ConfigurationError(_WHOLE, name, "finite numbers only")


def _object(where: str, value: object, keys: Sequence[str] | None = None) -> dict[str, Any]:
    """An object; with ``keys``, one that has exactly these."""
    if not isinstance(value, dict):
        raise ConfigurationError(where, value, "an object")
    if keys is not None and set(value) != set(keys):
        missing = [key for key in keys if key not in value]
        unknown = [key for key in value if key not in keys]
        problem = f"missing {shown_names(missing)}" if missing else f"unknown key {unknown[0]!r}"
        raise ConfigurationError(where, sorted(value), f"the keys {shown_names(keys)} ({problem})")
    return value


def _list(where: str, value: object) -> list[Any]:
    if not isinstance(value, list) or not value:
        raise ConfigurationError(where, value, "a list of at least one")
    return value


def _text(where: str, value: object) -> str:
    if not isinstance(value, str):
        raise ConfigurationError(where, value, "a text")
    return value


def _names(where: str, raw: object) -> tuple[str, ...]:
    names: dict[str, None] = {}
    for number, name in enumerate(_list(where, raw)):
        if not _text(f"{where}[{number}]", name) or name in names:
            raise ConfigurationError(f"{where}[{number}]", name, "a name, and none twice")
        names[name] = None
    return tuple(names)
