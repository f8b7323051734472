import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Observation, Transition, compass_actions
from palpate.core.policy.examples import ExamplesPolicy
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.file import PolicyDocument, document_of, learner_of, policy_from
from palpate.core.policy.programmed import MixedPolicy, ProgrammedPolicy, RandomWalkPolicy
from palpate.core.policy.sarsa import Sarsa, SarsaParameters
from palpate.core.policy.tabular import QLearning, QParameters

ACTIONS = compass_actions(0.0007)
STATES = ("a", "b", "c", "d")
ZERO = (0.0, 0.0, 0.0)


def learner(trials: int = 30, states=STATES, **settings) -> QLearning:
    """One that has wandered about."""
    parameters = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(5.0, 0.9, 0.5), **settings)
    q = QLearning(states, ACTIONS, parameters)
    wander(q, range(trials), seed=1)
    return q


def wander(policy, trials, seed) -> list[int]:
    """Let a policy act in a made-up world; its choices."""
    rng, choices = np.random.default_rng(seed), []
    for trial in trials:
        policy.begin_trial(trial, rng)
        state = int(rng.integers(4))
        for _ in range(20):
            index = policy.choose(Observation(state, ZERO, ZERO, ZERO, ZERO, 0)).index
            choices.append(index)
            after = (state * 3 + index) % 5
            policy.learn(Transition(state, index, -1.0 - 0.01 * state, after if after < 4 else None))
            if after == 4:
                break
            state = after
    return choices


def through_file(policy) -> PolicyDocument:
    made = document_of(policy, created_with={"palpate": "0"}, perception={})
    return PolicyDocument.from_json_text(made.to_json_text())


def mixture(q: QLearning) -> MixedPolicy:
    programmed = ProgrammedPolicy(STATES, ACTIONS, {"b": "-x-y"})
    return MixedPolicy(STATES, [programmed, ExamplesPolicy(STATES, ACTIONS, [("c", "+y"), ("b", "+x")]), q])


def test_what_was_learned_comes_back_to_the_bit():
    q = learner(alpha_visits=15.0, alpha_floor=0.05, initial_value=-0.0)
    back = policy_from(through_file(q), STATES, ACTIONS, frozen=False)
    assert isinstance(back, QLearning)
    assert [v.hex() for row in back.q for v in row] == [v.hex() for row in q.q for v in row]
    assert (back.visits, back.trials_learned, back.parameters) == (q.visits, q.trials_learned, q.parameters)
    assert back.actions == ACTIONS


def sarsa(trials: int = 30) -> Sarsa:
    """One that has wandered about."""
    schedule = TemperatureSchedule(5.0, 0.9, 0.5)
    learned = Sarsa(STATES, ACTIONS, SarsaParameters(alpha=0.2, gamma=1.0, temperature=schedule, trace_decay=0.7))
    wander(learned, range(trials), seed=1)
    return learned


@pytest.mark.parametrize("made", [learner, sarsa, lambda: mixture(learner())], ids=["q-learning", "sarsa", "mixed"])
def test_learning_resumes_as_if_it_had_never_stopped(made):
    policy = made()
    resumed = policy_from(through_file(policy), STATES, ACTIONS, frozen=False)
    one, other = learner_of(policy), learner_of(resumed)
    assert (type(other), other.visits, other.parameters) == (type(one), one.visits, one.parameters)
    assert wander(policy, range(30, 50), seed=2) == wander(resumed, range(30, 50), seed=2)
    assert one.q == other.q
    assert other.trials_learned == 50


def test_rows_say_which_knowledge_decides_and_what_was_learned_there():
    q = learner()
    document = through_file(mixture(q))
    assert [row.source for row in document.table] == ["learned", "programmed", "examples", "learned"]
    assert [row.action for row in document.table][1:3] == ["-x-y", "+y"]
    for state, row in enumerate(document.table):
        assert row.q == q.q[state]
        assert row.visits == sum(q.visits[state]) > 0
    assert document.table[0].value == max(q.q[0])
    assert document.table[1].value == q.q[1][5]
    assert document_of(policy_from(document, STATES, ACTIONS), created_with={"palpate": "0"}, perception={}) == document


@pytest.mark.parametrize("kind", [ProgrammedPolicy, ExamplesPolicy])
def test_fixed_knowledge_comes_back_as_its_own_kind(kind):
    pairs = {"a": "+x", "b": "-x", "c": "-x", "d": "+x-y"}
    policy = kind(STATES, ACTIONS, pairs if kind is ProgrammedPolicy else pairs.items())
    document = through_file(policy)
    assert document.learner is None
    assert learner_of(policy) is None
    back = policy_from(document, STATES, ACTIONS)
    assert type(back) is kind
    assert [back.assigned(s) for s in range(4)] == [policy.assigned(s) for s in range(4)] == [0, 4, 4, 7]


@pytest.mark.parametrize(
    ("policy", "says"),
    [
        (RandomWalkPolicy(ACTIONS), "RandomWalkPolicy"),
        (MixedPolicy(STATES, [mixture(learner(1))]), "MixedPolicy"),
        (MixedPolicy(STATES, [learner(1), learner(1)]), "several learners"),
        (MixedPolicy(STATES, [learner(1), ProgrammedPolicy(("a",), ACTIONS, {})]), "parts that differ"),
        (ProgrammedPolicy(STATES, ACTIONS, {"a": "+x"}), "no action for 'b'"),
    ],
)
def test_what_no_file_can_express_is_refused(policy, says):
    with pytest.raises(ConfigurationError, match=says):
        document_of(policy, created_with={}, perception={})


def test_a_policy_before_it_learned_is_the_same_whatever_it_learned_since():
    q = learner(5, initial_value=-0.5)
    document = document_of(mixture(q), created_with={}, perception={})
    fresh = document.unlearned()
    assert fresh.learner.trials_learned == 0
    assert {value for row in fresh.table for value in row.q} == {-0.5}
    assert {count for row in fresh.table for count in row.visits_per_action} == {0}
    # What was programmed or came from examples stays.
    assert [row.source for row in fresh.table] == [row.source for row in document.table]
    assert fresh == fresh.unlearned() == PolicyDocument.from_json_text(fresh.to_json_text())
    wander(q, range(5, 20), seed=2)
    assert document_of(mixture(q), created_with={}, perception={}).unlearned() == fresh
    programmed = ProgrammedPolicy(STATES, ACTIONS, dict.fromkeys(STATES, "+x"))
    only = document_of(programmed, created_with={}, perception={})
    assert only.unlearned() == only
