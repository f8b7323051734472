"""The policy of an environment: what to do is decided outside, by whoever calls ``step``."""

from __future__ import annotations

import numpy as np

from palpate.core.errors import LifecycleError
from palpate.core.policy import Decision, Observation, Policy, Transition

SOURCE = "environment"
"""Where decisions come from, in the records of a trial."""


class GivenActions(Policy):
    """Chooses what it was given; learning is the affair of whoever gave it."""

    def __init__(self) -> None:
        self._decision: Decision | None = None

    @property
    def temperature(self) -> float | None:
        """There is no such thing."""
        return None

    def serves(self, state: int) -> bool:
        """True for every state."""
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Forget what was given before."""
        self._decision = None

    def give(self, decision: Decision) -> None:
        """What :meth:`choose` shall choose next."""
        self._decision = decision

    def choose(self, observation: Observation) -> Decision:
        """What was given; each only once.

        Raises:
            LifecycleError: Nothing was given since the last choice.
        """
        decision, self._decision = self._decision, None
        if decision is None:
            raise LifecycleError("given actions", "none is given", "choose()", "call give() first")
        return decision

    def learn(self, transition: Transition) -> None:
        """Nothing is learned here."""
