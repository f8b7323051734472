"""Which hidden state a trial may be in: Bayes' rule, action by action and symbol by symbol."""

from typing import Final

import numpy as np

from palpate.core.policy.belief import Floats
from palpate.core.policy.hmm.finite_pomdp import FinitePomdp

IMPOSSIBLE: Final = 1e-7
"""A reading less likely than this refutes the belief: it restarts with that reading."""


class StateBelief:
    """A belief over the hidden states of a model.

    Attributes:
        probabilities: Of each state, (states,); they sum to 1.
    """

    def __init__(self, model: FinitePomdp, symbol: int) -> None:
        self._model = model
        self.probabilities = self._read(model.start, symbol)

    def update(self, action: int, symbol: int) -> None:
        """Take in an action that did not lead to the goal, and what was read after it."""
        self.probabilities = self._read(self._model.moved(self.probabilities, action), symbol)

    def _read(self, expected: Floats, symbol: int) -> Floats:
        emission = self._model.emissions[:, symbol]
        joint = expected * emission
        likelihood = float(joint.sum())
        if likelihood >= IMPOSSIBLE:
            return joint / likelihood
        anew = self._model.start * emission
        if float(anew.sum()) < IMPOSSIBLE:
            anew = emission if float(emission.sum()) > 0.0 else np.ones_like(emission)
        restarted: Floats = anew / anew.sum()
        return restarted
