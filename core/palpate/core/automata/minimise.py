"""The smallest machine that does the same, and one numbering for all that do.

Hopcroft's partition refinement: O(k n log n) steps for n states and k symbols.

Where nothing is known. :meth:`Machine.output_of` returns None for a word that leaves what is known, and here None is
an output like any other: two states are merged only if the same words are known from both. A state without some
transition is therefore never merged with one that has it, whatever the latter leads to, and the result is as
incomplete as the machine was.
"""

from collections import deque
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TypeAlias

from palpate.core.automata.machine import Machine, Output
from palpate.core.automata.texts import shown_name, shown_output
from palpate.core.errors import ConfigurationError

Classes: TypeAlias = tuple[tuple[int, ...], ...]
"""Sets of states."""

_SEPARATOR = "|"
_MOST_NAMES = 3


def minimised(machine: Machine, apart: Sequence[Hashable] | None = None) -> Machine:
    """The smallest machine with equal outputs for all words, numbered breadth first from the start, symbols in order.

    Two machines of one kind and alphabet with equal outputs for every word give equal results, apart from the labels.
    States that no word leads to are dropped. A state that stands for several is labelled with their names, ``a|b``, or
    with the first and the number of the others when there are more than three; a machine without labels stays without.

    Args:
        apart: A class for each state, (states,): states of different classes are not merged even if they do the same.
            None merges all that do.

    Raises:
        ConfigurationError: ``apart`` has not one class for each state.
    """
    return _merged(machine, equivalent_states(machine, apart))


def equivalent_states(machine: Machine, apart: Sequence[Hashable] | None = None) -> Classes:
    """Which states do the same: entry i lists those that state i of :func:`minimised` stands for.

    Returns:
        Each reachable state once. In each class, and from class to class by their first states, the order is breadth
        first from the start.
    """
    if apart is not None and len(apart) != len(machine.transitions):
        raise ConfigurationError("automaton.apart", len(apart), f"{len(machine.transitions)} classes, one a state")
    reachable = machine.reachable()
    block_of = _refined(machine, reachable, apart)
    classes: dict[int, list[int]] = {}
    for state in reachable:
        classes.setdefault(block_of[state], []).append(state)
    return tuple(tuple(states) for states in classes.values())


def _refined(machine: Machine, states: Sequence[int], apart: Sequence[Hashable] | None) -> dict[int, int]:
    """Number of the block of each of these states; they must be all that are reachable from any of them."""
    into: list[dict[int, list[int]]] = [{state: [] for state in states} for _ in machine.alphabet]
    first: dict[Hashable, set[int]] = {}
    for state in states:
        known = tuple(target is not None for target in machine.transitions[state])
        first.setdefault((machine.state_outputs[state], known, None if apart is None else apart[state]), set()).add(
            state
        )
        for symbol, target in enumerate(machine.transitions[state]):
            if target is not None:
                into[symbol][target].append(state)
    blocks = list(first.values())
    block_of = {state: number for number, block in enumerate(blocks) for state in block}
    waiting = set(range(len(blocks)))
    while waiting:
        # A copy: the block itself may be cut while it is cutting others.
        splitter = tuple(blocks[waiting.pop()])
        for sources in into:
            leading_in: dict[int, set[int]] = {}
            for target in splitter:
                for source in sources[target]:
                    leading_in.setdefault(block_of[source], set()).add(source)
            for number, part in leading_in.items():
                if len(part) == len(blocks[number]):
                    continue
                blocks[number] -= part
                new = len(blocks)
                blocks.append(part)
                block_of.update(dict.fromkeys(part, new))
                # In a block all states have the same symbols, so cutting by one half cuts by the other as well.
                smaller = new if len(part) <= len(blocks[number]) else number
                waiting.add(new if number in waiting else smaller)
    return block_of


def _merged(machine: Machine, classes: Classes) -> Machine:
    """The machine with a state for each class, which does what the first of the class does."""
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
    """The labels, with a number behind those that were there before."""
    found: dict[str, None] = {}
    for label in labels:
        numbered = (f"{label} ({number})" for number in count(2))
        found[label if label not in found else next(name for name in numbered if name not in found)] = None
    return tuple(found)


_Pair: TypeAlias = tuple[int, int]
_Steps: TypeAlias = dict[_Pair, tuple[_Pair, int] | None]


@dataclass(frozen=True, slots=True)
class AutomatonDifference:
    """A word for which two machines have different outputs. Always true, also when the word is the empty one.

    Attributes:
        outputs: Output of the one and of the other at its end; None where the word leaves what is known.
    """

    word: tuple[int, ...]
    symbols: tuple[str, ...]
    outputs: tuple[Output | None, Output | None]

    def __str__(self) -> str:
        word = f"the word {' '.join(map(shown_name, self.symbols))}" if self.word else "the empty word"
        one, other = ("not known" if output is None else shown_output(output) for output in self.outputs)
        return f"{word}: {one} against {other}"


def difference(one: Machine, other: Machine) -> AutomatonDifference | None:
    """The shortest word for which two machines have different outputs, of several the first in the alphabet's order.

    The output is that of :meth:`Machine.output_of`: what is not known differs from every output, so an incomplete
    machine differs from any completion of it.

    Args:
        one: Any machine, complete or not, minimal or not.
        other: One of the same kind with the same alphabet.

    Returns:
        None if there is no such word.

    Raises:
        ConfigurationError: They are of different kinds, or their alphabets differ, be it in the order alone.
    """
    _require_comparable(one, other)
    at_once = one.state_outputs[one.start], other.state_outputs[other.start]
    if at_once[0] != at_once[1]:
        return AutomatonDifference((), (), at_once)
    # Breadth first over pairs of states, so each pair is found by its first word. A pair of a state and nothing never
    # enters the queue: it differs already.
    begin = (one.start, other.start)
    came_from: _Steps = {begin: None}
    queue = deque((begin,))
    while queue:
        pair = queue.popleft()
        for symbol in range(len(one.alphabet)):
            outputs = _answer(one, pair[0], symbol), _answer(other, pair[1], symbol)
            if outputs[0] != outputs[1]:
                word = (*_word_to(pair, came_from), symbol)
                return AutomatonDifference(word, tuple(one.alphabet[number] for number in word), outputs)
            mine, theirs = one.transitions[pair[0]][symbol], other.transitions[pair[1]][symbol]
            if mine is not None and theirs is not None and (mine, theirs) not in came_from:
                came_from[mine, theirs] = (pair, symbol)
                queue.append((mine, theirs))
    return None


def _answer(machine: Machine, state: int, symbol: int) -> Output | None:
    target = machine.transitions[state][symbol]
    return None if target is None else machine.state_outputs[target]


def _word_to(pair: _Pair, came_from: _Steps) -> tuple[int, ...]:
    word = []
    step = came_from[pair]
    while step is not None:
        pair, symbol = step
        word.append(symbol)
        step = came_from[pair]
    return tuple(reversed(word))


def _require_comparable(one: Machine, other: Machine) -> None:
    if one.kind is not other.kind:
        raise ConfigurationError("automaton.kind", other.kind.value, f"{one.kind.value}, as of the other machine")
    if one.alphabet != other.alphabet:
        accepted = f"{one.alphabet}, in this order, as of the other machine"
        raise ConfigurationError("automaton.alphabet", other.alphabet, accepted)
