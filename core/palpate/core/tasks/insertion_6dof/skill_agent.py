"""The learning half of a task whose actions are skills: the policy chooses anew when the one that runs is over."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from typing_extensions import override

from palpate.core.perception import Perception
from palpate.core.policy import Action, Decision, Observation, Policy, Reinforcement
from palpate.core.ports import Vector3
from palpate.core.tasks.insertion import Agent
from palpate.core.tasks.insertion_6dof.skills import Skills


class SkillAgent(Agent):
    """Runs the chosen skill action by action; symbols, states and learning are of whole skills.

    Args:
        skills: Runs them.
    """

    def __init__(
        self, perception: Perception, policy: Policy, reinforcement: Reinforcement, tick_s: float, skills: Skills
    ) -> None:
        super().__init__(perception, policy, reinforcement, tick_s)
        self._skills = skills

    @override
    def begin(self, trial: int, rng: np.random.Generator) -> None:
        super().begin(trial, rng)
        self._skills.begin_trial()
        self._running: Decision | None = None
        self._goes_on, self._began = False, 0

    @override
    def perceive(
        self,
        tick: int,
        position_m: Vector3,
        reference_m: Vector3,
        force_N: Vector3,
        torque_Nm: Vector3,
        turn_rad: Vector3 = (0.0, 0.0, 0.0),
        live_torque_Nm: Vector3 = (0.0, 0.0, 0.0),
        depth_m: float = 0.0,
    ) -> Observation:
        """An action has ended; where its skill has, too, learn from it."""
        state, number = 0 if self.percept is None else self.percept[1], len(self.decisions)
        seen = Observation(
            state, position_m, reference_m, force_N, torque_Nm, number, turn_rad, live_torque_Nm, depth_m
        )
        self._of_the_task = self._skills.facts(seen)
        if self._running is not None and not self._skills.over(seen):
            self._asked = (tick, seen)
            return seen
        self._running, self._goes_on = None, False
        # An insertion that got stuck took its time though no action ran.
        self._ticks = max(self._ticks, tick - self._began)
        self._began = tick
        return super().perceive(tick, position_m, reference_m, force_N, torque_Nm, turn_rad, live_torque_Nm, depth_m)

    @override
    def _decide(self, observation: Observation) -> Decision:
        if (chosen := self._running) is None:
            chosen = super()._decide(observation)
            if chosen.index is None:
                return chosen
            self._running, self._goes_on = chosen, True
            self._skills.begin(chosen.action, observation)
        displacement_m, spatial = self._skills.step(observation)
        return replace(chosen, action=Action(chosen.action.name, displacement_m, spatial))
