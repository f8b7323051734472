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


@dataclass(frozen=True, slots=True)
class Expected:
    """What the trials hold by a model.

    Attributes:
        moves: From each clone to each by each action, (actions, states, states).
        goals: Arrivals at the goal, (actions, states).
        starts: In each clone, (states,).
        wrong: Share of the readings that are not of the clone's own symbol, with one of twenty beforehand.
    """

    moves: Floats
    goals: Floats
    starts: Floats
    wrong: float
    log_likelihood: float


class Blocks(Chain):
    """How messages go through the model, and are counted: from the clones of one symbol to those of the next, a block.

    Attributes:
        places: States of a message after a reading of each symbol, (symbols, width).
        moves: The blocks by their keys, (keys, width, width).
    """

    def __init__(self, model: Clones) -> None:
        self.actions, self.states = model.goal.shape
        counts = np.bincount(model.clones, minlength=model.symbols)
        width = int(counts.max())
        # Place of each symbol's clones, (symbols, width); one past the last state where there are fewer.
        places = np.full((model.symbols, width), len(model.clones), dtype=np.intp)
        for symbol, (end, count) in enumerate(zip(np.cumsum(counts), counts, strict=True)):
            places[symbol, :count] = np.arange(end - count, end)
        self.places = places
        moves = np.pad(model.transitions.astype(NARROW), ((0, 0), (0, 1), (0, 1)))
        # By action and the symbols before and after: (actions x symbols x symbols, width, width).
        blocks = moves[:, places[:, None, :, None], places[None, :, None, :]]
        self.moves = np.ascontiguousarray(blocks.reshape(-1, width, width))
        self._goal = np.pad(model.goal.astype(NARROW), ((0, 0), (0, 1)))[:, places]
        self._start = np.pad(model.start.astype(NARROW), (0, 1))[places]

    def keys(self, actions: Numbers, symbols: Numbers, following: Numbers) -> Numbers:
        """Which block goes with each action and the readings about it."""
        return (actions * len(self.places) + symbols) * len(self.places) + following

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

    def products(self, before: Floats, after: Floats, following: Numbers) -> Floats:
        """Sum of the products of the messages about moves of one key, (width, width)."""
        summed: Floats = np.einsum("nc,nd->cd", before, after)
        return summed

    def counted(self, products: Floats) -> Floats:
        """Moves that such sums, (keys, width, width), come to, (actions, states, states)."""
        places, width = self.places, self.places.shape[1]
        moves = np.zeros((self.actions, self.states + 1, self.states + 1))
        moves[:, places[:, None, :, None], places[None, :, None, :]] = (products * self.moves).reshape(
            self.actions, len(places), len(places), width, width
        )
        return moves[:, :-1, :-1]

    def wrong(self, posterior: Floats, symbols: Numbers) -> float:
        """How many of these readings are not of the clone's own symbol."""
        return 0.0


class CloneCounts(Counts):
    """Posteriors of a batch, summed by action and clones."""

    def __init__(self, batch: Batch, chain: Blocks) -> None:
        self._batch, self._chain = batch, chain
        # The moves as they come, the last first, and where each stands in the order of their keys.
        running = np.array(batch.running[:0:-1], dtype=np.intp)
        times = np.repeat(np.arange(len(running) - 1, -1, -1), running)
        rows = np.arange(len(times)) - np.repeat(np.cumsum(running) - running, running)
        following = batch.symbols[rows, times + 1]
        self._keys = chain.keys(batch.actions[rows, times], batch.symbols[rows, times], following)
        order = np.argsort(self._keys, kind="stable")
        self._place = np.empty_like(order)
        self._place[order] = np.arange(len(order))
        self._keys, self._following, self._taken = self._keys[order], following[order], 0
        self._before, self._after = np.empty((2, len(order), chain.places.shape[1]), dtype=chain.moves.dtype)
        self._starts = np.zeros(chain.states + 1)
        self._goals = np.zeros((chain.actions, chain.states + 1))
        self._wrong = 0.0

    @override
    def state(self, time: int, posterior: Floats) -> None:
        batch, running = self._batch, len(posterior)
        symbols = batch.symbols[:running, time]
        self._wrong += self._chain.wrong(posterior, symbols)
        if time == 0:
            np.add.at(self._starts, self._chain.places[symbols], posterior)
        longer = batch.running[time + 1] if time + 1 < len(batch.running) else 0
        if longer < running:
            ends = slice(longer, running)
            where = batch.actions[ends, time][:, None], self._chain.places[symbols[ends]]
            np.add.at(self._goals, where, posterior[ends] * batch.reached[ends, None])

    @override
    def move(self, time: int, before: Floats, after: Floats) -> None:
        places = self._place[self._taken : self._taken + len(before)]
        self._before[places], self._after[places] = before, after
        self._taken += len(before)

    def sums(self, log_likelihood: float) -> Expected:
        """All of them, beside the log-likelihood of the batch."""
        products = np.zeros_like(self._chain.moves)
        present, begins = np.unique(self._keys, return_index=True)
        for key, begin, end in zip(present, begins, [*begins[1:], len(self._keys)], strict=True):
            rows = slice(begin, end)
            products[key] = self._chain.products(self._before[rows], self._after[rows], self._following[rows])
        wrong = (self._wrong + 1.0) / (float((self._batch.weights * self._batch.lengths).sum()) + 20.0)
        moves = self._chain.counted(products)
        return Expected(moves, self._goals[:, :-1], self._starts[:-1], wrong, log_likelihood)
