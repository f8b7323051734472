"""The agent: what policy and perception are given, when, and with which effort."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from palpate.core.errors import LifecycleError
from palpate.core.perception import LastSymbols, Perception, SelectedChannels, Thresholds
from palpate.core.policy import ActionOutcome, Reinforcement, Transition, compass_actions
from palpate.core.tasks.insertion.agent import Agent
from tests.unit.core.policy.bench import Diary

TICK_S = 0.01
NONE = (0.0, 0.0, 0.0)
ACTIONS = compass_actions(1e-3)
PAST = LastSymbols(("x-", "x0", "x+"), 3)
"""The state is what was felt since the trial began."""


@dataclass
class Meter(Reinforcement):
    """Writes down the outcome of each action; each costs one more than the one before."""

    outcomes: list[ActionOutcome] = field(default_factory=list)

    def __call__(self, outcome):
        self.outcomes.append(outcome)
        return -float(len(self.outcomes))


def diary(indices=(0, 1, 2, 3, 4)):
    return Diary(indices, ACTIONS, temperature=2.5)


class Bench:
    def __init__(self, policy=None, reinforcement=None):
        self.policy, self.meter = policy or diary(), Meter()
        perception = Perception(SelectedChannels(("x",)), Thresholds(("x",), ((-1e-3, 1e-3),)), PAST)
        self.agent = Agent(perception, self.policy, reinforcement or self.meter, TICK_S)
        self.begin()

    def begin(self, trial=0):
        self.rng = np.random.default_rng(trial)
        self.agent.begin(trial, self.rng)

    def decide(self, x_m=0.0, tick=0):
        self.agent.perceive(tick, (x_m, 0.0, 0.0), NONE, NONE, NONE, NONE, 0.0)
        return self.agent.choose()

    def record_effort(self, *forces_N):
        self.agent.effort_N.extend(forces_N)

    @property
    def entries(self):
        return self.policy.entries


def test_transitions_follow_the_states_and_come_before_the_next_choice():
    bench = Bench()
    for x in (-2e-3, 0.0, 2e-3):
        bench.decide(x)
        bench.record_effort(1.0)
    bench.agent.reached_goal()
    kinds = [type(entry).__name__ for entry in bench.entries]
    assert kinds == ["tuple", "Observation", *["Transition", "Observation"] * 2, "Transition"]
    one, two, three = (PAST.states.index(name) for name in ("x-", "x- > x0", "x- > x0 > x+"))
    assert bench.policy.learned == [
        Transition(one, 0, -1.0, two),
        Transition(two, 1, -2.0, three),
        Transition(three, 2, -3.0, None),
    ]


def test_nothing_is_learned_from_an_action_that_is_not_of_the_set():
    bench = Bench(diary((0, None, 2)))
    for _ in range(3):
        bench.decide()
        bench.record_effort(1.0)
    bench.agent.reached_goal()
    one, two, three = (PAST.states.index(name) for name in ("x0", "x0 > x0", "x0 > x0 > x0"))
    assert bench.policy.learned == [Transition(one, 0, -1.0, two), Transition(three, 2, -3.0, None)]
    # It still cost something.
    assert [d.reinforcement for d in bench.agent.decisions] == [-1.0, -2.0, -3.0]


def test_nothing_is_chosen_twice_on_one_perception():
    bench = Bench()
    assert bench.agent.percept is None
    with pytest.raises(LifecycleError, match="call perceive"):
        bench.agent.choose()
    bench.decide(2e-3)
    with pytest.raises(LifecycleError, match="call perceive"):
        bench.agent.choose()
    bench.begin(1)
    assert bench.agent.percept is None
