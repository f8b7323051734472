"""Machines for tests: random ones, any at all, and the slow but plain way to tell which states do the same."""

import random
from itertools import product

from hypothesis import strategies as st

from palpate.core.automata.machine import Kind, Machine

KINDS = list(Kind)
OUTPUTS = {Kind.DFA: [False, True], Kind.MOORE: ["x", "y", ("x", "y")]}


def dfa(rows, accepting, start=0, alphabet="ab", labels=()):
    outputs = tuple(state in accepting for state in range(len(rows)))
    return Machine(Kind.DFA, tuple(alphabet), tuple(map(tuple, rows)), outputs, start=start, labels=tuple(labels))


def random_machine(rng, kind, states, symbols, missing=0.0):
    """Uniform targets and outputs, any start; each transition is missing with a probability."""
    rows = tuple(
        tuple(None if rng.random() < missing else rng.randrange(states) for _ in range(symbols)) for _ in range(states)
    )
    choices = OUTPUTS[kind]
    alphabet = tuple("abcdef"[:symbols])
    start = rng.randrange(states)
    return Machine(kind, alphabet, rows, tuple(rng.choice(choices) for _ in rows), start=start)


@st.composite
def machines(draw, kind=None, symbols=None):
    """Small machines of every sort, often with states that do the same."""
    kind = draw(st.sampled_from(KINDS)) if kind is None else kind
    states = draw(st.integers(1, 7))
    symbols = draw(st.integers(1, 3)) if symbols is None else symbols
    missing = draw(st.sampled_from([0.0, 0.3]))
    return random_machine(random.Random(draw(st.integers(0, 2**32))), kind, states, symbols, missing)


def words(symbols, longest):
    """All words up to a length, shortest first, those of one length in the alphabet's order."""
    for length in range(longest + 1):
        yield from product(range(symbols), repeat=length)


def classes_by_table(machine, apart=None):
    """Reachable states that do the same, by filling a table of the pairs that do not (E. F. Moore, 1956)."""
    states = machine.reachable()

    def differ_at_once(one, other):
        if apart is not None and apart[one] != apart[other]:
            return True
        return machine.state_outputs[one] != machine.state_outputs[other]

    differ = {(one, other): differ_at_once(one, other) for one in states for other in states}
    while True:
        more = [
            (one, other)
            for one, other in differ
            if not differ[one, other]
            for mine, theirs in zip(machine.transitions[one], machine.transitions[other], strict=True)
            if (mine is None) != (theirs is None) or (mine is not None and differ[mine, theirs])
        ]
        if not more:
            break
        differ.update(dict.fromkeys(more, True))
    return {frozenset(other for other in states if not differ[one, other]) for one in states}
