"""The task's learning component, which perceives a state, chooses an action and learns from the result."""

from math import fsum

import numpy as np

from palpate.core.errors import LifecycleError
from palpate.core.perception import Perception
from palpate.core.policy import ActionOutcome, Decision, EpisodeOutcome, Observation, Policy, Reinforcement, Transition
from palpate.core.ports import Vector3
from palpate.core.trial import DecisionRecord


class Agent:
    """Agent that combines perception, policy and reinforcement.

    Attributes:
        percept: Indices of the latest perceived symbol and state in this trial; None before the first.
        effort_N: Force norm at each tick of the current action, appended by the phase that runs the action.
        goes_on: True if an earlier choice continues, so that the policy is not consulted.
    """

    def __init__(self, perception: Perception, policy: Policy, reinforcement: Reinforcement, tick_s: float) -> None:
        self._perception, self._policy = perception, policy
        self._reinforcement, self._tick_s = reinforcement, tick_s
        self._pending: tuple[int, Decision] | None
        self._requested: tuple[int, Observation] | None
        self.effort_N: list[float] = []
        self._least_ticks: int
        # Values that the task appends to the nine channels.
        self._of_the_task: tuple[float, ...] = ()
        self.goes_on = False
        self.percept: tuple[int, int] | None
        self.decisions: list[DecisionRecord]

    def begin(self, trial: int, rng: np.random.Generator) -> None:
        """Start a trial; ``rng`` is the policy's random number generator."""
        self._perception.reset()
        self._policy.begin_trial(trial, rng)
        self._pending = self._requested = self.percept = None
        self.decisions = []

    @property
    def temperature(self) -> float | None:
        """Return the policy's exploration temperature, or None."""
        return self._policy.temperature

    def perceive(
        self,
        tick: int,
        position_m: Vector3,
        reference_m: Vector3,
        force_N: Vector3,
        torque_Nm: Vector3,
        turn_rad: Vector3,
        depth_m: float,
        press_N: float = 0.0,
        limit_N: float = 0.0,
    ) -> Observation:
        """Learn from the completed action, and return the observation for the next :meth:`choose`."""
        number = len(self.decisions)
        rest = position_m, reference_m, force_N, torque_Nm, number, turn_rad, depth_m, press_N, limit_N
        seen = Observation(0 if self.percept is None else self.percept[1], *rest)
        reached = self._learn_from(tick, seen)
        observation = seen if reached == seen.state else Observation(reached, *rest)
        self._requested = (tick, observation)
        return observation

    def _learn_from(self, tick: int, seen: Observation) -> int:
        """Learn from the previous action, and return the resulting state."""
        state = self._observe(seen.position_m, seen.force_N, seen.torque_Nm)
        self._settle(next_state=state)
        return state

    def choose(self) -> Decision:
        """Choose the next action from the latest observation.

        Raises:
            LifecycleError: Nothing was perceived since the last choice.
        """
        if self._requested is None or self.percept is None:
            raise LifecycleError("agent", "nothing new was perceived", "choose()", "call perceive() first")
        (tick, observation), (symbol, state) = self._requested, self.percept
        self._requested = None
        goes_on, decision = self.goes_on, self._decide(observation)
        spatial = decision.action.spatial
        wrench = *observation.force_N, *observation.torque_Nm
        features = self._perception.extractor.extract((*observation.position_m, *wrench, *self._of_the_task))
        if not goes_on:
            self._pending = (state, decision)
            self.effort_N.clear()
            self._least_ticks = 1
        self.decisions.append(
            DecisionRecord(
                tick,
                self._perception.symbols[symbol],
                self._perception.states[state],
                decision.action.name,
                decision.source,
                displacement_m=decision.action.displacement_m,
                index=decision.index,
                grounds=(*wrench, *features, *decision.grounds),
                controller="" if spatial is None else spatial.controller.value,
                spatial=() if spatial is None else spatial.numbers,
            )
        )
        return decision

    def _decide(self, observation: Observation) -> Decision:
        return self._policy.choose(observation)

    def reached_goal(self) -> None:
        """Record that the current action reached the hole."""
        self._settle(next_state=None)

    def gave_up(self, position_m: Vector3, force_N: Vector3, torque_Nm: Vector3) -> None:
        """Record that the trial ended without reaching the goal; its last action leads to the current state."""
        if self._pending is not None:
            self._settle(next_state=self._observe(position_m, force_N, torque_Nm))

    def end(self, episode: EpisodeOutcome) -> None:
        """Pass the trial's outcome to the policy."""
        self._policy.end_trial(episode)

    def _observe(self, position_m: Vector3, force_N: Vector3, torque_Nm: Vector3) -> int:
        done = None if self._pending is None else self._pending[1].action.name
        self.percept = self._perception.observe((*position_m, *force_N, *torque_Nm, *self._of_the_task), done)
        return self.percept[1]

    def _settle(self, next_state: int | None) -> None:
        if self._pending is None:
            return
        state, decision = self._pending
        self._pending = None
        self.decisions[-1].reinforcement = reward = self._reinforcement(self._outcome())
        if decision.index is not None:
            self._policy.learn(Transition(state, decision.index, reward, next_state))

    def _outcome(self) -> ActionOutcome:
        ticks = max(len(self.effort_N), self._least_ticks)
        # Unlike sum(), this rounds the same in all versions of Python.
        return ActionOutcome(ticks * self._tick_s, fsum(self.effort_N) / ticks)
