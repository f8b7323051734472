"""Programmed knowledge: actions that a person has specified for states (paper, section 3.5)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import (
    PROGRAMMED,
    Action,
    Decision,
    EpisodeOutcome,
    FixedPolicy,
    Observation,
    Policy,
    Transition,
    check_names,
    drawing_from,
)


class AssignedPolicy(FixedPolicy):
    """Policy that always takes the assigned action, and handles only states that have one.

    Args:
        assigned: Action index for each state, (n states,); None for a state without one.
    """

    def __init__(
        self, states: Sequence[str], actions: Sequence[Action], assigned: Sequence[int | None], source: str
    ) -> None:
        super().__init__()
        check_names(states, actions)
        self.states, self.actions, self.source = tuple(states), tuple(actions), source
        self._assigned = tuple(assigned)

    def assigned(self, state: int) -> int | None:
        """Return the action index for a state, or None if it has none."""
        return self._assigned[state]

    @override
    def serves(self, state: int) -> bool:
        return self._assigned[state] is not None

    def choose(self, observation: Observation) -> Decision:
        """Return the action for the state."""
        index = self._assigned[observation.state]
        if index is None:
            accepted = "an action for every state that occurs, or a learner after it in a mixed policy"
            raise ConfigurationError(f"policy.{self.source}", self.states[observation.state], accepted)
        return Decision(self.actions[index], index, self.source)


def check_known(field: str, state: str, action: str, states: Sequence[str], actions: Sequence[Action]) -> None:
    """Reject an unknown state or action.

    Raises:
        ConfigurationError: The message gives ``field`` and the accepted names.
    """
    if state not in states:
        raise ConfigurationError(field, state, f"a state of this task: {', '.join(states)}")
    names = [known.name for known in actions]
    if action not in names:
        raise ConfigurationError(field, action, f"for state {state!r} an action of: {', '.join(names)}")


class ProgrammedPolicy(AssignedPolicy):
    """Policy that takes the programmed action, and handles only states that have one.

    Raises:
        ConfigurationError: ``policy.programmed`` names an unknown state or action.
    """

    def __init__(self, states: Sequence[str], actions: Sequence[Action], table: Mapping[str, str]) -> None:
        for state, action in table.items():
            check_known("policy.programmed", state, action, states, actions)
        index = {action.name: number for number, action in enumerate(actions)}
        assigned = [index[table[state]] if state in table else None for state in states]
        super().__init__(states, actions, assigned, PROGRAMMED)


class RandomWalkPolicy(FixedPolicy):
    """Policy that draws each action uniformly, with exactly one random number per choice.

    Raises:
        ConfigurationError: The action set is empty.
    """

    def __init__(self, actions: Sequence[Action]) -> None:
        super().__init__()
        if not actions:
            raise ConfigurationError("policy.actions", tuple(actions), "at least one action")
        self.actions = tuple(actions)

    def choose(self, observation: Observation) -> Decision:
        """Draw an action."""
        index = int(drawing_from(self._rng, "random walk").random() * len(self.actions))
        return Decision(self.actions[index], index, "random")


class MixedPolicy(Policy):
    """Policy that delegates each choice to the first part that handles the state.

    Every part receives every transition, regardless of which part chose the action. Q-learning is off-policy, and a
    learner needs the values of states in which others act to judge the actions that lead there. In those states, it
    must not use the best of all actions: untried actions would keep their initial value of 0, and the state would look
    as good as the goal. Therefore the transition's ``next_action_index`` names the action if the next state belongs to
    a part with a fixed action.

    Args:
        parts: Policies over these states and one action set, in order of priority.

    Raises:
        ConfigurationError: No part handles one of the states.
    """

    def __init__(self, states: Sequence[str], parts: Sequence[Policy]) -> None:
        self.states, self.parts = tuple(states), tuple(parts)
        orphans = [name for state, name in enumerate(self.states) if not any(p.serves(state) for p in self.parts)]
        if orphans:
            accepted = "a part that serves each state: add entries, or a learner as the last part"
            raise ConfigurationError("policy.mixed", ", ".join(orphans), accepted)

    @property
    def temperature(self) -> float | None:
        """Return the temperature of the first part that has one."""
        return next((part.temperature for part in self.parts if part.temperature is not None), None)

    def part_for(self, state: int) -> Policy:
        """Return the part that acts in a state.

        Raises:
            ConfigurationError: No part handles this state.
        """
        for part in self.parts:
            if part.serves(state):
                return part
        raise ConfigurationError("policy.mixed", self.states[state], "a part that serves this state")

    def serves(self, state: int) -> bool:
        """Return True if a part handles this state."""
        return any(part.serves(state) for part in self.parts)

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """Begin the trial in every part; all parts share ``rng``."""
        for part in self.parts:
            part.begin_trial(trial, rng)

    @override
    def end_trial(self, episode: EpisodeOutcome) -> None:
        for part in self.parts:
            part.end_trial(episode)

    def choose(self, observation: Observation) -> Decision:
        """Return the choice made by the part that handles this state."""
        return self.part_for(observation.state).choose(observation)

    def learn(self, transition: Transition) -> None:
        """Pass the transition to every part."""
        if transition.next_state is not None:
            owner = self.part_for(transition.next_state)
            if isinstance(owner, AssignedPolicy):
                transition = replace(transition, next_action_index=owner.assigned(transition.next_state))
        for part in self.parts:
            part.learn(transition)
