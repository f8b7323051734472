"""Q-learning on options: an action goes on until the state changes, and what quarter turns make equal is learned once.

Where one state is felt over several millimetres, for a learner of single steps an action leads from a state to the same
state and cannot tell it from one that leads nowhere. An option (Sutton, Precup and Singh, 1999) ends where something
new is felt, so it has the value of what is found there. A round hole looks alike from all sides: what was learned of
one state holds for those that are quarter turns of it, with the actions turned, too.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import dist
from typing import Annotated, Final

import numpy as np

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, Decision, Hindsight, Observation, Transition
from palpate.core.policy.tabular import QLearning, QParameters
from palpate.core.ports import Range

_TURNED: Final = {"-": "+", "0": "0", "+": "-"}
_SAME_M: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class OptionParameters(QParameters):
    """Settings of the learner; those of :class:`~palpate.core.policy.tabular.QParameters` and two more."""

    keep_steps: Annotated[int, Range(1, 1000)] = 1
    """An action goes on while the state stays the same, for so many steps at most; 1 chooses anew at each."""
    share_turns: bool = False
    """States that are quarter turns of each other share what is learned."""


class OptionLearning(QLearning):
    """Learns ``Q(i, a) <- (1 - alpha) Q(i, a) + alpha (r + gamma^n V(j))`` of actions that go on for n steps.

    ``r`` is what all of them earned, discounted. An option that the trial's end cuts off is learned from as far as it
    came.

    Raises:
        ConfigurationError: A value is out of its range, names repeat, or states are to be shared over quarter turns
            that have none.
    """

    parameters: OptionParameters
    _kept: int | None = None  # the action that goes on

    def __init__(
        self, states: Sequence[str], actions: Sequence[Action], parameters: OptionParameters, *, frozen: bool = False
    ) -> None:
        super().__init__(states, actions, parameters, frozen=frozen)
        self._turns = quarter_turns(self.states, self.actions) if parameters.share_turns else []

    def _clear(self) -> None:
        self._kept, self._steps = None, 0
        self._earned, self._discount = 0.0, 1.0
        self._open: Transition | None = None

    def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
        """As for every tabular learner; no option is under way."""
        super().begin_trial(trial, rng)
        self._clear()

    def choose(self, observation: Observation) -> Decision:
        """The action that goes on, or one drawn by Boltzmann exploration: one random number an option.

        Raises:
            LifecycleError: No trial has begun.
        """
        # Where the state has changed, or the steps are used up, what was learned has ended it.
        index = self._kept = self._drawn(observation.state) if self._kept is None else self._kept
        self._steps += 1
        return self._decision(index)

    def learn(self, transition: Transition) -> None:
        """Update the Q of an option that is over, and of its quarter turns, unless frozen."""
        self._earned += self._discount * transition.reinforcement
        self._discount *= self.parameters.gamma
        self._open = transition
        limit = self._kept is None or self._steps >= self.parameters.keep_steps
        if limit or transition.next_state != transition.state:
            self._close()

    def end_trial(self, hindsight: Hindsight) -> None:
        """Learn from the option that the trial's end cut off."""
        self._close()

    def _close(self) -> None:
        transition, earned, discount = self._open, self._earned, self._discount
        self._clear()
        if transition is None or self.frozen:
            return
        state, action = transition.state, transition.action_index
        alpha = self.parameters.learning_rate(self._visits[state][action])
        target = earned + discount * self._value_after(transition)
        value = (1.0 - alpha) * self._q[state][action] + alpha * target
        self._count(state, action)
        visits = self._visits[state][action]
        for states, actions in [(range(len(self.states)), range(len(self.actions))), *self._turns]:
            self._q[states[state]][actions[action]] = value
            self._visits[states[state]][actions[action]] = visits


def quarter_turns(states: Sequence[str], actions: Sequence[Action]) -> list[tuple[list[int], list[int]]]:
    """For one, two and three quarter turns: which state each becomes, and which action.

    Raises:
        ConfigurationError: A state or an action has none among the others.
    """
    turn = [_turned_state(name, states) for name in states], [_turned_action(action, actions) for action in actions]
    found = [turn]
    for _ in range(2):
        found.append(([turn[0][k] for k in found[-1][0]], [turn[1][k] for k in found[-1][1]]))
    return found


def _turned_state(name: str, states: Sequence[str]) -> int:
    signs = re.fullmatch(r"(t?)x([-0+]) \1y([-0+])", name)
    turned = "" if signs is None else f"{signs[1]}x{_TURNED[signs[3]]} {signs[1]}y{signs[2]}"
    if turned not in states:
        accepted = "false, unless each state is a region of x and y, or of tx and ty, and so are its quarter turns"
        raise ConfigurationError("policy.share_turns", name, accepted)
    return states.index(turned)


def _turned_action(action: Action, actions: Sequence[Action]) -> int:
    x, y = action.displacement_m
    for number, other in enumerate(actions):
        if dist(other.displacement_m, (-y, x)) < _SAME_M:
            return number
    raise ConfigurationError("policy.share_turns", action.name, "false, unless the actions' quarter turns are actions")
