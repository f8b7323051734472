"""Belief-space planning with QMDP, which assumes full observability after one step, or Perseus, which does not.

Perseus (Spaan and Vlassis, 2005) improves a set of vectors at beliefs sampled by simulating the model. Each vector
holds the cost of one plan from every hidden state; the cost of a belief is the minimum over the vectors. Costs, beliefs
and probabilities are rounded to grids of binary fractions, coarse enough that every sum of products is exact. Matrix
products are therefore bit-identical on all processors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats
from palpate.core.policy.hmm.baum_welch import Numbers

_MOST_BYTES: Final = 512 * 2**20  # limit for the transitions of a model
IMPOSSIBLE: Final = 1e-7
"""Reading probability below which the belief is discarded and restarts from that reading."""


def require_room(where: str, states: int, actions: int) -> None:
    """Reject a model that would be too large, before it is built.

    Raises:
        ConfigurationError: The model has too many states.
    """
    if 8 * actions * states * states > _MOST_BYTES:
        most = int((_MOST_BYTES / (8 * actions)) ** 0.5)
        accepted = (
            f"at most {most} with {actions} actions: more than {_MOST_BYTES // 2**20} MB are not set aside for one"
        )
        raise ConfigurationError(where, f"{states} hidden states", accepted)


@dataclass(frozen=True, eq=False)
class FinitePomdp:
    """A POMDP with a goal that ends the trial and has no symbol.

    Rows need to sum to 1 only approximately, because derived beliefs are normalised.

    Attributes:
        start: Probability of each state at the start, (states,).
        transitions: Probability of each state after an action, (actions, states before, states after).
        goal: Probability that an action leads to the goal, (actions, states).
        emissions: Probability of each symbol, (states, symbols).
    """

    start: Floats
    transitions: Floats
    goal: Floats
    emissions: Floats

    @property
    def states(self) -> int:
        """Number of hidden states."""
        return len(self.start)

    @property
    def actions(self) -> int:
        """Number of actions."""
        return len(self.goal)

    @property
    def symbols(self) -> int:
        """Number of symbols."""
        return int(self.emissions.shape[1])

    def moved(self, probabilities: Floats, action: int) -> Floats:
        """Return the probability of each state after an action that did not lead to the goal, (states,)."""
        # Unlike BLAS, sparse products add in the same order on every processor.
        after: Floats = self._ways[action] @ probabilities
        return after

    @cached_property
    def _ways(self) -> list[Any]:
        # Imported late: every command loads the learner's parameters, but few make a plan.
        from scipy.sparse import csr_array

        return [csr_array(moves).T for moves in self.transitions]


class StateBelief:
    """A belief over a model's hidden states.

    Attributes:
        probabilities: Probability of each state, (states,); the sum is 1.
    """

    def __init__(self, model: FinitePomdp, symbol: int) -> None:
        self._model = model
        self.probabilities = self._read(model.start, symbol)

    def update(self, action: int, symbol: int) -> None:
        """Update the belief with an action that did not lead to the goal, and the symbol read after it."""
        self.probabilities = self._read(self._model.moved(self.probabilities, action), symbol)

    def _read(self, expected: Floats, symbol: int) -> Floats:
        emission = self._model.emissions[:, symbol]
        joint = expected * emission
        likelihood = float(joint.sum())
        if likelihood >= IMPOSSIBLE:
            return joint / likelihood
        fresh = self._model.start * emission
        if float(fresh.sum()) < IMPOSSIBLE:
            fresh = emission if float(emission.sum()) > 0.0 else np.ones_like(emission)
        restarted: Floats = fresh / fresh.sum()
        return restarted


DISCOUNT: Final = 0.98
_SWEEPS: Final = 150
_BELIEFS: Final = 200
_STAGES: Final = 30
_WALKS, _STEPS, _RANDOM = 64, 16, 0.25  # simulated trials that gather beliefs, their steps, their random fraction
_GAIN: Final = 0.003  # planning ends after a stage that improves no belief by more than this
_LOSS: Final = 0.002 * 2.0**42  # tolerated increase of a belief's cost, in units of the grid
# Sums stay below 2**53: beliefs and emissions sum to one, and no cost is above 1 / (1 - DISCOUNT) = 50 < 2**6.
_COST: Final = 2.0**20
_SHARE: Final = 2.0**22


def _on_grid(values: Floats, steps: float) -> Floats:
    """Round values to integer multiples of 1 / ``steps``, and return the multiples."""
    result: Floats = np.rint(values * steps)
    return result


def qmdp(model: FinitePomdp) -> Floats:
    """Return the cost of each action in each state if the state is observable from the next step, (states, actions)."""
    values = np.zeros(model.states)
    costs = np.zeros((model.states, model.actions))
    moves = _on_grid(model.transitions, _SHARE).reshape(-1, model.states)
    for _ in range(_SWEEPS):
        after = (moves @ _on_grid(values, _COST)) / (_SHARE * _COST)
        costs = 1.0 + DISCOUNT * after.reshape(model.actions, model.states).T
        values = costs.min(axis=1)
    return costs


@dataclass(frozen=True, eq=False)
class PointBasedPlan:
    """A plan that consists of cost vectors over a model's states.

    Attributes:
        vectors: Discounted number of steps to the goal under each plan, (plans, states).
    """

    model: FinitePomdp
    vectors: Floats

    @cached_property
    def _weighed(self) -> Floats:
        return _on_grid(self.vectors, _COST)

    def costs(self, probabilities: Floats) -> Floats:
        """Return the discounted number of steps to the goal for each action followed by the best plan, (actions,).

        Args:
            probabilities: Hidden-state probabilities, (states,).
        """
        moved = np.stack([self.model.moved(probabilities, action) for action in range(self.model.actions)])
        some = np.flatnonzero(moved.max(axis=0) > 0.5 / _SHARE)  # the others are zero on the grid
        joint = _on_grid(moved[:, None, some] * self.model.emissions[some].T, _SHARE)
        promised = joint.reshape(-1, len(some)) @ self._weighed[:, some].T
        least = promised.min(axis=1).reshape(self.model.actions, -1) / (_SHARE * _COST)
        costs: Floats = 1.0 + DISCOUNT * least.sum(axis=1)
        return costs


def perseus(model: FinitePomdp, rng: np.random.Generator) -> PointBasedPlan:
    """Return a plan computed by point-based value iteration."""
    from scipy.sparse import csr_array

    beliefs = _on_grid(_met(model, qmdp(model), rng), _SHARE)
    vectors = np.full((1, model.states), _on_grid(np.array(1.0 / (1.0 - DISCOUNT)), _COST))
    values = (beliefs @ vectors.T).min(axis=1)
    # All sums are exact, so their order does not matter.
    moves = [csr_array(_on_grid(transitions, _SHARE)) for transitions in model.transitions]
    for _ in range(_STAGES):
        fresh = _backed_up(model, moves, beliefs, vectors)
        promised = beliefs @ fresh.T
        keep = beliefs @ vectors.T
        chosen: list[Floats] = []
        reached = np.full(len(beliefs), np.inf)
        waiting = np.ones(len(beliefs), dtype=bool)
        while waiting.any():
            # The belief that gains most comes first, because its plan also improves most of the others.
            gains = np.where(waiting, values - promised.diagonal(), -np.inf)
            number = int(gains.argmax())
            if promised[number, number] <= values[number]:
                chosen.append(fresh[number])
                reached = np.minimum(reached, promised[:, number])
            else:
                old = int(keep[number].argmin())
                chosen.append(vectors[old])
                reached = np.minimum(reached, keep[:, old])
            waiting &= reached > values + _LOSS
            waiting[number] = False
        gained = float((values - reached).max()) / (_SHARE * _COST)
        vectors, values = np.array(chosen), reached
        if gained < _GAIN:
            break
    return PointBasedPlan(model, vectors / _COST)


def _backed_up(model: FinitePomdp, moves: Sequence[Any], beliefs: Floats, vectors: Floats) -> Floats:
    """Return the best plan for each belief, one action and then one vector per symbol, (beliefs, states)."""
    # Cost of each vector after the move, times the probability of each symbol.
    read = np.rint(model.emissions.T[:, None, :] * vectors[None])
    columns = np.ascontiguousarray(read.reshape(-1, model.states).T)
    best, promised = [], []
    for each in moves:
        behind = each @ columns
        np.rint(behind / _SHARE, out=behind)
        costs = (beliefs @ behind).reshape(len(beliefs), model.symbols, -1)
        best.append(costs.argmin(axis=2))
        promised.append(costs.min(axis=2).sum(axis=1))
    action = np.argmin(promised, axis=0)
    backed = np.empty_like(beliefs)
    for number, each in enumerate(moves):
        rows = np.flatnonzero(action == number)
        follow = read[np.arange(model.symbols), best[number][rows]]  # (rows, symbols, states)
        behind = np.rint(each @ follow.reshape(-1, model.states).T / _SHARE)
        picked = behind.T.reshape(follow.shape).sum(axis=1)
        backed[rows] = np.rint(_COST + DISCOUNT * picked)
    return backed


def _met(model: FinitePomdp, costs: Floats, rng: np.random.Generator) -> Floats:
    """Return the distinct beliefs in simulated trials with QMDP and random actions, (beliefs, states)."""
    beliefs = np.repeat(model.start[None], _WALKS, axis=0)
    states = _drawn(beliefs, rng)
    found: dict[bytes, Floats] = {}
    weighed = _on_grid(costs, _COST)
    for _ in range(_STEPS):
        symbols = _drawn(model.emissions[states], rng)
        joint = beliefs * model.emissions[:, symbols].T
        beliefs = joint / np.maximum(joint.sum(axis=1, keepdims=True), 1e-12)
        for belief in beliefs:
            found.setdefault(np.rint(belief * 1000.0).tobytes(), belief)
        actions = (_on_grid(beliefs, _SHARE) @ weighed).argmin(axis=1)
        chance = rng.random(len(actions)) < _RANDOM
        actions = np.where(chance, rng.integers(model.actions, size=len(actions)), actions)
        following = model.transitions[actions, states]
        arrived = rng.random(len(actions)) < model.goal[actions, states]
        beliefs = np.stack([model.moved(belief, action) for belief, action in zip(beliefs, actions, strict=True)])
        beliefs /= np.maximum(beliefs.sum(axis=1, keepdims=True), 1e-12)
        states = _drawn(np.where(following.sum(axis=1, keepdims=True) > 0.0, following, model.start), rng)
        again = _drawn(np.repeat(model.start[None], len(states), axis=0), rng)
        states = np.where(arrived, again, states)
        beliefs[arrived] = model.start
    every = list(found.values())
    if len(every) > _BELIEFS:
        every = [every[place] for place in np.sort(rng.choice(len(every), _BELIEFS, replace=False))]
    return np.array(every)


def _drawn(weights: Floats, rng: np.random.Generator) -> Numbers:
    """Draw one column from each row with probabilities proportional to the weights."""
    sums = np.cumsum(weights, axis=1)
    draws = rng.random(len(weights)) * sums[:, -1]
    drawn: Numbers = np.minimum((sums <= draws[:, None]).sum(axis=1), weights.shape[1] - 1)
    return drawn
