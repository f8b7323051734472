from collections import deque
from math import floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import Machine, PrefixTree, Strings, bounded_partition
from palpate.core.automata.elman import RANGES, Architecture, Network, Readout
from palpate.core.errors import ConfigurationError
from tests.unit.core.automata.networks import last_symbol, parity


def one_by_one(network: Network, intervals: int, centres: bool) -> tuple[list[list[float]], list[list[int]]]:
    """The algorithm as it is written down, cell by cell."""
    low, high = RANGES[network.architecture.activation]

    def cell_of(state: list[float]) -> tuple[int, ...]:
        return tuple(min(floor((value - low) / ((high - low) / intervals)), intervals - 1) for value in state)

    def held(state: list[float]) -> list[float]:
        return [low + (n + 0.5) * ((high - low) / intervals) for n in cell_of(state)] if centres else state

    start = network.start_state.tolist()
    numbers, vectors, rows = {cell_of(start): 0}, [held(start)], []
    queue = deque(vectors)
    while queue:
        state = queue.popleft()
        row = []
        for symbol in range(len(network.architecture.alphabet)):
            after = network.advance(np.array([state]), symbol)[0].tolist()
            if cell_of(after) not in numbers:
                numbers[cell_of(after)] = len(numbers)
                vectors.append(held(after))
                queue.append(vectors[-1])
            row.append(numbers[cell_of(after)])
        rows.append(row)
    return vectors, rows


shapes = st.builds(
    Architecture,
    alphabet=st.sampled_from([("a", "b"), ("a", "b", "c", "d")]),
    reading=st.sampled_from(Readout),
    hidden=st.integers(1, 3),
    activation=st.sampled_from(["sigmoid", "tanh"]),
    order=st.integers(1, 2),
)


def drawn(shape: Architecture, seed: int) -> Network:
    rng = np.random.default_rng(seed)
    return Network(shape, **{name: 2.0 * rng.normal(size=size) for name, size in shape.shapes.items()})


@given(shapes, st.integers(0, 10**6), st.integers(1, 9), st.booleans())
def test_a_level_at_once_is_one_after_the_other(shape, seed, intervals, centres) -> None:
    network = drawn(shape, seed)
    found = bounded_partition(network, intervals, centres=centres)
    vectors, rows = one_by_one(network, intervals, centres)
    assert found.transitions.tolist() == rows
    assert found.vectors == pytest.approx(np.array(vectors), abs=1e-12)


def entered_by(machine: Machine) -> list[set[int]]:
    found: list[set[int]] = [set() for _ in machine.transitions]
    for row in machine.transitions:
        for symbol, target in enumerate(row):
            assert target is not None
            found[target].add(symbol)
    return found


@given(shapes, st.integers(0, 10**6), st.integers(2, 9))
def test_one_symbol_at_most_leads_into_each_state_also_where_several_lead_into_its_cell(shape, seed, intervals) -> None:
    machine = bounded_partition(drawn(shape, seed), intervals, by_symbol=True).minimal()
    assert all(len(symbols) <= 1 for symbols in entered_by(machine))


@given(shapes, st.integers(0, 10**6), st.integers(2, 9))
def test_with_strings_every_state_is_one_that_a_string_comes_to(shape, seed, intervals) -> None:
    tree = PrefixTree.of(Strings.of(["ab", "bba", "abb"], alphabet=shape.alphabet))
    found = bounded_partition(drawn(shape, seed), intervals, 100, tree=tree)
    assert found is not None
    assert set(tree.states(found.transitions).tolist()) == set(range(len(found.vectors)))
    assert sorted(found.machine().reachable()) == list(range(len(found.vectors)))


def test_the_threshold_decides_what_is_possible() -> None:
    shares = bounded_partition(last_symbol(), 2)
    assert shares.machine(0.4).state_outputs[0] == ("a", "b")
    assert shares.machine(0.6).state_outputs[0] == ()
    assert shares.machine(0.6).state_outputs[1] == ("b",)
    for bad in (-0.1, 1.0):
        with pytest.raises(ConfigurationError, match=r"automaton\.least_share"):
            shares.machine(bad)


@pytest.mark.parametrize("intervals", [0, 1001, 2.5])
def test_bad_intervals_are_refused(intervals) -> None:
    with pytest.raises(ConfigurationError, match=r"automaton\.intervals"):
        bounded_partition(parity(), intervals)
