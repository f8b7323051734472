"""Clone-structured hidden Markov models: each hidden state belongs to one symbol, and no more is taken for granted.

A symbol that several places share has several clones, and which of them it is must follow from what was done and read
before (George and others, 2021). Neither place nor displacement is known: Baum-Welch learns where each action leads
from each clone, and which share of moves fails, whatever the clone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats, logarithm
from palpate.core.policy.memory.clone_counts import Blocks, CloneCounts, Clones, Expected
from palpate.core.policy.memory.finite_pomdp import FinitePomdp, require_room, rounded
from palpate.core.policy.memory.hidden_markov import LEAST, expect, forward
from palpate.core.policy.memory.misread_counts import Misread
from palpate.core.policy.memory.point_based import PointBasedPlan, perseus
from palpate.core.policy.memory.recorded import Batch, RecordedTrial

_VISITED: Final = 1.0  # visits that keep a clone
_SEEN: Final = 3.0  # times that an action was taken, to say whether it leads on
_SPARED, _SPARSE_FEW = 1.0, 0.3  # of a sparse fit: counts that each outcome loses, and pseudo-counts of a row in all
_CHANCE: Final = 3.0  # nats that moves which stay have to be worth, to count as led there


@dataclass(frozen=True, eq=False)
class CloneModel(Clones):
    """Where each action leads from each clone.

    Raises:
        ConfigurationError: Clones of no symbol, or not in order.
    """

    def __post_init__(self) -> None:
        if list(self.clones) != sorted(self.clones) or not all(0 <= clone < self.symbols for clone in self.clones):
            accepted = f"numbers from 0 to {self.symbols - 1} in rising order"
            raise ConfigurationError("model.clones", self.clones, accepted)

    def plan(self) -> PointBasedPlan:
        """By points; of the same seed, so it follows from the model."""
        return perseus(self.pomdp(), np.random.default_rng(0))

    def pomdp(self) -> FinitePomdp:
        """The same as a world with hidden states."""
        return FinitePomdp(self.start, self.transitions, self.goal, self.emissions)

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

    def improved(self, batch: Batch, *, sparse: bool = False) -> tuple[Self, float]:
        """One step of Baum-Welch: the better model, and the log-likelihood of the trials under this one.

        Args:
            sparse: Take it for likely that an action leads from each clone to one other, but for what fails; the share
                of wrong readings is learned then, if there is one: before, transitions account for them.
        """
        expected = self.expected(batch)
        moves, goals, starts = expected.moves, expected.goals, expected.starts
        few, fails = (_SPARSE_FEW if sparse else 1.0) / len(self.clones), 0.0
        if self.fails:
            stays, total = np.einsum("ass->as", moves), moves.sum(axis=2) + goals
            leads_on = (stays < 0.5 * total) & (total >= _SEEN)
            fails = (float(stays[leads_on].sum()) + 1.0) / (float(total[leads_on].sum()) + 20.0)
            stays -= np.where(_chance(stays, total, fails), stays, np.minimum(stays, fails * total))
        if sparse:
            moves, goals = np.maximum(moves - _SPARED, 0.0), np.maximum(goals - _SPARED, 0.0)
        moves, goals, starts = moves + few, goals + few, starts + 1.0 / len(self.clones)
        total = (moves.sum(axis=2) + goals) / (1.0 - fails)
        moves, goals = moves / total[:, :, None], goals / total
        np.einsum("ass->as", moves)[...] += fails
        misread = self.misread
        if misread and sparse:  # any symbol may be read, the clone's own too
            misread = min(0.5, expected.wrong * self.symbols / (self.symbols - 1))
        starts = starts / starts.sum()
        return type(self)(self.clones, self.symbols, starts, moves, goals, fails, misread), expected.log_likelihood

    def expected(self, batch: Batch) -> Expected:
        """What the trials hold by this model."""
        chain = self._chain()
        counts = CloneCounts(batch, chain)
        return counts.sums(expect(batch, chain, counts))

    def _chain(self) -> Blocks:
        return Misread(self) if self.misread else Blocks(self)

    def trimmed(self, batch: Batch) -> Self:
        """Without the clones that the trials hardly visit: what they cost goes into further iterations."""
        found, clones = self.expected(batch), np.array(self.clones)
        visits = found.moves.sum(axis=(0, 1)) + found.moves.sum(axis=(0, 2)) + found.goals.sum(axis=0)
        keep = visits >= _VISITED
        for symbol in range(self.symbols):  # that may be read in other trials
            keep[np.where(clones == symbol, visits, -1.0).argmax()] = True
        start, transitions, goal = self.start[keep], self.transitions[:, keep][:, :, keep], self.goal[:, keep]
        total = transitions.sum(axis=2) + goal
        left = tuple(clones[keep].tolist())
        moves = transitions / total[:, :, None]
        return type(self)(left, self.symbols, start / start.sum(), moves, goal / total, self.fails, self.misread)

    def fitted(self, batch: Batch, iterations: int, *, sparse: bool = False) -> Self:
        """After so many steps of Baum-Welch, each but the last one overrelaxed (Salakhutdinov and Roweis, 2003)."""
        model = self
        for _ in range(iterations - 1):
            model = model._beyond(model.improved(batch, sparse=sparse)[0])
        return model.improved(batch, sparse=sparse)[0]

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
        return replace(better, transitions=moves / total[:, :, None], goal=goals / total)

    def rounded(self) -> Self:
        """As a file holds it."""
        tables = rounded(self.start), rounded(self.transitions), rounded(self.goal)
        return type(self)(self.clones, self.symbols, *tables, self.fails, float(rounded(np.array(self.misread))))

    def log_loss(self, trials: Sequence[RecordedTrial]) -> float:
        """Nats a reading that these trials cost under the model; an arrival at the goal counts as one."""
        batch = Batch.of(trials)
        log_likelihood = forward(batch, self._chain()).log_likelihood
        return -float((log_likelihood * batch.weights).sum()) / batch.readings


def _chance(stays: Floats, total: Floats, fails: float) -> NDArray[np.bool_]:
    """Where as many moves that stay as these are no more than chance, if that share of all moves fails."""
    moved, seen = total - stays, np.maximum(total, LEAST)
    nats = stays * logarithm(np.maximum(stays / seen, LEAST) / fails)
    nats += moved * logarithm(np.maximum(moved / seen, LEAST) / (1.0 - fails))
    return (nats <= _CHANCE) | (stays <= fails * total)
