"""Action sets, observations of a state, policies that note or count, and a corridor to learn in."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, Decision, Observation, Policy, Transition, compass_actions
from palpate.core.policy.exploration import TemperatureSchedule

TWO = compass_actions(0.001, 2)
RIGHT, LEFT = (action.name for action in TWO)
EIGHT = compass_actions(0.001)
GREEDY = TemperatureSchedule(0.0, 1.0, 0.0)
CELLS = tuple(f"cell {n}" for n in range(5))
OWN = Action("own", (1e-3, 0.0))


def observation(state):
    zero = (0.0, 0.0, 0.0)
    return Observation(state, zero, zero, zero, zero, 0)


def walk_corridor(learner, trials):
    """Cells 0..4, the goal beyond the right end, a wall at the left: V = -(steps to the goal) without discount."""
    rng, cells = np.random.default_rng(7), len(CELLS)
    for trial in range(trials):
        learner.begin_trial(trial, rng)
        cell = int(rng.integers(cells))
        while cell < cells:
            action = learner.choose(observation(cell)).index
            assert action is not None
            after = cell + 1 if action == 0 else max(0, cell - 1)
            learner.learn(Transition(cell, action, -1.0, after if after < cells else None))
            cell = after


def refuse(field, make, *args, **settings):
    """The error with which a constructor refuses, naming that field."""
    with pytest.raises(ConfigurationError) as refused:
        make(*args, **settings)
    assert refused.value.field == field
    return refused.value


@dataclass
class Diary(Policy):
    """Notes everything that it is given, in order; takes given actions in turn, None a step of no set."""

    indices: Sequence[int | None] = (0,)
    actions: Sequence[Action] = EIGHT
    entries: list[object] = field(default_factory=list)
    temperature: float | None = None
    served: Collection[int] | None = None

    def serves(self, state):
        return self.served is None or state in self.served

    def begin_trial(self, trial, rng):
        self.entries.append(("begin", trial, rng))

    def choose(self, observation):
        self.entries.append(observation)
        index = self.indices[observation.action_number % len(self.indices)]
        return Decision(Action("far", (1.0, 0.0)) if index is None else self.actions[index], index, "diary")

    def learn(self, transition):
        self.entries.append(transition)

    @property
    def learned(self):
        return [entry for entry in self.entries if isinstance(entry, Transition)]


class Deciding:
    """A third-party policy that derives from nothing: gives one decision, or what a function returns."""

    def __init__(self, gives=None):
        self.gives = Decision(OWN, None, "strange") if gives is None else gives

    def serves(self, state):
        return True

    def begin_trial(self, trial, rng):
        self.rng = rng

    def choose(self, observation):
        return self.gives() if callable(self.gives) else self.gives

    def learn(self, transition):
        pass


class Counting(Deciding):
    """A third-party learner: counts what it learned from, and takes the compass step of that number."""

    def __init__(self):
        super().__init__(self._next)
        self.learned = 0

    def _next(self):
        index = (self.learned + int(self.rng.integers(2))) % 8
        return Decision(compass_actions(0.7e-3)[index], index, "counting")

    def learn(self, transition):
        self.learned += 1

    def get_state(self):
        return {"learned": self.learned}

    def set_state(self, state):
        self.learned = int(state["learned"])
