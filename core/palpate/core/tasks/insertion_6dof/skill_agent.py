"""The learning half of a task whose actions are skills: the policy chooses anew when the one that runs is over."""

from dataclasses import replace

import numpy as np
from typing_extensions import override

from palpate.core.perception import Perception
from palpate.core.policy import Action, Decision, Observation, Policy, Reinforcement
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
        self._began: int

    @override
    def begin(self, trial: int, rng: np.random.Generator) -> None:
        super().begin(trial, rng)
        self._skills.begin_trial()
        self._running: Decision | None = None

    @override
    def _learn_from(self, tick: int, seen: Observation) -> int:
        self._of_the_task = self._skills.facts(seen)
        if self._running is not None and not self._skills.over(seen):
            return seen.state
        if self._pending is not None:
            # An insertion that got stuck took its time though no action ran.
            self._least_ticks = tick - self._began
        self._running, self.goes_on, self._began = None, False, tick
        return super()._learn_from(tick, seen)

    @override
    def _decide(self, observation: Observation) -> Decision:
        if (chosen := self._running) is None:
            chosen = super()._decide(observation)
            if chosen.index is None:
                return chosen
            self._running, self.goes_on = chosen, True
            self._skills.begin(chosen.action, observation)
        displacement_m, spatial = self._skills.step(observation)
        return replace(chosen, action=Action(chosen.action.name, displacement_m, spatial))
