"""Which hidden state a trial may be in: Bayes' rule, action by action and symbol by symbol."""

from typing import Final, Protocol

import numpy as np

from palpate.core.policy.belief import Floats

IMPOSSIBLE: Final = 1e-7
"""A reading less likely than this refutes the belief: it begins anew with that reading."""


class HiddenWorld(Protocol):
    """What a belief and a plan need of a model, of whatever kind."""

    @property
    def start(self) -> Floats:
        """Probability of each state at the start, (states,)."""

    @property
    def states(self) -> int:
        """Number of hidden states."""

    @property
    def actions(self) -> int:
        """Number of actions."""

    @property
    def symbols(self) -> int:
        """Number of symbols."""

    def moved(self, probabilities: Floats, action: int) -> Floats:
        """Probability of each state after an action that did not lead to the goal, (states,)."""

    def emission(self, symbol: int) -> Floats:
        """Probability of a symbol in each state, (states,)."""


class StateBelief:
    """A belief over the hidden states of a model.

    Attributes:
        probabilities: Of each state, (states,); they sum to 1.
        likelihood: Probability that the model gave to the last reading; 1 of the start counts too.
    """

    def __init__(self, model: HiddenWorld, symbol: int) -> None:
        self._model = model
        self.probabilities, self.likelihood = self._read(model.start, symbol)

    def update(self, action: int, symbol: int) -> None:
        """Take in an action that did not lead to the goal, and what was read after it."""
        self.probabilities, self.likelihood = self._read(self._model.moved(self.probabilities, action), symbol)

    def _read(self, expected: Floats, symbol: int) -> tuple[Floats, float]:
        emission = self._model.emission(symbol)
        joint = expected * emission
        likelihood = float(joint.sum())
        if likelihood >= IMPOSSIBLE:
            return joint / likelihood, likelihood
        anew = self._model.start * emission
        if float(anew.sum()) < IMPOSSIBLE:
            anew = emission if float(emission.sum()) > 0.0 else np.ones_like(emission)
        return anew / anew.sum(), IMPOSSIBLE
