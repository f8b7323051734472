"""Sets of symbol strings for inferring automata (paper, 4 and 5.3)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.core.errors import ConfigurationError

END: Final = "<end>"
"""Name for the end of a string in lists of possible next symbols."""

_LISTED: Final = 12
"""Maximum number of symbols shown in a message."""


@dataclass(frozen=True, slots=True)
class Strings:
    """A set of strings over one alphabet, with or without labels.

    Without labels every string is positive, for example a trial that ended at the goal. Repeated strings are counted
    separately. With labels each string is accepted or rejected.

    Attributes:
        alphabet: At least two symbol names, in order. Not all of them need to occur in the strings.
        labels: True for each accepted string, False for each rejected one; empty if all are positive.

    Raises:
        ConfigurationError: There are no strings, a symbol is outside the alphabet, fewer than two different symbols
            occur, a string is both accepted and rejected, a positive string is empty, or not every string has a label.
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
        """Return True if the strings have labels."""
        return bool(self.labels)

    @property
    def symbols(self) -> int:
        """Total number of symbols in all strings."""
        return sum(map(len, self.words))

    @classmethod
    def of(
        cls,
        words: Iterable[Sequence[str]],
        labels: Iterable[bool] = (),
        *,
        alphabet: Sequence[str] | None = None,
    ) -> Strings:
        """Create a set of strings from symbol names.

        Args:
            words: Sequences of names; a str is treated as a sequence of single letters.
            labels: True for each accepted string, False for each rejected one; empty if all are positive.
            alphabet: Symbol names; None uses those that occur, in alphabetical order.

        Raises:
            ConfigurationError: See the class.
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
        """Split the strings at random into training and held-out strings; both keep their order.

        Args:
            share: Fraction of strings to hold out, above 0 and below 1; each part gets at least one string.

        Raises:
            ConfigurationError: The fraction is out of range, or a part is not a valid string set.
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
                raise ConfigurationError(
                    "strings", self._shown(word), "strings that are labelled alike where they are equal"
                )

    def _shown(self, word: tuple[int, ...]) -> str:
        return brief([self.alphabet[symbol] for symbol in word])


def brief(names: Sequence[str]) -> str:
    """Return symbol names for a message, shortened if there are many."""
    more = " ..." if len(names) > _LISTED else ""
    return " ".join(names[:_LISTED]) + more if names else "the empty string"


Integers: TypeAlias = npt.NDArray[np.int64]

UNLABELLED = -1
"""Label for a prefix that is not a string in the set."""


@dataclass(frozen=True, slots=True, eq=False)
class PrefixTree:
    """All prefixes of a set of strings, ordered by length, then by last symbol; node 0 is the empty prefix.

    Attributes:
        parents: Node of the prefix without its last symbol, (n,); -1 for the root.
        symbols: Last symbol, (n,); -1 for the root.
        levels: First node of each level, (longest string + 2,); the last entry is n.
        counts: Number of times that each symbol follows and, in the last column, that the string ends,
            (n, symbols + 1).
        passes: Number of strings that pass through or end at each node, (n,).
        labels: 1 for an accepted string, 0 for a rejected string, -1 for any other prefix, (n,).
        nodes: Node for each string, in the order of the set, (strings,).
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
        """Yield the blocks at each level below the root: symbol, first node, and node after the last."""
        for first, last in pairwise(self.levels[1:].tolist()):
            cuts = first + np.searchsorted(self.symbols[first:last], np.arange(len(self.alphabet) + 1))
            found = enumerate(pairwise(cuts.tolist()))
            yield [(symbol, low, high) for symbol, (low, high) in found if low < high]

    def states(self, transitions: Integers, start: int = 0) -> Integers:
        """Return the state of a complete automaton at each node, (n,)."""
        states = np.full(len(self.parents), start, dtype=np.int64)
        for level in self.blocks():
            for symbol, first, last in level:
                states[first:last] = transitions[states[self.parents[first:last]], symbol]
        return states

    @classmethod
    def of(cls, strings: Strings) -> PrefixTree:
        """Build the prefix tree for a set of strings."""
        lengths = np.array([len(word) for word in strings.words])
        longest = int(lengths.max())
        padded = np.full((len(lengths), longest), -1, dtype=np.int64)
        for row, word in zip(padded, strings.words, strict=True):
            row[: len(word)] = word
        nodes = np.zeros(len(lengths), dtype=np.int64)
        parents, symbols, levels = [np.array([-1])], [np.array([-1])], [0, 1]
        for depth in range(longest):
            going = lengths > depth
            # The key starts with the symbol, so that each symbol forms one block in a level.
            keys = padded[going, depth] * levels[-1] + nodes[going]
            found, places = np.unique(keys, return_inverse=True)
            parents.append(found % levels[-1])
            symbols.append(found // levels[-1])
            nodes[going] = levels[-1] + places
            levels.append(levels[-1] + len(found))
        parent, symbol, total = np.concatenate(parents), np.concatenate(symbols), levels[-1]
        passes = np.bincount(nodes, minlength=total)
        # The longest prefixes come first: the strings of a node are those that end at it or below it.
        for first, last in reversed(list(pairwise(levels[1:]))):
            np.add.at(passes, parent[first:last], passes[first:last])
        counts = np.zeros((total, len(strings.alphabet) + 1), dtype=np.int64)
        counts[parent[1:], symbol[1:]] = passes[1:]
        np.add.at(counts[:, -1], nodes, 1)
        labels = np.full(total, UNLABELLED, dtype=np.int64)
        if strings.labelled:
            labels[nodes] = strings.labels
        return cls(strings.alphabet, parent, symbol, np.array(levels), counts, passes, labels, nodes)
