"""Names and outputs of a machine as people read them in pictures, and back again without loss.

A name stands as it is when nothing can be mistaken in it, otherwise in quotes as in JSON. Sets stand in braces. Symbols
that lead from one state to the same next one share an edge: ``a, b``; in a Mealy machine with a line for each output:
``a, b / x``.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from palpate.core.automata.machine import Kind, Machine, Output
from palpate.core.errors import ConfigurationError

_MARKS: Final = frozenset('",{}/\\')
_TRUTH: Final = {"true": True, "false": False}
_TOKEN: Final = re.compile(r'\s*("(?:[^"\\]|\\.)*"|[,{}/]|[^",{}/\\]+)')


@dataclass(frozen=True, slots=True)
class Edge:
    """All transitions from one state to another.

    Attributes:
        source: Where they begin.
        target: Where they lead.
        lines: The symbols, and in a Mealy machine the outputs.
    """

    source: int
    target: int
    lines: tuple[str, ...]


def edges(machine: Machine) -> tuple[Edge, ...]:
    """The edges, by state and by the first symbol of each."""
    found: list[Edge] = []
    for source, row in enumerate(machine.transitions):
        groups: dict[int, dict[Output | None, list[str]]] = {}
        for symbol, target in enumerate(row):
            if target is not None:
                output = machine.edge_outputs[source][symbol] if machine.kind is Kind.MEALY else None
                groups.setdefault(target, {}).setdefault(output, []).append(machine.alphabet[symbol])
        for target, said in groups.items():
            lines = (shown_names(names) + _behind_a_slash(output) for output, names in said.items())
            found.append(Edge(source, target, tuple(lines)))
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


def names_in(text: str) -> tuple[str, ...]:
    """The names that :func:`shown_names` wrote.

    Raises:
        ConfigurationError: It did not.
    """
    tokens = _tokens(text)
    names = tuple(map(_name, tokens[::2]))
    if len(tokens) % 2 == 0 or any(token != "," for token in tokens[1::2]):
        raise ConfigurationError("automaton.names", text, "names with commas between them")
    return names


def output_in(text: str) -> Output:
    """The output that :func:`shown_output` wrote.

    Raises:
        ConfigurationError: It did not.
    """
    if text in _TRUTH:
        return _TRUTH[text]
    if text.startswith("{") and text.endswith("}"):
        inner = text[1:-1]
        return names_in(inner) if inner else ()
    tokens = _tokens(text)
    if len(tokens) != 1:
        raise ConfigurationError("automaton.output", text, "true, false, a name, or a set of names in braces")
    return _name(tokens[0])


def edge_line_in(text: str, kind: Kind) -> tuple[tuple[str, ...], Output | None]:
    """The symbols and the output, None unless it is a Mealy machine, of a line of an :class:`Edge`.

    Raises:
        ConfigurationError: It is no such line.
    """
    if kind is not Kind.MEALY:
        return names_in(text), None
    tokens = _tokens(text)
    if "/" not in tokens:
        raise ConfigurationError("automaton.edge", text, "symbols / output")
    slash = tokens.index("/")
    return names_in("".join(tokens[:slash])), output_in("".join(tokens[slash + 1 :]))


def _behind_a_slash(output: Output | None) -> str:
    return "" if output is None else f" / {shown_output(output)}"


def _tokens(text: str) -> list[str]:
    found, at = [], 0
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            raise ConfigurationError("automaton.text", text, "names, in closed quotes where they have marks in them")
        found.append(token[1].strip())
        at = token.end()
    return found


def _name(token: str) -> str:
    if not token or token in _MARKS:
        raise ConfigurationError("automaton.name", token, "a name")
    if not token.startswith('"'):
        return token
    try:
        return str(json.loads(token))
    except ValueError as error:
        raise ConfigurationError("automaton.name", token, f"a name in quotes as in JSON ({error})") from error
