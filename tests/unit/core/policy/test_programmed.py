import numpy as np
import pytest
from scipy.stats import chisquare

from palpate.core.errors import ConfigurationError, LifecycleError
from palpate.core.policy.base import Decision, Hindsight, Transition
from palpate.core.policy.examples import ExamplesPolicy
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.programmed import AssignedPolicy, MixedPolicy, ProgrammedPolicy, RandomWalkPolicy, check_known
from palpate.core.policy.tabular import QLearning, QParameters
from tests.unit.core.policy.bench import EIGHT, LEFT, RIGHT, TWO, Diary, observation, refuse

STATES = ("a", "b", "c")


# One action a state.


def test_the_assigned_action_is_taken_with_its_source_and_nothing_is_drawn_or_learned():
    policy = AssignedPolicy(("a", "b"), EIGHT, (6, None), "examples")
    rng = np.random.default_rng(0)
    before = rng.bit_generator.state
    policy.begin_trial(0, rng)
    for reinforcement in (-1.0, -100.0):
        assert policy.choose(observation(0)) == Decision(EIGHT[6], 6, "examples")
        policy.learn(Transition(0, 6, reinforcement, 0))
    assert rng.bit_generator.state == before
    assert policy.temperature is None


def test_only_the_states_that_have_an_action_are_served():
    policy = AssignedPolicy(("a", "b"), EIGHT, (0, None), "programmed")
    assert [policy.serves(0), policy.serves(1)] == [True, False]
    assert [policy.assigned(0), policy.assigned(1)] == [0, None]
    with pytest.raises(ConfigurationError, match=r"policy\.programmed = 'b' is refused.*mixed policy"):
        policy.choose(observation(1))


def test_unknown_names_are_refused_with_all_that_is_accepted():
    with pytest.raises(ConfigurationError, match=r"here = 'c' is refused: a state of this task: a, b"):
        check_known("here", "c", "+x", ("a", "b"), EIGHT)
    with pytest.raises(ConfigurationError, match=r"here = 'up' is refused: .*'a'.*\+x, \+x\+y, \+y"):
        check_known("here", "a", "up", ("a", "b"), EIGHT)
    check_known("here", "a", "+x", ("a", "b"), EIGHT)


# Random walks.


def test_every_action_is_as_likely_and_costs_one_number():
    policy, rng, twin = RandomWalkPolicy(EIGHT), np.random.default_rng(4), np.random.default_rng(4)
    policy.begin_trial(0, rng)
    decisions = [policy.choose(observation(3)) for _ in range(8000)]
    twin.random(8000)
    assert rng.bit_generator.state == twin.bit_generator.state
    assert chisquare(np.bincount([d.index for d in decisions], minlength=8)).pvalue > 0.01
    assert all(d == Decision(EIGHT[d.index], d.index, "random") for d in decisions)


def test_a_random_walk_needs_actions_and_a_trial():
    refuse("policy.actions", RandomWalkPolicy, ())
    with pytest.raises(LifecycleError):
        RandomWalkPolicy(EIGHT).choose(observation(3))


# Mixtures.


def learner(**settings) -> QLearning:
    plain = {"alpha": 1.0, "gamma": 1.0, "temperature": TemperatureSchedule(2.0, 0.5, 0.5)}
    return QLearning(STATES, TWO, QParameters(**plain | settings))


def test_in_each_state_the_first_part_that_serves_it_decides():
    programmed = ProgrammedPolicy(STATES, TWO, {"a": LEFT})
    examples = ExamplesPolicy(STATES, TWO, [("a", RIGHT), ("b", RIGHT)])
    policy = MixedPolicy(STATES, [programmed, examples, learner()])
    policy.begin_trial(0, np.random.default_rng(0))
    decisions = [policy.choose(observation(state)) for state in range(3)]
    assert [decision.source for decision in decisions] == ["programmed", "examples", "learned"]
    assert [decision.index for decision in decisions[:2]] == [1, 0]
    assert policy.part_for(1) is examples


def test_trials_and_transitions_reach_every_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Diary, "end_trial", lambda self, hindsight: self.entries.append(hindsight))
    diaries = Diary(served=(0,)), Diary(served=(1, 2))
    policy = MixedPolicy(STATES, diaries)
    rng, hindsight = np.random.default_rng(0), Hindsight(True, (1e-3, 0.0, 0.0), 0.01)
    policy.begin_trial(4, rng)
    policy.learn(Transition(0, 1, -1.0, 2))
    policy.end_trial(hindsight)
    for diary in diaries:
        assert diary.entries == [("begin", 4, rng), Transition(0, 1, -1.0, 2), hindsight]


def test_a_learner_values_programmed_states_by_the_programmed_action_and_others_by_the_best():
    """The untried action of b keeps Q = 0; b must be worth -4 all the same, not as much as the goal."""
    q = learner()
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"b": RIGHT}), q])
    for state in (1, 2):
        policy.learn(Transition(state, 0, -4.0, None))
    policy.learn(Transition(0, 0, -1.0, 1))
    policy.learn(Transition(0, 1, -1.0, 2))
    assert q.q == ((-5.0, -1.0), (-4.0, 0.0), (-4.0, 0.0))


def test_states_without_a_part_are_named():
    assert refuse("policy.mixed", MixedPolicy, STATES, [ProgrammedPolicy(STATES, TWO, {"b": LEFT})]).value == "a, c"
    diary = Diary()
    policy = MixedPolicy(STATES, [diary])
    diary.served = (0,)  # the others no longer
    assert [policy.serves(state) for state in range(3)] == [True, False, False]
    with pytest.raises(ConfigurationError, match="'b'"):
        policy.choose(observation(1))
