"""Do two machines do the same, and if not, what is the first word that shows it?"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

from palpate.core.automata.machine import Kind, Machine, Output
from palpate.core.automata.texts import shown_name, shown_output
from palpate.core.errors import ConfigurationError

_Pair: TypeAlias = tuple[int, int]
_Steps: TypeAlias = dict[_Pair, tuple[_Pair, int] | None]


@dataclass(frozen=True, slots=True)
class Difference:
    """A word that two machines answer differently. Always true, also when the word is the empty one.

    Attributes:
        word: The symbols, by number.
        symbols: The same, by name.
        outputs: What the one and the other say at its end; None where the word leaves what is known.
    """

    word: tuple[int, ...]
    symbols: tuple[str, ...]
    outputs: tuple[Output | None, Output | None]

    def __str__(self) -> str:
        word = f"the word {' '.join(map(shown_name, self.symbols))}" if self.word else "the empty word"
        one, other = ("not known" if output is None else shown_output(output) for output in self.outputs)
        return f"{word}: {one} against {other}"


def difference(one: Machine, other: Machine) -> Difference | None:
    """The shortest word that two machines answer differently, of several the first in the alphabet's order.

    The answer is that of :meth:`Machine.output_of`: what is not known differs from every output, so an incomplete
    machine differs from any completion of it. Complete both first, ``machine.completed(False)``, where "not known" is
    to mean "not accepted". Mealy machines do not answer the empty word, so they never differ on it.

    Args:
        one: Any machine, complete or not, minimal or not.
        other: One of the same kind with the same alphabet.

    Returns:
        None if they answer every word alike.

    Raises:
        ConfigurationError: They are of different kinds, or their alphabets differ, be it in the order alone.
    """
    _require_comparable(one, other)
    if one.kind is not Kind.MEALY:
        at_once = one.state_outputs[one.start], other.state_outputs[other.start]
        if at_once[0] != at_once[1]:
            return Difference((), (), at_once)
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
                return Difference(word, tuple(one.alphabet[number] for number in word), outputs)
            mine, theirs = one.transitions[pair[0]][symbol], other.transitions[pair[1]][symbol]
            if mine is not None and theirs is not None and (mine, theirs) not in came_from:
                came_from[mine, theirs] = (pair, symbol)
                queue.append((mine, theirs))
    return None


def equivalent(one: Machine, other: Machine) -> bool:
    """Whether two machines answer every word alike; see :func:`difference`.

    Raises:
        ConfigurationError: They are of different kinds, or their alphabets differ, be it in the order alone.
    """
    return difference(one, other) is None


def _answer(machine: Machine, state: int, symbol: int) -> Output | None:
    if machine.kind is Kind.MEALY:
        return machine.edge_outputs[state][symbol]
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
