"""Deterministic finite machines as values: acceptors and Moore machines."""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from palpate.core.errors import CommandError, ConfigurationError

Output: TypeAlias = bool | str | tuple[str, ...]
"""An output: accepted or not, a name, or a set of names in the order of the alphabet."""


class Kind(enum.Enum):
    """What the outputs of the states are."""

    DFA = "dfa"
    """True or false: the words that end in a true one are accepted."""
    MOORE = "moore"
    """Names, or sets of names."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A deterministic finite machine. States and symbols are numbers here; names are for people and files.

    Attributes:
        transitions: Next state by state and symbol, (states, symbols); None where none is known.
        state_outputs: Output of each state.
        labels: Readable names of the states; numbered ones if empty, and left empty if they are just these. They are
            no part of what the machine does.

    Raises:
        ConfigurationError: The parts do not fit together.
    """

    kind: Kind
    alphabet: tuple[str, ...]
    transitions: tuple[tuple[int | None, ...], ...]
    state_outputs: tuple[Output, ...]
    start: int = 0
    labels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._check_names()
        states, symbols = len(self.transitions), len(self.alphabet)
        if not states:
            raise ConfigurationError("automaton.transitions", (), "at least one state")
        if not 0 <= self.start < states:
            raise ConfigurationError("automaton.start", self.start, f"a state from 0 to {states - 1}")
        for state, row in enumerate(self.transitions):
            if len(row) != symbols:
                name = f"automaton.transitions[{state}]"
                raise ConfigurationError(name, len(row), f"{symbols} next states, one a symbol")
            for symbol, target in enumerate(row):
                if target is not None and not 0 <= target < states:
                    name = f"automaton.transitions[{state}][{symbol}]"
                    raise ConfigurationError(name, target, f"a state from 0 to {states - 1}, or none")
        self._check_outputs()
        if self.labels == self._numbered():
            # So that a file that names every state gives back what was written.
            object.__setattr__(self, "labels", ())

    @property
    def complete(self) -> bool:
        """Whether every state has a transition for every symbol."""
        return all(target is not None for row in self.transitions for target in row)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states: the labels, or ``s0`` and so on."""
        return self.labels or self._numbered()

    def symbol(self, name: str) -> int:
        """Number of a symbol.

        Raises:
            CommandError: It is not in the alphabet.
        """
        try:
            return self.alphabet.index(name)
        except ValueError as error:
            raise CommandError(f"a symbol must be one of {', '.join(self.alphabet)}", name) from error

    def state_after(self, word: Sequence[int]) -> int | None:
        """State at the end of a word of symbol numbers; None if it leaves what is known."""
        state: int | None = self.start
        for symbol in word:
            if state is None:
                return None
            state = self.transitions[state][symbol]
        return state

    def output_of(self, word: Sequence[int]) -> Output | None:
        """The output at the end of a word; None if it leaves what is known."""
        state = self.state_after(word)
        return None if state is None else self.state_outputs[state]

    def reachable(self) -> tuple[int, ...]:
        """States that some word leads to, breadth first from the start, symbols in order."""
        found, queue = {self.start: None}, deque((self.start,))
        while queue:
            for target in self.transitions[queue.popleft()]:
                if target is not None and target not in found:
                    found[target] = None
                    queue.append(target)
        return tuple(found)

    def _numbered(self) -> tuple[str, ...]:
        return tuple(f"s{number}" for number in range(len(self.transitions)))

    def _check_names(self) -> None:
        if not self.alphabet:
            raise ConfigurationError("automaton.alphabet", (), "at least one symbol")
        for field, names in (("alphabet", self.alphabet), ("labels", self.labels)):
            if len(set(names)) != len(names) or not all(isinstance(name, str) and name for name in names):
                raise ConfigurationError(f"automaton.{field}", names, "different names")
        if self.labels and len(self.labels) != len(self.transitions):
            raise ConfigurationError("automaton.labels", len(self.labels), f"{len(self.transitions)} names, or none")

    def _check_outputs(self) -> None:
        states = len(self.transitions)
        if len(self.state_outputs) != states:
            raise ConfigurationError(
                "automaton.state_outputs", len(self.state_outputs), f"one for each of {states} states"
            )
        if self.kind is Kind.DFA and not all(isinstance(output, bool) for output in self.state_outputs):
            raise ConfigurationError("automaton.state_outputs", self.state_outputs, "true or false for each state")
        for output in self.state_outputs:
            if not isinstance(output, bool | str) and not (
                isinstance(output, tuple) and all(isinstance(name, str) for name in output)
            ):
                accepted = "true, false, a name, or a tuple of names"
                raise ConfigurationError("automaton.state_outputs", output, accepted)
