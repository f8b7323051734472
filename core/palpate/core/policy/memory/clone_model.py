"""Clone-structured hidden Markov models: each hidden state belongs to one symbol, and no more is taken for granted.

A symbol that several places share has several clones, and which of them it is must follow from what was done and read
before (George and others, 2021). Neither place nor displacement is known: Baum-Welch learns where each action leads
from each clone. From a random beginning it finds one of many local optima, so several are fitted, and those that
foretell other trials best are kept side by side.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Self

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats
from palpate.core.policy.memory.finite_pomdp import FinitePomdp, require_room, rounded
from palpate.core.policy.memory.hidden_markov import expect, forward
from palpate.core.policy.memory.point_based import PointBasedPlan, perseus
from palpate.core.policy.memory.recorded import Batch, Numbers, RecordedTrial

HIDDEN: Final = 140
"""Hidden states that a model is begun with: more than there are places, which leads out of local optima."""
_GUESSES: Final = 5  # random beginnings
KEPT: Final = 3
"""Models that are kept."""
_FIRST, _FURTHER, _LAST = 25, 15, 15  # iterations: of all guesses, of a round of those kept, of these on all trials
_TOLD: Final = 20  # of those kept, where their clones are told
_ROUNDS: Final = 5  # at most
_GAIN: Final = 0.03  # a round that lowers the loss on held-out trials by a smaller share is the last
_VISITED: Final = 1.0  # visits that keep a clone
_NARROW: Final[Any] = np.float32  # of messages: with as many clones, time goes into moving blocks of them


@dataclass(frozen=True, eq=False)
class CloneModel:
    """Where each action leads from each clone.

    Attributes:
        clones: Symbol of each hidden state, (states,), in rising order.
        start: Probability of each state at the start, (states,).
        transitions: Probability of each state after an action, (actions, states before, states after).
        goal: Probability that an action leads to the goal, (actions, states).

    Raises:
        ConfigurationError: Clones of no symbol, or not in order.
    """

    clones: tuple[int, ...]
    symbols: int
    start: Floats
    transitions: Floats
    goal: Floats

    def __post_init__(self) -> None:
        if list(self.clones) != sorted(self.clones) or not all(0 <= clone < self.symbols for clone in self.clones):
            accepted = f"numbers from 0 to {self.symbols - 1} in rising order"
            raise ConfigurationError("model.clones", self.clones, accepted)

    def plan(self) -> PointBasedPlan:
        """By points; of the same seed, so it follows from the model."""
        return perseus(self.pomdp(), np.random.default_rng(0))

    def pomdp(self) -> FinitePomdp:
        """The same as a world with hidden states."""
        return FinitePomdp(self.start, self.transitions, self.goal, np.eye(self.symbols)[list(self.clones)])

    @classmethod
    def blank(cls, clones: tuple[int, ...], symbols: int, actions: int, rng: np.random.Generator) -> Self:
        """A random beginning.

        Raises:
            ConfigurationError: It would be too large.
        """
        states = len(clones)
        require_room("clones", states, actions)
        moves = rng.random((actions, states, states + 1))
        moves /= moves.sum(axis=2, keepdims=True)
        return cls(clones, symbols, np.full(states, 1.0 / states), moves[:, :, :-1], moves[:, :, -1])

    def improved(self, batch: Batch) -> tuple[Self, float]:
        """One step of Baum-Welch: the better model, and the log-likelihood of the trials under this one."""
        (moves, goals, starts), log_likelihood = self._expected(batch)
        few = 1.0 / len(self.clones)
        moves, goals, starts = moves + few, goals + few, starts + few
        total = moves.sum(axis=2) + goals
        start = starts / starts.sum()
        return type(self)(self.clones, self.symbols, start, moves / total[:, :, None], goals / total), log_likelihood

    def _expected(self, batch: Batch) -> tuple[tuple[Floats, Floats, Floats], float]:
        """Moves, arrivals at the goal and starts that the trials hold by this model, and their log-likelihood."""
        chain = _Blocks(self)
        counts = _CloneCounts(self, batch, chain)
        log_likelihood = expect(batch, chain, counts)
        return counts.sums(), log_likelihood

    def trimmed(self, batch: Batch) -> Self:
        """Without the clones that the trials hardly visit: what they cost goes into further iterations."""
        moves, goals, _ = self._expected(batch)[0]
        visits, clones = moves.sum(axis=(0, 1)) + moves.sum(axis=(0, 2)) + goals.sum(axis=0), np.array(self.clones)
        keep = visits >= _VISITED
        for symbol in range(self.symbols):  # that may be read in other trials
            keep[np.where(clones == symbol, visits, -1.0).argmax()] = True
        start, transitions, goal = self.start[keep], self.transitions[:, keep][:, :, keep], self.goal[:, keep]
        total = transitions.sum(axis=2) + goal
        left = tuple(clones[keep].tolist())
        return type(self)(left, self.symbols, start / start.sum(), transitions / total[:, :, None], goal / total)

    def ripened(self, batch: Batch, held: Sequence[RecordedTrial]) -> Self:
        """After as many rounds of iterations as other trials are foretold the better for, trimmed before each."""
        model, loss = self, np.inf
        for _ in range(_ROUNDS):
            further = model.trimmed(batch).fitted(batch, _FURTHER)
            before, loss = loss, further.log_loss(held)
            if loss >= before:
                break
            model = further
            if loss > (1.0 - _GAIN) * before:
                break
        return model

    def fitted(self, batch: Batch, iterations: int) -> Self:
        """After so many steps of Baum-Welch, each but the last one overrelaxed (Salakhutdinov and Roweis, 2003)."""
        model = self
        for _ in range(iterations - 1):
            model = model._beyond(model.improved(batch)[0])
        return model.improved(batch)[0]

    def _beyond(self, better: Self) -> Self:
        """As far again, nearly, as a step came: what it multiplied is multiplied once more, to the power of 7/8."""
        moves, goals = (
            new * (ratio / np.sqrt(np.sqrt(np.sqrt(ratio))))
            for new, ratio in (
                (better.transitions, better.transitions / self.transitions),
                (better.goal, better.goal / self.goal),
            )
        )
        total = moves.sum(axis=2) + goals
        return type(self)(self.clones, self.symbols, better.start, moves / total[:, :, None], goals / total)

    def rounded(self) -> Self:
        """As a file holds it."""
        return type(self)(self.clones, self.symbols, rounded(self.start), rounded(self.transitions), rounded(self.goal))

    def log_loss(self, trials: Sequence[RecordedTrial]) -> float:
        """Nats a reading that these trials cost under the model; an arrival at the goal counts as one."""
        batch = Batch.of(trials)
        log_likelihood = forward(batch, _Blocks(self)).log_likelihood
        return -float((log_likelihood * batch.weights).sum()) / batch.readings


def clones_of(trials: Sequence[RecordedTrial], symbols: int, total: int) -> tuple[int, ...]:
    """Symbols of about so many hidden states: as many clones as a symbol is frequent, and at least two."""
    counts = np.bincount([symbol for trial in trials for symbol in trial.symbols], minlength=symbols)
    shares = [max(2, round(total * int(count) / int(counts.sum()))) for count in counts]
    return tuple(symbol for symbol, share in enumerate(shares) for _ in range(share))


def fit_clones(
    trials: Sequence[RecordedTrial],
    symbols: int,
    actions: int,
    *,
    seed: int = 0,
    clones: tuple[int, ...] | None = None,
    guesses: int = _GUESSES,
    kept: int = KEPT,
) -> tuple[CloneModel, ...]:
    """Fit models from scratch; the best of them by their loss on held-out trials come first.

    Args:
        trials: What was read and done, at least ten trials; one of five is held out.
        clones: Symbol of each hidden state, in rising order; None for as many as a symbol is frequent.
        guesses: Random beginnings.
        kept: Models that are kept.
    """
    rng = np.random.default_rng(seed)
    taught, held = Batch.of([trial for number, trial in enumerate(trials) if number % 5 != 4]), trials[4::5]
    told, whole = clones is not None, Batch.of(trials)
    clones = clones or clones_of(trials, symbols, HIDDEN)
    begun = [CloneModel.blank(clones, symbols, actions, rng).fitted(taught, _FIRST) for _ in range(guesses)]
    if told:  # as many as they are
        better = [guess.fitted(taught, _TOLD) for guess in _best(begun, held, kept)]
        return tuple(model.fitted(whole, _LAST).rounded() for model in _best(better, held, kept))
    better = [guess.ripened(taught, held) for guess in _best(begun, held, kept)]
    return tuple(model.trimmed(whole).fitted(whole, _LAST).rounded() for model in _best(better, held, kept))


def _best(models: Sequence[CloneModel], held: Sequence[RecordedTrial], count: int) -> list[CloneModel]:
    losses = [model.log_loss(held) for model in models]
    return [models[place] for place in sorted(range(len(models)), key=losses.__getitem__)[:count]]


class _Blocks:
    """How messages go through the model: from the clones of one symbol to those of the next, a small block."""

    def __init__(self, model: CloneModel) -> None:
        counts = np.bincount(model.clones, minlength=model.symbols)
        self.width = width = int(counts.max())
        # Place of each symbol's clones, (symbols, width); one past the last state where there are fewer.
        places = np.full((model.symbols, width), len(model.clones), dtype=np.intp)
        for symbol, (end, count) in enumerate(zip(np.cumsum(counts), counts, strict=True)):
            places[symbol, :count] = np.arange(end - count, end)
        self.places = places
        moves = np.pad(model.transitions.astype(_NARROW), ((0, 0), (0, 1), (0, 1)))
        # By action and the symbols before and after: (actions x symbols x symbols, width, width).
        blocks = moves[:, places[:, None, :, None], places[None, :, None, :]]
        self.moves = np.ascontiguousarray(blocks.reshape(-1, width, width))
        self._symbols = model.symbols
        self._goal = np.pad(model.goal.astype(_NARROW), ((0, 0), (0, 1)))[:, places]
        self._start = np.pad(model.start.astype(_NARROW), (0, 1))[places]

    def keys(self, actions: Numbers, symbols: Numbers, following: Numbers) -> Numbers:
        """Places of the blocks."""
        return (actions * self._symbols + symbols) * self._symbols + following

    def first(self, symbols: Numbers) -> Floats:
        return self._start[symbols]

    def forward(self, before: Floats, actions: Numbers, symbols: Numbers, following: Numbers) -> Floats:
        blocks = self.moves.take(self.keys(actions, symbols, following), axis=0)
        after: Floats = np.einsum("nc,ncd->nd", before, blocks)
        return after

    def backward(self, after: Floats, actions: Numbers, symbols: Numbers, following: Numbers) -> Floats:
        blocks = self.moves.take(self.keys(actions, symbols, following), axis=0)
        before: Floats = np.einsum("nd,ncd->nc", after, blocks)
        return before

    def goal(self, actions: Numbers, symbols: Numbers) -> Floats:
        return self._goal[actions, symbols]


class _CloneCounts:
    """Posteriors of a batch, summed by action and clones."""

    def __init__(self, model: CloneModel, batch: Batch, chain: _Blocks) -> None:
        self._batch, self._chain = batch, chain
        self._actions, self._symbols, self._states = len(model.goal), model.symbols, len(model.clones)
        none = np.zeros((0, chain.width), dtype=_NARROW)
        self._keys: list[Numbers] = [np.zeros(0, dtype=np.intp)]
        self._before: list[Floats] = [none]
        self._after: list[Floats] = [none]
        self._starts = np.zeros(self._states + 1)
        self._goals = np.zeros((self._actions, self._states + 1))

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
