"""Boltzmann exploration with a temperature that decreases from trial to trial (paper, section 6)."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, fsum
from typing import ClassVar, Final

import numpy as np
from typing_extensions import override

from palpate.core.ports import Settings, Temperature, TemperatureDecay, require_floor

GREEDY_BELOW: Final = 1e-6
"""Temperature below which exploration is off and a best action is always taken."""


@dataclass(frozen=True, slots=True)
class TemperatureSchedule(Settings):
    """Geometric decay with a floor: ``T(trial) = max(floor, initial * decay**trial)``.

    Keep the floor above zero if different positions map to the same state: without randomness, a policy may alternate
    between two of them forever, and its learned values deteriorate.
    """

    TABLE: ClassVar[str] = "policy.temperature"

    initial: Temperature
    """Temperature for trial 0, in Q-value units."""
    decay: TemperatureDecay
    """Factor from one trial to the next."""
    floor: Temperature
    """Minimum temperature, at most the initial one."""
    in_use: Temperature | None = None
    """Temperature for a frozen policy if it is below the floor; None uses the floor."""

    @override
    def check(self) -> None:
        require_floor(self.dotted("floor"), self.floor, self.initial, "the initial temperature")

    def at(self, trial: int) -> float:
        """Return the temperature for a trial; trials are numbered from 0."""
        return max(self.floor, self.initial * self.decay**trial)

    @property
    def when_frozen(self) -> float:
        """Return the temperature for a policy that does not learn."""
        return self.floor if self.in_use is None else min(self.floor, self.in_use)


def boltzmann_probabilities(values: Sequence[float], temperature: float) -> list[float]:
    """Return the probability of each action, proportional to ``exp(Q / T)``.

    Below :data:`GREEDY_BELOW`, the best actions are equally probable and all others are excluded.

    Args:
        values: Finite Q value for each action, (n,) with n > 0.
        temperature: T, in Q-value units.
    """
    best = max(values)
    if temperature < GREEDY_BELOW:
        weights = [1.0 if value == best else 0.0 for value in values]
    else:
        # Subtracting the best value keeps every exponent at or below 0, which prevents overflow.
        weights = [exp((value - best) / temperature) for value in values]
    total = fsum(weights)
    return [weight / total for weight in weights]


def boltzmann(values: Sequence[float], temperature: float, rng: np.random.Generator) -> int:
    """Draw an action index using :func:`boltzmann_probabilities`.

    The function always draws exactly one number from ``rng``, so that random streams stay aligned.
    """
    draw = rng.random()
    probabilities = boltzmann_probabilities(values, temperature)
    cumulative = 0.0
    for index, probability in enumerate(probabilities):
        cumulative += probability
        if draw < cumulative:
            return index
    return probabilities.index(max(probabilities))  # rounding left the sum just under the draw
