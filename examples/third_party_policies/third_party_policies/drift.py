"""A custom learner that learns on which side the hole has been, and searches there if there is no torque."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, cos, hypot, pi, sin
from typing import Any

import numpy as np

from palpate.core.policy import Action, Decision, EpisodeOutcome, Observation, Policy, PolicyContext, Transition

FELT_Nm = 0.005
"""Torque below which there is assumed to be none."""


class Drift(Policy):
    """A policy that follows the torque with its own steps, and without torque moves towards the mean of earlier holes.

    Because it provides its learned state, ``palpate train`` accepts it, and logs and policy files contain this state.
    """

    temperature = None

    def __init__(self, context: PolicyContext) -> None:
        x, y = context.actions[0].displacement_m
        self._step_m = hypot(x, y)
        self._sum_m, self._holes = [0.0, 0.0], 0

    def serves(self, state: int) -> bool:
        return True

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        self._rng = rng

    def choose(self, observation: Observation) -> Decision:
        tx, ty, _ = observation.torque_Nm
        x, y, _ = observation.reference_m
        if hypot(tx, ty) > FELT_Nm:
            # Pressed beside the hole, the peg is supported on the far side only: the hole is at heading (-ty, tx).
            heading = atan2(tx, -ty)
        elif self._holes and observation.action_number < 10:
            heading = atan2(self._sum_m[1] / self._holes - y, self._sum_m[0] / self._holes - x)
        else:
            heading = float(self._rng.uniform(0.0, 2 * pi))
        step = self._step_m * cos(heading), self._step_m * sin(heading)
        # No index: the step is none of the eight of the action set.
        return Decision(Action("drift", step), index=None, source="drift")

    def learn(self, transition: Transition) -> None:
        """Do nothing, because the policy learns from episode outcomes. This method receives only actions of the set."""

    def end_trial(self, episode: EpisodeOutcome) -> None:
        if episode.inserted:
            self._sum_m = [self._sum_m[0] + episode.tip_m[0], self._sum_m[1] + episode.tip_m[1]]
            self._holes += 1

    def get_state(self) -> dict[str, Any]:
        return {"sum_m": self._sum_m, "holes": self._holes}

    def set_state(self, state: Mapping[str, Any]) -> None:
        self._sum_m, self._holes = list(state["sum_m"]), int(state["holes"])
