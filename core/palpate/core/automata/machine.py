"""Deterministic finite machines as values: acceptors, Moore machines and Mealy machines."""

from __future__ import annotations

import enum
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

from palpate.core.automata.letters import symbols_in
from palpate.core.errors import CommandError, ConfigurationError

Output: TypeAlias = bool | str | tuple[str, ...]
"""An output: accepted or not, a name, or a set of names in the order of the alphabet."""

SINK: Final = "sink"
"""Label of the state that :meth:`Machine.completed` adds."""


class Kind(enum.Enum):
    """Where the outputs are."""

    DFA = "dfa"
    """On states, and they are true or false: the words that end in a true one are accepted."""
    MOORE = "moore"
    """On states."""
    MEALY = "mealy"
    """On transitions."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A deterministic finite machine. States and symbols are numbers here; names are for people and files.

    Attributes:
        transitions: Next state by state and symbol, (states, symbols); None where none is known.
        state_outputs: Output of each state; empty for a Mealy machine.
        edge_outputs: Output of each transition, (states, symbols), None where there is none; empty for the others.
        labels: Readable names of the states; numbered ones if empty, and left empty if they are just these. They are
            no part of what the machine does.
        actions: For a machine with inputs: names of the actions that its letters hold
            (:mod:`palpate.core.automata.letters`).

    Raises:
        ConfigurationError: The parts do not fit together.
    """

    kind: Kind
    alphabet: tuple[str, ...]
    transitions: tuple[tuple[int | None, ...], ...]
    state_outputs: tuple[Output, ...] = ()
    edge_outputs: tuple[tuple[Output | None, ...], ...] = ()
    start: int = 0
    labels: tuple[str, ...] = ()
    actions: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self._check_names()
        symbols_in(self.alphabet, self.actions, "automaton.alphabet")
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
    def symbols(self) -> tuple[str, ...]:
        """Names of the symbols, without actions."""
        return self.alphabet[: len(self.alphabet) // (len(self.actions) + 1)]

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
        """The output at the end of a word; None if it leaves what is known.

        A Mealy machine has no output for the empty word.
        """
        if self.kind is not Kind.MEALY:
            state = self.state_after(word)
            return None if state is None else self.state_outputs[state]
        before = self.state_after(word[:-1]) if len(word) else None
        return None if before is None else self.edge_outputs[before][word[-1]]

    def reachable(self) -> tuple[int, ...]:
        """States that some word leads to, breadth first from the start, symbols in order."""
        found, queue = {self.start: None}, deque((self.start,))
        while queue:
            for target in self.transitions[queue.popleft()]:
                if target is not None and target not in found:
                    found[target] = None
                    queue.append(target)
        return tuple(found)

    def completed(self, output: Output) -> Machine:
        """The same with a sink for all that is not known; itself if it is complete.

        Args:
            output: The sink's output, or the transitions that lead into it and stay there.
        """
        if self.complete:
            return self
        sink = len(self.transitions)
        rows = [tuple(sink if target is None else target for target in row) for row in self.transitions]
        rows.append((sink,) * len(self.alphabet))
        edges: tuple[tuple[Output | None, ...], ...] = ()
        if self.kind is Kind.MEALY:
            known = [tuple(output if one is None else one for one in row) for row in self.edge_outputs]
            edges = (*known, (output,) * len(self.alphabet))
        return replace(
            self,
            transitions=tuple(rows),
            state_outputs=(*self.state_outputs, output) if self.state_outputs else (),
            edge_outputs=edges,
            labels=(*self.labels, self._free(SINK)) if self.labels else (),
        )

    def _numbered(self) -> tuple[str, ...]:
        return tuple(f"s{number}" for number in range(len(self.transitions)))

    def _free(self, name: str) -> str:
        return name if name not in self.labels else self._free(f"{name}'")

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
        if self.kind is Kind.MEALY:
            if self.state_outputs or len(self.edge_outputs) != states:
                accepted = f"outputs on the transitions of {states} states, and none on states"
                raise ConfigurationError("automaton.edge_outputs", len(self.edge_outputs), accepted)
            for state, (outputs, targets) in enumerate(zip(self.edge_outputs, self.transitions, strict=True)):
                name = f"automaton.edge_outputs[{state}]"
                if [output is None for output in outputs] != [target is None for target in targets]:
                    raise ConfigurationError(name, outputs, "an output for each transition, and for no other symbol")
                _require_outputs(name, [output for output in outputs if output is not None])
            return
        if self.edge_outputs or len(self.state_outputs) != states:
            accepted = f"an output for each of {states} states, and none on transitions"
            raise ConfigurationError("automaton.state_outputs", len(self.state_outputs), accepted)
        if self.kind is Kind.DFA and not all(isinstance(output, bool) for output in self.state_outputs):
            raise ConfigurationError("automaton.state_outputs", self.state_outputs, "true or false for each state")
        _require_outputs("automaton.state_outputs", self.state_outputs)


def _require_outputs(field: str, outputs: Sequence[Output]) -> None:
    for output in outputs:
        if not isinstance(output, bool | str) and not (
            isinstance(output, tuple) and all(isinstance(name, str) for name in output)
        ):
            raise ConfigurationError(field, output, "true, false, a name, or a tuple of names")
