import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, Decision, Observation, Policy, Transition, compass_actions
from palpate.core.policy.examples import ExamplesPolicy
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.programmed import MixedPolicy, ProgrammedPolicy, RandomWalkPolicy
from palpate.core.policy.tabular import QLearning, QParameters

TWO = compass_actions(0.001, 2)
RIGHT, LEFT = (action.name for action in TWO)
STATES = ("a", "b", "c")
ZERO = (0.0, 0.0, 0.0)


def observation(state: int) -> Observation:
    return Observation(state, ZERO, ZERO, ZERO, ZERO, 0)


def learner(states=STATES, **settings) -> QLearning:
    plain = {"alpha": 1.0, "gamma": 1.0, "temperature": TemperatureSchedule(2.0, 0.5, 0.5)}
    return QLearning(states, TWO, QParameters(**plain | settings))


class Spy(Policy):
    """Takes a step outside the action set, in some states, and remembers what it is told."""

    def __init__(self, states: set[int]) -> None:
        self.states, self.begun, self.told = states, [], []

    @property
    def temperature(self) -> float | None:
        return None

    def serves(self, state: int) -> bool:
        return state in self.states

    def begin_trial(self, trial, rng) -> None:
        self.begun.append((trial, rng))

    def choose(self, observation) -> Decision:
        return Decision(Action("aside", (1.0, 1.0)), None, "spy")

    def learn(self, transition) -> None:
        self.told.append(transition)


def test_in_each_state_the_first_part_that_serves_it_decides():
    programmed = ProgrammedPolicy(STATES, TWO, {"a": LEFT})
    examples = ExamplesPolicy(STATES, TWO, [("a", RIGHT), ("b", RIGHT)])
    policy = MixedPolicy(STATES, [programmed, examples, learner()])
    policy.begin_trial(0, np.random.default_rng(0))
    decisions = [policy.choose(observation(state)) for state in range(3)]
    assert [decision.source for decision in decisions] == ["programmed", "examples", "learned"]
    assert [decision.index for decision in decisions[:2]] == [1, 0]
    assert policy.part_for(1) is examples


def test_trials_and_transitions_reach_every_part():
    spies = Spy({0}), Spy({1, 2})
    policy = MixedPolicy(STATES, spies)
    rng = np.random.default_rng(0)
    policy.begin_trial(4, rng)
    policy.learn(Transition(0, 1, -1.0, 2))
    for spy in spies:
        assert spy.begun == [(4, rng)]
        assert spy.told == [Transition(0, 1, -1.0, 2)]


def test_the_learner_hears_of_programmed_states_and_values_them_by_the_programmed_action():
    """The untried action of b keeps Q = 0; b must be worth -4 all the same, not as much as the goal."""
    q = learner()
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"b": RIGHT}), q])
    policy.learn(Transition(1, 0, -4.0, None))
    policy.learn(Transition(0, 0, -1.0, 1))
    assert q.q == ((-5.0, 0.0), (-4.0, 0.0), (0.0, 0.0))


def test_where_the_learner_decides_itself_the_best_action_counts():
    q = learner()
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"b": RIGHT}), q])
    policy.learn(Transition(2, 0, -4.0, None))
    policy.learn(Transition(0, 0, -1.0, 2))
    policy.learn(Transition(0, 1, -1.0, None))
    assert q.q[0] == (-1.0, -1.0)


def test_a_learner_beside_a_program_finds_the_values_of_the_mixture():
    """From a, right leads to b, whose program leads back to a; left leads to c, and right from c is the goal.

    Were b worth the best of its actions, the one that is never tried would make it look like the goal.
    """
    q = learner(alpha=0.5, temperature=TemperatureSchedule(5.0, 0.99, 0.5))
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"b": LEFT}), q])
    world = {(0, 0): 1, (0, 1): 2, (1, 1): 0, (2, 0): None, (2, 1): 0}
    rng = np.random.default_rng(1)
    for trial in range(600):
        policy.begin_trial(trial, rng)
        state = 0
        while state is not None:
            index = policy.choose(observation(state)).index
            after = world[state, index]
            policy.learn(Transition(state, index, -1.0, after))
            state = after
    assert q.q[0] == pytest.approx((-4.0, -2.0), abs=1e-6)
    assert q.q[1] == pytest.approx((0.0, -3.0), abs=1e-6)
    assert q.q[2] == pytest.approx((-1.0, -3.0), abs=1e-6)


def test_temperature_is_that_of_the_part_that_has_one():
    parts = [ProgrammedPolicy(STATES, TWO, {"a": LEFT}), learner()]
    policy = MixedPolicy(STATES, parts)
    policy.begin_trial(1, np.random.default_rng(0))
    assert policy.temperature == 1.0
    assert MixedPolicy(STATES, [parts[0], RandomWalkPolicy(TWO)]).temperature is None


def test_states_that_nobody_serves_are_named():
    with pytest.raises(ConfigurationError) as refused:
        MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"b": LEFT})])
    assert (refused.value.field, refused.value.value) == ("policy.mixed", "a, c")


def test_a_part_that_no_longer_serves_its_state_is_noticed():
    spy = Spy({0, 1, 2})
    policy = MixedPolicy(STATES, [spy])
    spy.states = {0}
    assert [policy.serves(state) for state in range(3)] == [True, False, False]
    with pytest.raises(ConfigurationError, match="'b'"):
        policy.choose(observation(1))
