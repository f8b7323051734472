"""A belief, or a model of hidden states, in a policy file."""

import json

import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy import (
    Hindsight,
    HmmLearner,
    HmmParameters,
    MixedPolicy,
    PolicyDocument,
    ProgrammedPolicy,
    Transition,
    document_of,
    learner_of,
    policy_from,
)
from palpate.core.policy.belief import BeliefLearner, BeliefParameters
from palpate.core.policy.learner import Reach
from tests.unit.core.policy.bench import LEFT, TWO, observation

STATES = ("a", "b")
REACH = Reach(1e-3, 0.05)


def learned() -> tuple[MixedPolicy, BeliefLearner]:
    """A belief that has learned two trials, behind a programmed state."""
    learner = BeliefLearner(BeliefParameters(patience=7), REACH.half_width_m, REACH.action_s, frozen=False)
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"a": LEFT}), learner])
    for trial in range(2):
        policy.begin_trial(trial, np.random.default_rng(trial))
        for _ in range(4):
            policy.choose(observation(1))
        policy.end_trial(Hindsight(True, (2e-4, -3e-4, 0.01), 0.01))
    return policy, learner


def written() -> PolicyDocument:
    return document_of(learned()[0], created_with={}, perception={})


def test_a_belief_goes_on_from_its_file_with_what_is_programmed_beside_it() -> None:
    policy, learner = learned()
    text = document_of(policy, created_with={}, perception={}).to_json_text()
    read = PolicyDocument.from_json_text(text)
    assert read.to_json_text() == text
    assert [(row.state, row.action) for row in read.table] == [("a", LEFT)]
    assert read.learner is not None
    assert read.learner.state == learner.get_state()
    again = policy_from(read, STATES, TWO, REACH, frozen=False)
    assert isinstance(again, MixedPolicy)
    for one in (policy, again):
        one.begin_trial(2, np.random.default_rng(2))
    assert [again.choose(observation(k)) for k in (0, 1)] == [policy.choose(observation(k)) for k in (0, 1)]
    (_, resumed) = again.parts
    assert isinstance(resumed, BeliefLearner)
    assert resumed.parameters.patience == 7


def test_a_model_of_hidden_states_goes_on_from_its_file() -> None:
    parameters = HmmParameters(reach=3)
    learner = HmmLearner(STATES, TWO, parameters)
    policy = MixedPolicy(STATES, [ProgrammedPolicy(STATES, TWO, {"a": LEFT}), learner])
    for trial in range(31):
        policy.begin_trial(trial, np.random.default_rng(trial))
        for state, after in ((1, 0), (0, None)):
            index = policy.choose(observation(state)).index
            policy.learn(Transition(state, 0 if index is None else index, -1.0, after))
        policy.end_trial(Hindsight(True, (0.0, 0.0, 0.01), 0.01))
    made = document_of(policy, created_with={}, perception={})
    read = PolicyDocument.from_json_text(made.to_json_text())
    assert read.to_json_text() == made.to_json_text()
    assert read.learner is not None
    assert read.learner.state == learner.get_state()
    blank = read.unlearned().learner
    assert blank is not None
    assert blank.state == {"trials_learned": 0, "trials": []}
    again = policy_from(read, STATES, TWO, frozen=True)
    again.begin_trial(31, np.random.default_rng(31))
    model = learner_of(again)
    assert isinstance(model, HmmLearner)
    assert model.parameters == parameters
    learner.begin_trial(31, np.random.default_rng(31))
    assert [one.to_dict() for one in model.trials] == [one.to_dict() for one in learner.trials]
    assert model.model is not None
    assert learner.model is not None
    assert model.model.emissions.tolist() == learner.model.emissions.tolist()
    damaged = json.loads(made.to_json_text())
    damaged["learner"]["state"]["trials"][4]["symbols"][0] = 2
    with pytest.raises(ConfigurationError, match=r"trials\[4\].symbols = 2 is refused: numbers from 0 to 1"):
        PolicyDocument.from_json_text(json.dumps(damaged))


def test_a_belief_before_it_learned_has_no_trials_and_no_model() -> None:
    blank, full = written().unlearned().learner, written().learner
    assert blank is not None
    assert full is not None
    assert blank.state == {"trials": [], "trials_learned": 0}
    assert blank.touch_model is None
    assert full.touch_model is not None


def test_a_belief_with_a_damaged_trial_is_refused() -> None:
    made = json.loads(written().to_json_text())
    made["learner"]["state"]["trials"][1]["touches"][0] = [1, 2, 3]
    with pytest.raises(ConfigurationError) as caught:
        PolicyDocument.from_json_text(json.dumps(made))
    assert caught.value.field == "learner.trials[1]"
