"""Deterministic finite machines: acceptors and Moore machines."""

from __future__ import annotations

import enum
import json
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from palpate.core.errors import ConfigurationError

Output: TypeAlias = bool | str | tuple[str, ...]
"""A state's output: acceptance (true or false), a name, or a set of names in alphabet order."""


_MARKS: Final = frozenset('",{}/\\')
_TRUTH: Final = ("true", "false")


class Kind(enum.Enum):
    """Kind of machine, as defined by its state outputs."""

    DFA = "dfa"
    """Acceptor: the outputs are true or false, and words that end in a true state are accepted."""
    MOORE = "moore"
    """Moore machine: the outputs are names or sets of names."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A deterministic finite machine. States and symbols are numbers; names are used only for display and in files.

    Attributes:
        transitions: Next state for each state and symbol, (states, symbols); None if unknown.
        state_outputs: Output in each state.
        labels: Readable state names; empty for numbered names. They do not affect the behaviour.

    Raises:
        ConfigurationError: The sizes are inconsistent.
    """

    kind: Kind
    alphabet: tuple[str, ...]
    transitions: tuple[tuple[int | None, ...], ...]
    state_outputs: tuple[Output, ...]
    start: int = 0
    labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        states, symbols = len(self.transitions), len(self.alphabet)
        known = {None, *range(states)}
        rows = all(len(row) == symbols and known.issuperset(row) for row in self.transitions)
        sizes = len(self.state_outputs) == states and len(self.labels) in (0, states) and 0 <= self.start < states
        if not (rows and sizes and symbols):
            raise ConfigurationError("automaton", f"{states} states", "states, symbols and transitions that fit")
        if self.labels == self._numbered():
            # A file names every state; without this, a machine would differ from its own copy read from a file.
            object.__setattr__(self, "labels", ())

    @property
    def complete(self) -> bool:
        """Return True if every state has a transition for every symbol."""
        return all(target is not None for row in self.transitions for target in row)

    @property
    def names(self) -> tuple[str, ...]:
        """State names: their labels, or ``s0``, ``s1``, ... if there are none."""
        return self.labels or self._numbered()

    def output_of(self, word: Sequence[int]) -> Output | None:
        """Return the output after a word of symbol numbers, or None if a transition is unknown."""
        state: int | None = self.start
        for symbol in word:
            if state is None:
                return None
            state = self.transitions[state][symbol]
        return None if state is None else self.state_outputs[state]

    def reachable(self) -> tuple[int, ...]:
        """Return the reachable states in breadth-first order from the start, taking the symbols in order."""
        found, queue = {self.start: None}, deque((self.start,))
        while queue:
            for target in self.transitions[queue.popleft()]:
                if target is not None and target not in found:
                    found[target] = None
                    queue.append(target)
        return tuple(found)

    def _numbered(self) -> tuple[str, ...]:
        return tuple(f"s{number}" for number in range(len(self.transitions)))


def shown_name(name: str) -> str:
    """Return a name, quoted if it could be misread."""
    plain = name.isprintable() and name.strip() == name != "" and not _MARKS.intersection(name)
    return name if plain else json.dumps(name, ensure_ascii=not name.isprintable())


def shown_names(names: Iterable[str]) -> str:
    """Return the names, separated by commas."""
    return ", ".join(map(shown_name, names))


def shown_output(output: Output) -> str:
    """Return an output as text; a name that reads like a truth value is quoted."""
    if isinstance(output, bool):
        return "true" if output else "false"
    if isinstance(output, tuple):
        return f"{{{shown_names(output)}}}"
    return json.dumps(output) if output in _TRUTH else shown_name(output)
