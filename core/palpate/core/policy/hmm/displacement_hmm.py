"""Hidden Markov model of the offset from the goal, with known displacements and learned observation probabilities.

The hidden state is the offset from the goal, in steps. An action either changes it by its known displacement or leaves
it unchanged. P(blocked | offset, action) and P(symbol | offset) are learned by Baum-Welch. If a trial reached the goal,
the offset before its last action is known, which anchors all its readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final, Self

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action
from palpate.core.policy.belief import Floats, exponential
from palpate.core.policy.hmm.baum_welch import Batch, Numbers, RecordedTrial, Shifts, expected_counts
from palpate.core.policy.hmm.point_based import FinitePomdp, PointBasedPlan, perseus

Offset = tuple[int, int]

_BLOCKED, _FREE = 0.1, 0.9  # pseudo-counts of a move
_SYMBOL: Final = 0.05  # pseudo-count of each symbol at each offset
_START, _START_CELLS = 0.5, 4.0  # weight and width of the expected starts
_NOISE: Final = 0.02
_VISITS: Final = 0.5  # offsets with no more expected visits are dropped
_FIRST_ITERATIONS, _FIRST_VISITS = 3, 0.001  # lower limit on visits while iterating, after this number of iterations
_SHRUNK: Final = 0.9  # ... applied if a smaller fraction of the offsets remains
_GAIN: Final = 0.01  # minimum gain of an iteration, in nats
_ANCHORED, _ITERATIONS = 15, 25  # iterations over the trials that reached the goal, and over all trials


def lattice_steps(actions: Sequence[Action], longest: int = 0) -> tuple[Offset, ...]:
    """Return the action displacements as whole numbers of steps.

    Args:
        longest: Number of steps in the longest displacement along x or y; the others are rounded. If 0, the shortest
            displacement is one step, and nothing is rounded.

    Raises:
        ConfigurationError: The displacements have no common lattice, all are zero, or one would be rounded to zero.
    """
    lengths = [abs(part) for action in actions for part in action.displacement_m if part]
    accepted = "displacements that are whole multiples of the shortest one along x or y, or a lattice to round them to"
    if longest:
        accepted = f"displacements of at least half a step along x or y, the longest side being {longest} steps"
    if not lengths:
        raise ConfigurationError("actions.displacement_m", (0.0, 0.0), accepted)
    unit, off = (max(lengths) / longest, 0.5) if longest else (min(lengths), 1e-6)
    for action in actions:
        parts = [part / unit for part in action.displacement_m]
        if any(abs(part - round(part)) > off or (part and not round(part)) for part in parts):
            raise ConfigurationError("actions.displacement_m", action.displacement_m, accepted)
    return tuple((round(x / unit), round(y / unit)) for x, y in (action.displacement_m for action in actions))


@dataclass(frozen=True, eq=False)
class DisplacementHmm:
    """Hidden Markov model of the offset from the goal.

    Attributes:
        offsets: Offsets (u, v) from the goal, in steps; a move to any other offset counts as blocked.
        start: Probability of each offset at the start, (offsets,).
        blocked: Probability that an action leaves the offset unchanged, (actions, offsets).
        emissions: Probability of each symbol, (offsets, symbols).
    """

    steps: tuple[Offset, ...]
    offsets: tuple[Offset, ...]
    start: Floats
    blocked: Floats
    emissions: Floats

    def targets(self) -> Numbers:
        """Return the target of each action from each offset, (actions, offsets).

        A target is the number of an offset, n for the goal, or n + 1 for an unknown offset.
        """
        count = len(self.offsets)
        place = {offset: number for number, offset in enumerate(self.offsets)} | {(0, 0): count}
        rows = [[place.get((u + du, v + dv), count + 1) for u, v in self.offsets] for du, dv in self.steps]
        return np.array(rows, dtype=np.intp)

    def plan(self) -> PointBasedPlan:
        """Return a point-based plan; its seed is fixed, so it depends only on the model."""
        states = len(self.offsets)
        targets = self.targets()
        stays = np.where(targets == states + 1, 1.0, self.blocked)
        transitions = np.zeros((len(self.steps), states, states + 2))
        places = np.arange(states)
        for action, row in enumerate(targets):
            transitions[action, places, row] = 1.0 - stays[action]
            transitions[action, places, places] += stays[action]
        pomdp = FinitePomdp(self.start, transitions[:, :, :states], transitions[:, :, states], self.emissions)
        return perseus(pomdp, np.random.default_rng(0))

    @classmethod
    def blank(cls, steps: tuple[Offset, ...], reach: int, symbols: int, rng: np.random.Generator) -> Self:
        """Return an untrained model with all offsets within ``reach`` steps and nearly uniform symbol probabilities."""
        sides = range(-reach, reach + 1)
        offsets = tuple((u, v) for v in sides for u in sides if (u, v) != (0, 0))
        emissions = 1.0 + _NOISE * rng.random((len(offsets), symbols))
        start = _expected_starts(offsets)
        blocked = np.full((len(steps), len(offsets)), _BLOCKED / (_BLOCKED + _FREE))
        emissions /= emissions.sum(axis=1, keepdims=True)
        return cls(steps, offsets, start / start.sum(), blocked, emissions)

    def improved(self, batch: Batch) -> tuple[Self, Floats, float]:
        """Take one Baum-Welch step.

        Returns:
            The improved model, the expected number of visits to each offset, (offsets,), and the log-likelihood of the
            trials under the previous model.
        """
        found = expected_counts(batch, Shifts(self.targets(), self.blocked, self.start, self.emissions))
        read = found.visits.sum(axis=0) + _SYMBOL
        started = found.starts + _expected_starts(self.offsets)
        blocked = (found.stays + _BLOCKED) / (found.visits[:-1].sum(axis=1) + _BLOCKED + _FREE)
        model = type(self)(
            self.steps, self.offsets, started / started.sum(), np.minimum(blocked, 1.0), (read / read.sum(axis=0)).T
        )
        return model, found.visits.sum(axis=(0, 1)), found.log_likelihood

    def pruned(self, visits: Floats, least: float) -> Self:
        """Return the model without the offsets that have at most ``least`` expected visits."""
        kept = np.flatnonzero(visits > least)
        if not len(kept):
            kept = np.arange(len(self.offsets))
        start = self.start[kept]
        offsets = tuple(self.offsets[place] for place in kept)
        return type(self)(self.steps, offsets, start / start.sum(), self.blocked[:, kept], self.emissions[kept])

    def rounded(self) -> Self:
        """Return the model with probabilities rounded to six decimals."""
        start, blocked, emissions = (np.round(each, 6) for each in (self.start, self.blocked, self.emissions))
        return type(self)(self.steps, self.offsets, start, blocked, emissions)


def fit_displacement_hmm(
    trials: Sequence[RecordedTrial], steps: tuple[Offset, ...], reach: int, symbols: int, *, seed: int = 0
) -> DisplacementHmm:
    """Fit a model from scratch.

    Trials that reached the goal are fitted first, because each ends at a known offset. The other trials
    have no known offset; fitted without this initial model, they could be placed at arbitrary offsets.

    Args:
        trials: Readings and actions from at least one trial.
    """
    model = DisplacementHmm.blank(steps, reach, symbols, np.random.default_rng(seed))
    if anchored := [trial for trial in trials if trial.reached]:
        batch = Batch.of(anchored)
        for _ in range(_ANCHORED):
            model, _, _ = model.improved(batch)
    batch = Batch.of(trials)
    visits, before = np.ones(len(model.offsets)), -inf
    for iteration in range(_ITERATIONS):
        model, visits, log_likelihood = model.improved(batch)
        if log_likelihood - before < _GAIN and iteration > _FIRST_ITERATIONS:
            break
        before = log_likelihood
        if iteration >= _FIRST_ITERATIONS:
            kept = visits > _FIRST_VISITS
            if kept.mean() < _SHRUNK:
                model, visits = model.pruned(visits, _FIRST_VISITS), visits[kept]
    return model.pruned(visits, _VISITS).rounded()


def _expected_starts(offsets: Sequence[Offset]) -> Floats:
    squares = np.array([float(u * u + v * v) for u, v in offsets])
    return _START * exponential(-0.5 / _START_CELLS**2 * squares)
