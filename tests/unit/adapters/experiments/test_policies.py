"""Policies by name and from files, and what does not fit together."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.config import overlay
from palpate.adapters.config.compose import scenario
from palpate.adapters.config.run import LearningConfig, PerceptionConfig, RunConfig
from palpate.adapters.experiments import (
    baseline,
    build_perception,
    learning_policy,
    perception_of,
)
from palpate.adapters.experiments.policies import loaded_policy, perception_settings
from palpate.adapters.log.provenance import made_with
from palpate.core.errors import ConfigurationError
from palpate.core.policy import PolicyDocument, Sarsa, document_of, learner_of
from palpate.core.trial.config import TaskConfig
from tests.unit.adapters.samples import observation

DEFAULT = RunConfig()


def document(config=DEFAULT):
    perception = build_perception(config)
    policy = learning_policy(config, perception)
    return document_of(policy, created_with=made_with(), perception=perception_settings(config, perception))


def no_hole():
    raise AssertionError("only the oracle one may ask where the hole is")


@pytest.mark.parametrize(("name", "speed_m_s"), [("spiral-10", 0.010), ("spiral-5", 0.005)])
@pytest.mark.parametrize("ticks", [7, 14])
def test_spirals_have_their_speed_whatever_an_action_lasts(name, speed_m_s, ticks):
    policy = baseline(name, RunConfig(task=TaskConfig(ticks_per_action=ticks)), no_hole)
    x = y = 0.0
    for k in range(200):
        dx, dy = policy.choose(observation(x, y, action_number=k)).action.displacement_m
        x, y = x + dx, y + dy
    # Far out a chord is as long as its arc.
    assert np.hypot(dx, dy) == pytest.approx(speed_m_s * ticks / 140, rel=0.01)


@pytest.mark.parametrize("learner", ["q-learning", "skills"])
def test_the_torque_rule_steps_to_the_nearest_side_where_a_task_has_other_actions_besides(learner):
    config = overlay(scenario("blind-square", learner), {"task": {"name": "insertion-6dof"}})
    policy = baseline("torque", config, no_hole)
    policy.begin_trial(0, np.random.default_rng(0))
    decision = policy.choose(replace(observation(), torque_Nm=(-1.0, 0.0, 0.0)))
    assert (decision.action.name, decision.index) == ("-y", 6)


@pytest.mark.parametrize(("in_use", "temperature"), [(0.1, 0.1), (0.0, 0.0), (0.5, 0.5), (3.0, 0.5)])
def test_a_policy_in_use_is_colder_than_in_training_through_its_file(in_use, temperature):
    config = RunConfig(learning=LearningConfig(temperature_floor=0.5, temperature_in_use=in_use))
    perception = build_perception(DEFAULT)
    policy = learning_policy(config, perception)
    text = document_of(policy, created_with={}, perception={}).to_json_text()
    assert ('"in_use": null' in text) == (temperature == 0.5)
    # Whatever the run is configured to, the file says it.
    loaded = loaded_policy(PolicyDocument.from_json_text(text), RunConfig(), perception, frozen=True)
    assert loaded.temperature == temperature


def test_a_learner_is_chosen_by_name_and_learns_on_as_what_it_is():
    config = RunConfig(learner="sarsa", learning=LearningConfig(trace_decay=0.4))
    policy, perception = learning_policy(config, build_perception(DEFAULT)), build_perception(DEFAULT)
    assert isinstance(policy, Sarsa)
    assert policy.parameters.trace_decay == 0.4
    file = document_of(policy, created_with={}, perception={})
    assert isinstance(loaded_policy(file, config, perception, frozen=False), Sarsa)
    with pytest.raises(ConfigurationError, match="learner = 'q-learning' is refused: 'sarsa', as in the policy file"):
        loaded_policy(file, DEFAULT, perception, frozen=False)


def test_skills_are_learned_where_they_may_begin_and_only_by_tasks_that_have_some():
    config = overlay(
        scenario("blind-square", "skills"), {"task": {"name": "insertion-6dof", "options": {"corners": 4.0}}}
    )
    learner = learner_of(learning_policy(config, build_perception(config)))
    assert isinstance(learner, Sarsa)
    row = dict(zip((action.name for action in learner.actions), learner.q[0], strict=True))
    assert learner.states[0] == "upright in the air at first"
    ahead = learner.parameters.initial_value
    assert (row["lean 1"], row["lean 1.2"], row["insert"] < -1e5) == (ahead, ahead, True)
    # What the rule takes there is ahead of all else that may begin.
    row = dict(zip(row, learner.q[learner.states.index("corner wedged after push")], strict=True))
    assert (row["drive"], row["push 1"]) == (ahead, ahead - config.learning.rule_lead)
    with pytest.raises(ConfigurationError, match="a task that has skills; insertion has none"):
        build_perception(scenario("blind", "skills"))


def test_programmed_and_example_states_stand_beside_learned_ones(tmp_path):
    examples = tmp_path / "decisions.csv"
    examples.write_text("trial,state,action\n0,x+ y0,-x\n0,x+ y+,-x-y\n")
    learning = LearningConfig(programmed={"x+ y0": "+y"}, examples=str(examples))
    perception = build_perception(DEFAULT)
    policy = learning_policy(RunConfig(learning=learning), perception)
    policy.begin_trial(0, np.random.default_rng(0))

    def source_and_action(state):
        decision = policy.choose(replace(observation(), state=perception.states.index(state)))
        return decision.source, decision.action.name

    assert source_and_action("x+ y0") == ("programmed", "+y")  # a person's word counts more than an example
    assert source_and_action("x+ y+") == ("examples", "-x-y")
    assert source_and_action("x- y-")[0] == "learned"
    assert learner_of(policy) is not None


@pytest.mark.parametrize(
    ("perception", "difference"),
    [
        (PerceptionConfig(symbols="grid"), "states"),
        (PerceptionConfig(position_threshold_mm=1.5), "outer.thresholds = [[-0.0015, 0.0015]"),
        (PerceptionConfig(cutoff_Hz=2.0), "policy.perception.signal.cutoff_Hz"),
        (PerceptionConfig(torque_threshold_kgf_mm=0.8), "inner.thresholds = [[-0.0078"),
    ],
)
def test_a_file_of_another_perception_is_refused(perception, difference):
    with pytest.raises(ConfigurationError) as caught:
        perception_of(document(RunConfig(perception=perception)), DEFAULT, build_perception(DEFAULT))
    assert difference in str(caught.value)
