"""The insertion task as an environment: steps, rewards, ends, refusals and pictures."""

import contextlib
import pickle
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from palpate.adapters.config import compose, read_job
from palpate.adapters.gymnasium_envs.episode import NotRunningError
from palpate.adapters.gymnasium_envs.peg_insertion import PegInsertionEnv
from palpate.core.errors import ConfigurationError
from tests.support.graphics import require_graphics

EAST, WEST = 0, 4


def cell(**arguments):
    return PegInsertionEnv(**arguments)


@pytest.fixture
def env():
    made = cell(observations="raw", config={"task": {"time_limit_s": 1.0}})
    yield made
    made.close()


def towards_hole(info):
    """The free step that leads to the hole, as far as one step can."""
    away = (info["true_hole_m"] - info["true_tip_m"])[:2] / 0.7e-3
    return (away / max(np.linalg.norm(away), 1.0)).astype(np.float32)


def test_free_steps_lead_into_the_hole_and_that_terminates():
    env = cell(actions="continuous")
    _, info = env.reset(seed=4)
    rewards, terminated, truncated = [], False, False
    while not terminated and not truncated:
        _, reward, terminated, truncated, info = env.step(towards_hole(info))
        rewards.append(reward)
    assert (terminated, truncated, info["outcome"], info["is_success"]) == (True, False, "inserted", True)
    assert info["phase"] == "done"
    assert info["true_depth_m"] == pytest.approx(0.010, abs=1e-4)
    assert rewards == [-1.0] * len(rewards)
    assert len(rewards) < 12
    with pytest.raises(NotRunningError, match="after an episode has ended"):
        env.step(np.zeros(2, np.float32))
    env.close()


def crash(**arguments):
    """An episode whose force limit is little above the pressing force, so that its first steps end it."""
    config = {"task": {"max_force_N": 6.5, "time_limit_s": 4.0}, "learning": {"reinforcement": "action-penalty"}}
    env = cell(config=config, **arguments)
    total, over = 0.0, False
    env.reset(seed=0)
    while not over:
        _, reward, terminated, truncated, info = env.step(EAST)
        total, over = total + reward, terminated or truncated
    env.close()
    return total, terminated, truncated, info


def test_a_failure_terminates_and_is_no_way_to_save_reward():
    total, terminated, truncated, info = crash()
    assert (terminated, truncated, info["outcome"]) == (True, False, "force limit")
    assert not info["is_success"]
    # As much as exploring to the time limit would have cost, to the decision that was under way.
    assert total == pytest.approx(-40.0, abs=1.0)
    assert info["reinforcement"] == -1.0


@pytest.mark.parametrize("penalty", [0.0, 7.5])
def test_the_penalty_of_a_failure_may_be_given(penalty):
    total, _, _, info = crash(failure_penalty=penalty)
    assert info["outcome"] == "force limit"
    assert total == -info["decisions"] - penalty


def test_a_trial_that_goes_straight_into_the_hole_is_skipped():
    # The starts are so near that some trials hit the hole at once.
    env = cell(config={"task": {"start_uncertainty_mm": 0.3}})
    _, info = env.reset(seed=0)
    skipped, trials = info["skipped_trials"], [info["trial"]]
    while skipped == 0:
        _, info = env.reset()
        skipped = info["skipped_trials"]
        trials.append(info["trial"])
    assert info["phase"] == "explore"
    assert trials[-1] == len(trials) - 1 + skipped
    assert env.reset()[1]["trial"] > trials[-1]
    env.close()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"actions": "both"}, "actions must be one of discrete, continuous"),
        ({"failure_penalty": -1.0}, "failure_penalty must be "),
        ({"job": "nowhere.toml"}, "job = 'nowhere.toml': no such file"),
        ({"render_mode": "human"}, "render_mode must be rgb_array, or None"),
    ],
)
def test_what_there_is_not_is_refused(arguments, message):
    with pytest.raises(ConfigurationError) as caught:
        cell(**arguments)
    assert str(caught.value).startswith(message)


def test_a_job_is_stated_by_its_file_or_its_tables_and_other_arguments_win():
    path = Path("examples/jobs/dowel-12-h7.toml").resolve()
    made = cell(job=path)
    config = made._episodes.config
    made.close()
    assert config == compose("job", job=read_job(path))
    tables = read_job(path)
    tables["part"]["hole_mm"] = 12.1
    with contextlib.closing(cell(job=tables, arm="ur10e", config={"place": {"x_mm": 550.0}})) as env:
        config = env._episodes.config
        assert (config.cell.peg.clearance_mm, config.arm, config.task.goal.x_mm) == (0.05, "ur10e", 550.0)
        env.reset(seed=0)


def test_a_copy_begins_anew_with_the_same_arguments(env):
    first = env.reset(seed=5)[0]
    copied = pickle.loads(pickle.dumps(env))
    with pytest.raises(NotRunningError):
        copied.step(EAST)
    assert copied.reset(seed=5)[0].tobytes() == first.tobytes()
    copied.close()


# Episodes after a seed are its trials in order, whatever happened before.


@pytest.fixture
def begun(env, monkeypatch):
    """Seed and trial of each episode; trial 7 has no decision."""
    seen = []

    def begin(seed, trial):
        seen.append((seed, trial))
        env._episodes.trial = trial + (trial == 7)

    monkeypatch.setattr(env._episodes, "begin", begin)
    return seen


def test_the_episodes_of_a_seed_are_its_trials_in_order(env, begun):
    for seed in (5, None, None, 9, None, 5):
        env.reset(seed=seed)
    assert begun == [(5, 0), (5, 1), (5, 2), (9, 0), (9, 1), (5, 0)]


def test_a_trial_may_be_named_and_those_after_it_follow(env, begun):
    env.reset(seed=5, options={"trial": 7})
    env.reset(options={})
    env.reset(options={"trial": 0})
    assert begun == [(5, 7), (5, 9), (5, 0)]


@pytest.mark.parametrize(
    ("seed", "options", "message"),
    [
        (None, {"tria": 1}, "options must be a table such as"),
        (None, 5, "options must be a table such as"),
        (2**63, None, "seed must be "),
    ],
)
def test_what_is_refused_changes_nothing(env, begun, seed, options, message):
    env.reset(seed=4)
    with pytest.raises(ConfigurationError) as caught:
        env.reset(seed=seed, options=options)
    assert str(caught.value).startswith(message)
    env.reset()
    assert begun == [(4, 0), (4, 1)]


def walk(env, *, look):
    seen, pictures = [env.reset(seed=2)[0].tobytes()], []
    for action in (EAST, EAST, WEST, EAST):
        if look:
            pictures.append(env.render())
        seen.append(env.step(action)[0].tobytes())
    return seen, pictures


def test_pictures_show_how_the_peg_moves_and_looking_changes_nothing():
    require_graphics()
    looked, unseen = (PegInsertionEnv(observations="raw", render_mode=mode) for mode in ("rgb_array", None))
    seen, pictures = walk(looked, look=True)
    assert seen == walk(unseen, look=False)[0]
    assert {(p.shape, p.dtype.str) for p in pictures} == {((480, 640, 3), "|u1")}
    # Some hundred pixels at the edge of the peg are others, most are not.
    differing = [int((a != b).any(axis=2).sum()) for a, b in pairwise(pictures)]
    assert all(100 < count < 100_000 for count in differing)
    looked.close()
    looked.close()
    assert looked.render() is None
    assert unseen.render() is None
    unseen.close()
