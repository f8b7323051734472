"""Sets of symbol strings: what automata are inferred from (paper, 4 and 5.3)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.core.errors import ConfigurationError

END: Final = "<end>"
"""What follows the last symbol of a string, among the symbols that may come next."""

_LISTED: Final = 12
"""Symbols and strings are shown in messages up to this length."""


@dataclass(frozen=True, slots=True)
class Strings:
    """A set of strings over one alphabet, with or without labels.

    Without labels every string is a positive one, for example a walk that ended at the goal; repeated strings count
    repeatedly. With labels each string is accepted or rejected.

    Attributes:
        alphabet: Names of the symbols, in order; two or more. Not every one need occur.
        labels: For each string, whether it is accepted; empty where all are positive.

    Raises:
        ConfigurationError: No strings, a symbol outside the alphabet, fewer than two different symbols, a string that
            is accepted and rejected, an empty positive string, or labels for other than all strings.
    """

    alphabet: tuple[str, ...]
    words: tuple[tuple[int, ...], ...]
    labels: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        if not self.words:
            raise ConfigurationError("strings", (), "at least one string")
        names = self.alphabet
        if len(set(names)) != len(names) or not all(isinstance(name, str) and name for name in names):
            raise ConfigurationError("strings.alphabet", names, "different names")
        if len(names) < 2:
            raise ConfigurationError("strings.alphabet", names, "two symbols or more: one alone distinguishes nothing")
        for place, word in enumerate(self.words):
            for symbol in word:
                if not 0 <= symbol < len(names):
                    raise ConfigurationError(f"strings[{place}]", symbol, f"symbols from 0 to {len(names) - 1}")
        if len({symbol for word in self.words for symbol in word}) < 2:
            raise ConfigurationError(
                "strings", self._shown(self.words[0]), "strings in which two different symbols occur, or more"
            )
        self._check_labels()

    @property
    def labelled(self) -> bool:
        """Whether the strings are accepted or rejected ones."""
        return bool(self.labels)

    @property
    def symbols(self) -> int:
        """How many symbols all the strings have together."""
        return sum(map(len, self.words))

    @classmethod
    def of(
        cls,
        words: Iterable[Sequence[str]],
        labels: Iterable[bool] = (),
        *,
        alphabet: Sequence[str] | None = None,
    ) -> Strings:
        """The same from names of symbols.

        Args:
            words: Each a sequence of names; a text is a sequence of single letters.
            labels: For each string whether it is accepted; none where all are positive.
            alphabet: Names of the symbols; None takes those that occur, in alphabetical order.

        Raises:
            ConfigurationError: As for the class.
        """
        listed = [tuple(word) for word in words]
        names = tuple(sorted({name for word in listed for name in word}) if alphabet is None else alphabet)
        number = {name: place for place, name in enumerate(names)}
        for place, word in enumerate(listed):
            for name in word:
                if name not in number:
                    accepted = f"symbols of the alphabet {brief(names)}"
                    raise ConfigurationError(f"strings[{place}]", name, accepted)
        return cls(names, tuple(tuple(number[name] for name in word) for word in listed), tuple(labels))

    def split(self, share: float, seed: int) -> tuple[Strings, Strings]:
        """Part them at random, for training and for holding out; each keeps the order.

        Args:
            share: Share of the strings that is held out, above 0 and below 1; at least one string on either side.

        Raises:
            ConfigurationError: The share is out of range, or a part would be no usable set of strings by itself.
        """
        total = len(self.words)
        if not 0.0 < share < 1.0 or total < 2:
            raise ConfigurationError("strings.held_out", share, "above 0 and below 1, of two strings or more")
        count = min(max(round(share * total), 1), total - 1)
        held = set(np.random.default_rng(seed).choice(total, count, replace=False).tolist())
        try:
            return self._part([n for n in range(total) if n not in held]), self._part(sorted(held))
        except ConfigurationError as error:
            accepted = f"another share, or more strings: one part would not be {error.accepted}"
            raise ConfigurationError("strings.held_out", share, accepted) from error

    def _part(self, places: list[int]) -> Strings:
        labels = tuple(self.labels[n] for n in places) if self.labels else ()
        return Strings(self.alphabet, tuple(self.words[n] for n in places), labels)

    def _check_labels(self) -> None:
        if not self.labels:
            if () in self.words:
                accepted = "at least one symbol in a positive string"
                raise ConfigurationError(f"strings[{self.words.index(())}]", (), accepted)
            return
        if len(self.labels) != len(self.words) or not all(isinstance(label, bool) for label in self.labels):
            raise ConfigurationError("strings.labels", self.labels, f"true or false for each of {len(self.words)}")
        known: dict[tuple[int, ...], bool] = {}
        for word, label in zip(self.words, self.labels, strict=True):
            if known.setdefault(word, label) is not label:
                raise ConfigurationError("strings", self._shown(word), "each string either accepted or rejected")

    def _shown(self, word: tuple[int, ...]) -> str:
        return brief([self.alphabet[symbol] for symbol in word])


def brief(names: Sequence[str]) -> str:
    """Names of symbols for a message, not more than it bears."""
    more = " ..." if len(names) > _LISTED else ""
    return " ".join(names[:_LISTED]) + more if names else "the empty string"


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
