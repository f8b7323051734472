"""Prefix trees of strings as arrays: shared beginnings are stored, and evaluated, once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.core.automata.strings import Strings

Integers: TypeAlias = npt.NDArray[np.int64]

UNLABELLED = -1
"""Label of a prefix that is no string of the set."""


@dataclass(frozen=True, slots=True, eq=False)
class PrefixTree:
    """All prefixes of a set of strings, level by level, and by last symbol within a level; node 0 is the empty one.

    Attributes:
        parents: Node without the last symbol, (n,); -1 for the root.
        symbols: Last symbol, (n,); -1 for the root.
        levels: Where each level begins, (longest string + 2,), the last entry being n.
        counts: How often each symbol follows and, last, how often the string ends, (n, symbols + 1).
        passes: How many strings pass through, or end at, each node, (n,).
        labels: 1 for an accepted string, 0 for a rejected one, -1 for a mere prefix, (n,).
        nodes: Node of each string of the set, in its order, (strings,).
    """

    alphabet: tuple[str, ...]
    parents: Integers
    symbols: Integers
    levels: Integers
    counts: Integers
    passes: Integers
    labels: Integers
    nodes: Integers

    def blocks(self) -> Iterator[list[tuple[int, int, int]]]:
        """Level by level without the root: each symbol that occurs, its first node, and the node after its last."""
        for first, last in pairwise(self.levels[1:].tolist()):
            cuts = first + np.searchsorted(self.symbols[first:last], np.arange(len(self.alphabet) + 1))
            found = enumerate(pairwise(cuts.tolist()))
            yield [(symbol, low, high) for symbol, (low, high) in found if low < high]

    def states(self, transitions: Integers, start: int = 0) -> Integers:
        """State of a complete automaton at each node, (n,)."""
        states = np.full(len(self.parents), start, dtype=np.int64)
        for level in self.blocks():
            for symbol, first, last in level:
                states[first:last] = transitions[states[self.parents[first:last]], symbol]
        return states

    @classmethod
    def of(cls, strings: Strings) -> PrefixTree:
        """Compile a set of strings."""
        lengths = np.array([len(word) for word in strings.words])
        longest = int(lengths.max())
        padded = np.full((len(lengths), longest), -1, dtype=np.int64)
        for row, word in zip(padded, strings.words, strict=True):
            row[: len(word)] = word
        nodes = np.zeros(len(lengths), dtype=np.int64)
        parents, symbols, levels = [np.array([-1])], [np.array([-1])], [0, 1]
        for depth in range(longest):
            going = lengths > depth
            # Symbol first, so that a level is one block a symbol.
            keys = padded[going, depth] * levels[-1] + nodes[going]
            found, places = np.unique(keys, return_inverse=True)
            parents.append(found % levels[-1])
            symbols.append(found // levels[-1])
            nodes[going] = levels[-1] + places
            levels.append(levels[-1] + len(found))
        parent, symbol, total = np.concatenate(parents), np.concatenate(symbols), levels[-1]
        passes = np.bincount(nodes, minlength=total)
        # From the longest to the shortest: a node's strings are those that end there or below.
        for first, last in reversed(list(pairwise(levels[1:]))):
            np.add.at(passes, parent[first:last], passes[first:last])
        counts = np.zeros((total, len(strings.alphabet) + 1), dtype=np.int64)
        counts[parent[1:], symbol[1:]] = passes[1:]
        np.add.at(counts[:, -1], nodes, 1)
        labels = np.full(total, UNLABELLED, dtype=np.int64)
        if strings.labelled:
            labels[nodes] = strings.labels
        return cls(strings.alphabet, parent, symbol, np.array(levels), counts, passes, labels, nodes)
