"""Messages and counts of clone-structured models: from the clones of one symbol to those of the next, a small block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from typing_extensions import override

from palpate.core.policy.belief import Floats
from palpate.core.policy.memory.hidden_markov import Chain, Counts
from palpate.core.policy.memory.recorded import Batch, Numbers

NARROW: Final[Any] = np.float32  # of messages: with as many clones, time goes into moving blocks of them


@dataclass(frozen=True, eq=False)
class Clones:
    """What a clone-structured model says.

    Attributes:
        clones: Symbol of each hidden state, (states,), in rising order.
        start: Probability of each state at the start, (states,).
        transitions: Probability of each state after an action, (actions, states before, states after).
        goal: Probability that an action leads to the goal, (actions, states).
        fails: Share of moves that fail whatever the clone, which the transitions hold already; 0: not told apart.
        misread: Share of readings in whose place any symbol is read, whatever the clone.
    """

    clones: tuple[int, ...]
    symbols: int
    start: Floats
    transitions: Floats
    goal: Floats
    fails: float = 0.0
    misread: float = 0.0

    @property
    def emissions(self) -> Floats:
        """Probability of each symbol, (states, symbols)."""
        own: Floats = np.eye(self.symbols)[list(self.clones)]
        return own if self.misread == 0.0 else own * (1.0 - self.misread) + self.misread / self.symbols


class Blocks(Chain):
    """How messages go through the model: from the clones of one symbol to those of the next, a small block."""

    def __init__(self, model: Clones) -> None:
        counts = np.bincount(model.clones, minlength=model.symbols)
        self.width = width = int(counts.max())
        # Place of each symbol's clones, (symbols, width); one past the last state where there are fewer.
        places = np.full((model.symbols, width), len(model.clones), dtype=np.intp)
        for symbol, (end, count) in enumerate(zip(np.cumsum(counts), counts, strict=True)):
            places[symbol, :count] = np.arange(end - count, end)
        self.places = places
        moves = np.pad(model.transitions.astype(NARROW), ((0, 0), (0, 1), (0, 1)))
        # By action and the symbols before and after: (actions x symbols x symbols, width, width).
        blocks = moves[:, places[:, None, :, None], places[None, :, None, :]]
        self.moves = np.ascontiguousarray(blocks.reshape(-1, width, width))
        self._symbols = model.symbols
        self._goal = np.pad(model.goal.astype(NARROW), ((0, 0), (0, 1)))[:, places]
        self._start = np.pad(model.start.astype(NARROW), (0, 1))[places]

    def keys(self, actions: Numbers, symbols: Numbers, following: Numbers) -> Numbers:
        """Places of the blocks."""
        return (actions * self._symbols + symbols) * self._symbols + following

    @override
    def first(self, symbols: Numbers) -> Floats:
        return self._start[symbols]

    @override
    def forward(self, before: Floats, actions: Numbers, symbols: Numbers, following: Numbers) -> Floats:
        blocks = self.moves.take(self.keys(actions, symbols, following), axis=0)
        after: Floats = np.einsum("nc,ncd->nd", before, blocks)
        return after

    @override
    def backward(self, after: Floats, actions: Numbers, symbols: Numbers, following: Numbers) -> Floats:
        blocks = self.moves.take(self.keys(actions, symbols, following), axis=0)
        before: Floats = np.einsum("nd,ncd->nc", after, blocks)
        return before

    @override
    def goal(self, actions: Numbers, symbols: Numbers) -> Floats:
        return self._goal[actions, symbols]


class CloneCounts(Counts):
    """Posteriors of a batch, summed by action and clones."""

    def __init__(self, model: Clones, batch: Batch, chain: Blocks) -> None:
        self._batch, self._chain = batch, chain
        self._actions, self._symbols, self._states = len(model.goal), model.symbols, len(model.clones)
        none = np.zeros((0, chain.width), dtype=NARROW)
        self._keys: list[Numbers] = [np.zeros(0, dtype=np.intp)]
        self._before: list[Floats] = [none]
        self._after: list[Floats] = [none]
        self._starts = np.zeros(self._states + 1)
        self._goals = np.zeros((self._actions, self._states + 1))

    @override
    def state(self, time: int, posterior: Floats) -> None:
        batch, running = self._batch, len(posterior)
        symbols = batch.symbols[:running, time]
        if time == 0:
            np.add.at(self._starts, self._chain.places[symbols], posterior)
        longer = batch.running[time + 1] if time + 1 < len(batch.running) else 0
        if longer < running:
            ends = slice(longer, running)
            where = batch.actions[ends, time][:, None], self._chain.places[symbols[ends]]
            np.add.at(self._goals, where, posterior[ends] * batch.reached[ends, None])

    @override
    def move(self, time: int, before: Floats, after: Floats) -> None:
        batch, running = self._batch, len(before)
        symbols, following = batch.symbols[:running, time], batch.symbols[:running, time + 1]
        self._keys.append(self._chain.keys(batch.actions[:running, time], symbols, following))
        self._before.append(before)
        self._after.append(after)

    def sums(self) -> tuple[Floats, Floats, Floats]:
        """Moves (actions, states, states), arrivals at the goal (actions, states) and starts (states,)."""
        keys = np.concatenate(self._keys)
        order = np.argsort(keys, kind="stable")
        before, after = np.concatenate(self._before)[order], np.concatenate(self._after)[order]
        present, begins = np.unique(keys[order], return_index=True)
        blocks = np.zeros_like(self._chain.moves)
        for key, begin, end in zip(present, begins, [*begins[1:], len(keys)], strict=True):
            np.einsum("nc,nd->cd", before[begin:end], after[begin:end], out=blocks[key])
        blocks *= self._chain.moves
        places, width = self._chain.places, self._chain.width
        moves = np.zeros((self._actions, self._states + 1, self._states + 1))
        moves[:, places[:, None, :, None], places[None, :, None, :]] = blocks.reshape(
            self._actions, self._symbols, self._symbols, width, width
        )
        return moves[:, :-1, :-1], self._goals[:, :-1], self._starts[:-1]
