"""A world with hidden states as numbers, for planners; and the belief over its states."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.belief import Floats

_MOST_BYTES: Final = 512 * 2**20  # of the transitions of a model
_DECIMALS: Final = 6
IMPOSSIBLE: Final = 1e-7
"""A reading less likely than this refutes the belief: it restarts with that reading."""


def require_room(where: str, states: int, actions: int) -> None:
    """Refuse a model that is too large, before it is built.

    Raises:
        ConfigurationError: With the number of states that there is room for.
    """
    if 8 * actions * states * states > _MOST_BYTES:
        most = int((_MOST_BYTES / (8 * actions)) ** 0.5)
        accepted = (
            f"at most {most} with {actions} actions: more than {_MOST_BYTES // 2**20} MB are not set aside for one"
        )
        raise ConfigurationError(where, f"{states} hidden states", accepted)


def rounded(probabilities: Floats) -> Floats:
    """Probabilities without what is as good as nothing, so that few states follow on each."""
    result: Floats = np.round(probabilities, _DECIMALS)
    return result


@dataclass(frozen=True, eq=False)
class FinitePomdp:
    """Hidden states, actions, symbols, and a goal that ends the trial and has no symbol.

    Rows need not sum to 1 to the last digit: what is made of them is scaled.

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
        """Probability of each state after an action that did not lead to the goal, (states,)."""
        # Sums run in one order on every processor, unlike those of BLAS.
        after: Floats = self._ways[action] @ probabilities
        return after

    @cached_property
    def _ways(self) -> list[Any]:
        # Every command knows the learner's parameters; few plan.
        from scipy.sparse import csr_array

        return [csr_array(moves).T for moves in self.transitions]


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
