"""A machine in the DOT language of Graphviz, and back.

States are nodes with their names, and in a Moore machine the outputs below them; states that accept have a double
circle. An edge has all symbols that lead the same way, see :mod:`palpate.core.automata.texts`. What Graphviz does not
draw, the kind and the order of the alphabet, stands in attributes that it ignores.

Only what is written here is read here: DOT files of other programs say neither what their labels mean nor where the
machine starts.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import zip_longest
from typing import Final, TypeVar

from palpate.core.automata.machine import Kind, Machine, Output
from palpate.core.automata.texts import edge_line_in, edges, names_in, output_in, shown_name, shown_names, shown_output
from palpate.core.errors import ConfigurationError

Read = TypeVar("Read")

_QUOTED: Final = r'"((?:[^"\\]|\\.)*)"'
_NUMBER: Final = r"q(0|[1-9][0-9]{0,8})"
_KIND: Final = re.compile(rf"  kind={_QUOTED};")
_ALPHABET: Final = re.compile(rf"  alphabet={_QUOTED};")
_START: Final = re.compile(rf"  start -> {_NUMBER};")
_STATE: Final = re.compile(rf"  {_NUMBER} \[shape=(circle|doublecircle), label={_QUOTED}\];")
_EDGE: Final = re.compile(rf"  {_NUMBER} -> {_NUMBER} \[label={_QUOTED}\];")


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


def from_dot_text(text: str) -> Machine:
    """Read what :func:`to_dot_text` wrote.

    Raises:
        ConfigurationError: It did not write this; names the line.
    """
    lines = text.splitlines()
    reader = _Reader(_understood(_kind, lines, 1), _understood(_alphabet, lines, 2))
    for number in range(3, len(lines)):
        _understood(reader.take, lines, number)
    machine = reader.machine()
    # Whatever the reader overlooked, such as a line left out, an order or an attribute, shows here.
    for number, (line, wanted) in enumerate(zip_longest(lines, to_dot_text(machine).splitlines())):
        if line != wanted:
            raise _refused(lines, number, "nothing more" if wanted is None else repr(wanted))
    return machine


class _Reader:
    """Collects states and transitions line by line."""

    def __init__(self, kind: Kind, alphabet: tuple[str, ...]) -> None:
        self._kind, self._alphabet = kind, alphabet
        self._names: list[str] = []
        self._state_outputs: list[Output] = []
        self._targets: list[list[int | None]] = []
        self._edge_outputs: list[list[Output | None]] = []
        self._start: int | None = None

    def take(self, line: str) -> None:
        """One line; those that are neither of a state nor of an edge nor of the start say nothing."""
        if found := _STATE.fullmatch(line):
            self._take_state(found[2], _unquoted(found[3]))
        elif found := _START.fullmatch(line):
            self._start = self._state(found[1])
        elif found := _EDGE.fullmatch(line):
            self._take_edge(self._state(found[1]), self._state(found[2]), _unquoted(found[3]))

    def machine(self) -> Machine:
        """What was collected."""
        if self._start is None:
            raise ConfigurationError("DOT file", "no start", "a line 'start -> ...' as palpate writes it")
        return Machine(
            self._kind,
            self._alphabet,
            transitions=tuple(map(tuple, self._targets)),
            state_outputs=tuple(self._state_outputs),
            edge_outputs=tuple(map(tuple, self._edge_outputs)) if self._kind is Kind.MEALY else (),
            start=self._start,
            labels=tuple(self._names),
        )

    def _take_state(self, shape: str, label: str) -> None:
        name, _, output = label.partition("\n")
        names = names_in(name)
        if len(names) != 1:
            raise ConfigurationError("DOT file", label, "one name for the state")
        self._names.append(names[0])
        if self._kind is not Kind.MEALY:
            self._state_outputs.append(shape == "doublecircle" if self._kind is Kind.DFA else output_in(output))
        self._targets.append([None] * len(self._alphabet))
        self._edge_outputs.append([None] * len(self._alphabet))

    def _take_edge(self, source: int, target: int, label: str) -> None:
        for line in label.split("\n"):
            names, output = edge_line_in(line, self._kind)
            for name in names:
                if name not in self._alphabet:
                    raise ConfigurationError("DOT file", name, f"symbols of the alphabet, not {shown_name(name)}")
                symbol = self._alphabet.index(name)
                if self._targets[source][symbol] is not None:
                    raise ConfigurationError(
                        "DOT file", name, f"one next state for {shown_name(name)}, not a second one"
                    )
                self._targets[source][symbol] = target
                self._edge_outputs[source][symbol] = output

    def _state(self, number: str) -> int:
        if int(number) >= len(self._names):
            raise ConfigurationError("DOT file", number, f"a state with a line above, q0 to q{len(self._names) - 1}")
        return int(number)


def _understood(understand: Callable[[str], Read], lines: list[str], number: int) -> Read:
    """What a line says."""
    try:
        return understand(lines[number] if number < len(lines) else "")
    except ConfigurationError as error:
        raise _refused(lines, number, error.accepted) from error


def _kind(line: str) -> Kind:
    found, names = _KIND.fullmatch(line), [kind.value for kind in Kind]
    if found is None or found[1] not in names:
        accepted = f'kind="...", one of {", ".join(names)}; DOT files that palpate did not write cannot be read'
        raise ConfigurationError("DOT file", line, accepted)
    return Kind(found[1])


def _alphabet(line: str) -> tuple[str, ...]:
    found = _ALPHABET.fullmatch(line)
    if found is None:
        accepted = 'alphabet="..."; DOT files that palpate did not write cannot be read'
        raise ConfigurationError("DOT file", line, accepted)
    return names_in(_unquoted(found[1]))


def _refused(lines: list[str], number: int, accepted: str) -> ConfigurationError:
    line = lines[number] if number < len(lines) else "end of file"
    return ConfigurationError(f"DOT file, line {number + 1}", line, accepted)


def _quoted(text: str) -> str:
    # Graphviz replaces \N and the like, and entities such as &lt;, in labels.
    escaped = text.replace("&", "&amp;").replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _unquoted(text: str) -> str:
    plain = re.sub(r"\\(.)", lambda found: "\n" if found[1] == "n" else found[1], text)
    return plain.replace("&amp;", "&")
