import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.automata import PrefixTree, Strings


def prefixes(tree: PrefixTree) -> list[tuple[int, ...]]:
    found: list[tuple[int, ...]] = []
    for parent, symbol in zip(tree.parents, tree.symbols, strict=True):
        found.append(() if parent < 0 else (*found[parent], int(symbol)))
    return found


def test_a_small_tree() -> None:
    tree = PrefixTree.of(Strings.of(["BA", "A", "BB", "BA"]))
    assert prefixes(tree) == [(), (0,), (1,), (1, 0), (1, 1)]
    assert tree.levels.tolist() == [0, 1, 3, 5]
    assert tree.counts.tolist() == [[1, 3, 0], [0, 0, 1], [2, 1, 0], [0, 0, 2], [0, 0, 1]]
    assert tree.passes.tolist() == [4, 1, 3, 2, 1]
    assert tree.nodes.tolist() == [3, 1, 4, 3]
    assert tree.labels.tolist() == [-1] * 5
    assert list(tree.blocks()) == [[(0, 1, 2), (1, 2, 3)], [(0, 3, 4), (1, 4, 5)]]


words = st.lists(st.lists(st.integers(0, 2), min_size=1, max_size=7).map(tuple), max_size=30)


@given(words)
def test_a_tree_holds_each_prefix_once_and_counts_its_strings(listed) -> None:
    strings = Strings(("a", "b", "c"), ((0, 1), *listed))
    tree = PrefixTree.of(strings)
    held = prefixes(tree)
    assert sorted(held) == sorted({word[:n] for word in strings.words for n in range(len(word) + 1)})
    assert [held[node] for node in tree.nodes] == list(strings.words)
    for prefix, passes, counts in zip(held, tree.passes, tree.counts, strict=True):
        through = [word for word in strings.words if word[: len(prefix)] == prefix]
        assert passes == len(through)
        assert counts[-1] == through.count(prefix)
    assert tree.counts.sum() == strings.symbols + len(strings.words)


@given(words, st.integers(0, 3))
def test_an_automaton_runs_over_all_prefixes_at_once(listed, start) -> None:
    tree = PrefixTree.of(Strings(("a", "b", "c"), ((0, 1), *listed)))
    transitions = np.random.default_rng(len(listed)).integers(4, size=(4, 3))
    for prefix, state in zip(prefixes(tree), tree.states(transitions, start), strict=True):
        expected = start
        for symbol in prefix:
            expected = transitions[expected, symbol]
        assert state == expected
