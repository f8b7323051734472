"""Policies by name and from files, baselines, and what does not fit together."""

from dataclasses import replace
from math import cos, hypot, pi, radians, sin

import numpy as np
import pinocchio as pin
import pytest

from palpate.adapters.config import compose, overlay, scenario
from palpate.adapters.config.run import LearningConfig, PerceptionConfig, RunConfig
from palpate.adapters.contracts import CONTEXT, PolicyContract
from palpate.adapters.experiments import baseline, build_perception, learning_policy, loaded_policy, perception_of
from palpate.adapters.experiments.baselines import Oracle, OraclePose, Spiral, TorqueFollowing
from palpate.adapters.experiments.policies import perception_settings
from palpate.adapters.log.provenance import made_with
from palpate.core.errors import ConfigurationError
from palpate.core.motion import orientation
from palpate.core.policy import (
    ControllerKind,
    EpisodeOutcome,
    PolicyDocument,
    Sarsa,
    compass_actions,
    document_of,
    learner_of,
)
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


@pytest.mark.parametrize("learner", ["q-learning", "options"])
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
    with pytest.raises(ConfigurationError, match="learner must be 'sarsa', as in the policy file"):
        loaded_policy(file, DEFAULT, perception, frozen=False)


def test_skills_are_learned_where_they_may_begin_and_only_by_tasks_that_have_some():
    config = overlay(
        scenario("blind-square", "options"), {"task": {"name": "insertion-6dof", "options": {"corners": 4.0}}}
    )
    learner = learner_of(learning_policy(config, build_perception(config)))
    assert isinstance(learner, Sarsa)
    row = dict(zip((action.name for action in learner.actions), learner.q[0], strict=True))
    assert learner.states[0] == "upright in the air at first"
    ahead = learner.parameters.initial_value
    assert (row["tilt 1"], row["tilt 1.2"], row["insert"] < -1e5) == (ahead, ahead, True)
    # What the rule takes there is ahead of all else that may begin.
    row = dict(zip(row, learner.q[learner.states.index("corner wedged after push")], strict=True))
    assert (row["drive"], row["push 1"]) == (ahead, ahead - config.learning.optimistic_prior)
    with pytest.raises(ConfigurationError, match="other symbols: the task insertion has no options"):
        build_perception(scenario("blind", "options"))


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
        (PerceptionConfig(position_threshold_mm=1.5), "(got [[-0.0015, 0.0015]"),
        (PerceptionConfig(cutoff_Hz=2.0), "policy.perception.signal.cutoff_Hz"),
        (PerceptionConfig(torque_threshold_kgf_mm=0.8), "(got [[-0.0078"),
    ],
)
def test_a_file_of_another_perception_is_refused(perception, difference):
    with pytest.raises(ConfigurationError) as caught:
        perception_of(document(RunConfig(perception=perception)), DEFAULT, build_perception(DEFAULT))
    assert difference in str(caught.value)


ROUND = scenario("blind", "belief")


@pytest.fixture(scope="module")
def learned():
    """The policy file of a belief after one trial."""
    perception = build_perception(ROUND)
    policy = learning_policy(ROUND, perception)
    policy.begin_trial(0, np.random.default_rng(0))
    for k in range(8):
        policy.choose(observation(2e-4 * k, 0.0))
    policy.end_trial(EpisodeOutcome(True, (1e-3, 0.0, 0.01), 0.01))
    made = document_of(policy, created_with={}, perception=perception_settings(ROUND, perception))
    return PolicyDocument.from_json_text(made.to_json_text())


def load(document, config):
    perception = perception_of(document, config, build_perception(config))
    return loaded_policy(document, config, perception, frozen=True)


def test_a_belief_serves_another_force_limit_with_shorter_steps(learned):
    gentle = compose("blind", "belief", {"limits": {"force_N": 5.0}})
    policy = load(learned, gentle)
    policy.begin_trial(0, np.random.default_rng(0))
    length_m = hypot(*policy.choose(observation()).action.displacement_m)
    assert length_m <= gentle.task.longest_step_m < 0.2e-3
    # Its states matter once a person has programmed one.
    with pytest.raises(ConfigurationError, match="thresholds"):
        load(replace(learned, programmed={learned.states[0]: learned.actions[0].name}), gentle)


@pytest.mark.parametrize(
    ("peg", "message"),
    [
        ({"cross_section": "square"}, "cell.peg.cross_section must be 'round'"),
        ({"diameter_mm": 20.0}, "cell.peg.diameter_mm must be 29.0"),
        ({"chamfer_mm": 1.0}, "cell.peg.chamfer_mm must be 0.0"),
    ],
)
def test_a_touch_model_of_another_peg_is_refused_unless_it_is_asked_for(learned, peg, message):
    other = overlay(ROUND, {"cell": {"peg": peg}})
    with pytest.raises(ConfigurationError) as refused:
        load(learned, other)
    assert str(refused.value).startswith(message)
    assert "--learning.belief.other-tool" in str(refused.value)
    load(learned, overlay(other, {"learning": {"belief": {"other_tool": True}}}))


ACTIONS = compass_actions(0.5e-3)
PITCH_M = 0.36e-3
STEP_M = 0.5e-3


def walk(policy, start_m, steps):
    """Where the tip is commanded to, action by action, (steps + 1, 2)."""
    places = [start_m]
    for k in range(steps):
        dx, dy = policy.choose(observation(*places[-1], action_number=k)).action.displacement_m
        places.append((places[-1][0] + dx, places[-1][1] + dy))
    return np.array(places)


def spiral():
    return Spiral("spiral-5", PITCH_M, STEP_M)


def test_the_oracle_goes_straight_to_the_hole_and_stays():
    hole = np.array([1e-3, -2e-3])
    places = walk(Oracle(lambda: (*hole, 0.0), STEP_M), (-1e-3, 1e-3), 12)
    lengths = np.hypot(*np.diff(places, axis=0).T)
    whole = int(hypot(2e-3, 3e-3) / STEP_M)
    assert lengths[:whole] == pytest.approx(STEP_M)
    assert lengths.sum() == pytest.approx(hypot(2e-3, 3e-3))
    assert places[-1] == pytest.approx(hole)
    off_line = (places - places[0]) @ (3.0, 2.0)  # normal to the line from start to hole
    assert off_line == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("index", range(8))
def test_the_torque_tells_the_heading_of_the_hole(index):
    # Beside the hole the plate supports the far side only. With the hole towards (hx, hy), the force (0, 0, -F)
    # acts at the lever -(hx, hy): torque = lever x force = F (hy, -hx), so the hole is at (-ty, tx).
    hx, hy = ACTIONS[index].displacement_m
    lever, force = np.array([-hx, -hy, 0.0]) * 20.0, np.array([0.0, 0.0, -5.0])
    tx, ty, tz = np.cross(lever, force)
    decision = TorqueFollowing(ACTIONS, 0.01).choose(observation(torque_Nm=(tx, ty, tz)))
    assert (decision.index, decision.action) == (index, ACTIONS[index])


class TestTorqueRule(PolicyContract):
    def make(self):
        return TorqueFollowing(CONTEXT.actions, 0.01)


def test_only_a_torque_below_the_threshold_is_left_to_chance():
    policy = TorqueFollowing(ACTIONS, 0.01)
    rng = np.random.default_rng(5)
    policy.begin_trial(0, rng)
    fresh = rng.bit_generator.state
    # Torque about the tool axis says nothing about the hole.
    quiet = observation(torque_Nm=(0.0, -0.0099, 5.0))
    assert {policy.choose(observation(torque_Nm=(0.0, -0.01, 0.0))).index for _ in range(50)} == {0}
    assert rng.bit_generator.state == fresh
    assert {policy.choose(quiet).index for _ in range(200)} == set(range(8))


def test_the_spiral_leaves_no_gap():
    # As fine as the tip really moves: along the chords.
    corners = walk(spiral(), (0.0, 0.0), 200)
    share = np.linspace(0.0, 1.0, 10, endpoint=False)[:, None, None]
    path = (corners[:-1] + share * np.diff(corners, axis=0)).reshape(-1, 2)
    rng = np.random.default_rng(0)
    radius, heading = 3e-3 * np.sqrt(rng.uniform(size=500)), rng.uniform(0.0, 2 * pi, 500)
    points = np.column_stack((radius * np.cos(heading), radius * np.sin(heading)))
    gaps = np.linalg.norm(points[:, None] - path, axis=2).min(axis=1)
    # Half a pitch, and what chords cut off the corners of the first turns.
    assert gaps.max() <= 0.62 * PITCH_M
    assert gaps[radius > 2 * PITCH_M].max() <= 0.54 * PITCH_M
    assert gaps.max() > 0.45 * PITCH_M  # or it would search more closely than it says


def test_the_spiral_goes_on_from_where_it_should_be():
    # At the border of the area a step is cut short; the spiral must not be bent by that.
    free = walk(spiral(), (0.0, 0.0), 11)
    policy = spiral()
    walk(policy, (0.0, 0.0), 10)
    held_m = (0.1e-3, 0.0)
    displacement = policy.choose(observation(*held_m, action_number=10)).action.displacement_m
    assert np.add(held_m, displacement) == pytest.approx(free[11])


@pytest.mark.parametrize("heading_deg", [-130.0, 20.0])
def test_the_oracle_pose_is_that_of_a_leaning_peg_in_line_with_the_hole(heading_deg):
    hole = np.array([0.012, -0.014, 0.08])
    policy = OraclePose(lambda: (1e-3, -2e-3, 0.0, *hole, heading_deg), 4e-3, 0.0, 2e-3, 0.035)
    place, turn, actions = np.zeros(2), np.zeros(3), []
    while not actions or actions[-1].spatial.controller is ControllerKind.LIFT:
        seen = replace(observation(*place), turn_rad=tuple(turn), depth_m=-1e-3 if actions else 0.0)
        actions.append(policy.choose(seen).action)
        place, turn = place + actions[-1].displacement_m, turn + actions[-1].spatial.turn_rad
    # Three actions for a turn of 0.08 rad, one of them lifts; then down.
    assert [action.spatial.rise_m for action in actions] == [1e-3, 0.0, 0.0, 0.0]
    assert actions[-1].spatial.controller is ControllerKind.INSERT
    assert place == pytest.approx([1e-3, -2e-3])
    c, s = cos(radians(heading_deg)), sin(radians(heading_deg))
    peg = np.array(orientation(tuple(turn))) @ pin.exp3(np.array([-4e-3 * s, 4e-3 * c, 0.0]))
    assert peg == pytest.approx(pin.exp3(hole), abs=1e-12)
