"""Minimise machines to a canonical form by Moore's partition refinement, and compare them.

:meth:`Machine.output_of` returns None for a word that takes an unknown transition. Minimisation treats None as an
output like any other: two states are merged only if the same words are known from both. A state that lacks a transition
is never merged with a state that has it. The result is therefore as incomplete as the original machine.
"""

from collections import deque
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TypeAlias

from palpate.core.automata.machine import Machine, Output, shown_name, shown_output
from palpate.core.errors import ConfigurationError

Classes: TypeAlias = tuple[tuple[int, ...], ...]
"""State classes, each a set of state numbers."""

_SEPARATOR = "|"
_MOST_NAMES = 3


def minimised(machine: Machine, apart: Sequence[Hashable] | None = None) -> Machine:
    """Return the smallest machine with the same outputs for all words, with its states numbered breadth-first.

    Machines with the same kind, alphabet and output for every word give the same result, except for labels.
    Unreachable states are dropped. A merged state is labelled with the names of its members, ``a|b``; with more than
    three members, the label is the first name and the number of others. A machine without labels stays unlabelled.

    Args:
        apart: Class of each state, (states,). States in different classes are not merged even if they are equivalent.
            None merges all equivalent states.

    Raises:
        ConfigurationError: The number of classes differs from the number of states.
    """
    return _merged(machine, equivalent_states(machine, apart))


def equivalent_states(machine: Machine, apart: Sequence[Hashable] | None = None) -> Classes:
    """Return the classes of equivalent states; :func:`minimised` merges class i into state i.

    Returns:
        The classes, in which each reachable state occurs once. States within a class are in breadth-first order from
        the start. Classes are in the same order as their first states.
    """
    if apart is not None and len(apart) != len(machine.transitions):
        raise ConfigurationError("automaton.apart", len(apart), f"{len(machine.transitions)} classes, one per state")
    reachable = machine.reachable()
    block_of = _numbered(
        {state: (machine.state_outputs[state], None if apart is None else apart[state]) for state in reachable}
    )
    before = 0
    while len(set(block_of.values())) > before:
        before = len(set(block_of.values()))
        follow = {state: tuple(map(block_of.get, machine.transitions[state])) for state in reachable}
        block_of = _numbered({state: (block_of[state], follow[state]) for state in reachable})
    classes: dict[int, list[int]] = {}
    for state in reachable:
        classes.setdefault(block_of[state], []).append(state)
    return tuple(tuple(states) for states in classes.values())


def _numbered(keys: Mapping[int, Hashable]) -> dict[int | None, int]:
    """Number the keys in order of appearance."""
    numbers: dict[Hashable, int] = {}
    return {state: numbers.setdefault(key, len(numbers)) for state, key in keys.items()}


def _merged(machine: Machine, classes: Classes) -> Machine:
    """Return a machine with one state per class, copied from the first state of that class."""
    number = {state: index for index, states in enumerate(classes) for state in states}
    firsts = [states[0] for states in classes]
    rows = [machine.transitions[state] for state in firsts]
    return replace(
        machine,
        transitions=tuple(tuple(None if target is None else number[target] for target in row) for row in rows),
        state_outputs=tuple(machine.state_outputs[state] for state in firsts),
        start=number[machine.start],
        labels=different(_joined(machine.labels, states) for states in classes) if machine.labels else (),
    )


def _joined(labels: Sequence[str], states: Sequence[int]) -> str:
    if len(states) > _MOST_NAMES:
        return f"{labels[states[0]]}{_SEPARATOR}{len(states) - 1} more"
    return _SEPARATOR.join(labels[state] for state in states)


def different(labels: Iterable[str]) -> tuple[str, ...]:
    """Return the labels, with a number appended to each repeated label."""
    found: dict[str, None] = {}
    for label in labels:
        numbered = (f"{label} ({number})" for number in count(2))
        found[label if label not in found else next(name for name in numbered if name not in found)] = None
    return tuple(found)


@dataclass(frozen=True, slots=True)
class AutomatonDifference:
    """A word for which two machines have different outputs. An instance is always truthy, even for the empty word.

    Attributes:
        outputs: Outputs of the two machines after the word; None if the word takes an unknown transition.
    """

    word: tuple[int, ...]
    symbols: tuple[str, ...]
    outputs: tuple[Output | None, Output | None]

    def __str__(self) -> str:
        word = f"the word {' '.join(map(shown_name, self.symbols))}" if self.word else "the empty word"
        one, other = ("not known" if output is None else shown_output(output) for output in self.outputs)
        return f"{word}: {one} against {other}"


def difference(one: Machine, other: Machine) -> AutomatonDifference | None:
    """Return the shortest word for which two machines have different outputs; in a tie, the first alphabetically.

    Outputs are those of :meth:`Machine.output_of`. An unknown output differs from every other output, so an incomplete
    machine differs from each of its completions.

    Args:
        one: Any machine; it need not be complete or minimal.
        other: A machine of the same kind with the same alphabet.

    Returns:
        None if no such word exists.

    Raises:
        ConfigurationError: The machines are of different kinds, or their alphabets differ, even if only in order.
    """
    if one.kind is not other.kind:
        raise ConfigurationError("automaton.kind", other.kind.value, f"{one.kind.value}, like the other machine")
    if one.alphabet != other.alphabet:
        accepted = f"{one.alphabet}, in this order, like the other machine"
        raise ConfigurationError("automaton.alphabet", other.alphabet, accepted)
    # The search is breadth first over pairs of states, so it finds each pair by its shortest word.
    queue: deque[tuple[tuple[int, ...], tuple[int | None, int | None]]] = deque([((), (one.start, other.start))])
    seen = {queue[0][1]}
    while queue:
        word, (mine, theirs) = queue.popleft()
        outputs = _output(one, mine), _output(other, theirs)
        if outputs[0] != outputs[1]:
            return AutomatonDifference(word, tuple(one.alphabet[number] for number in word), outputs)
        if mine is None or theirs is None:
            continue
        for symbol, pair in enumerate(zip(one.transitions[mine], other.transitions[theirs], strict=True)):
            if pair not in seen:
                seen.add(pair)
                queue.append(((*word, symbol), pair))
    return None


def _output(machine: Machine, state: int | None) -> Output | None:
    return None if state is None else machine.state_outputs[state]
