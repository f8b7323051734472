"""Stages of perception fitted to samples of random walks, and the simulated worlds of a plan."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from palpate.adapters.config import compose, read_job
from palpate.adapters.config.run import PerceptionConfig
from palpate.adapters.experiments import load_policy, trials
from palpate.adapters.experiments.fitting import configured_perception, fitted_perception
from palpate.adapters.experiments.planning import drawn_world, run_series, simulate
from palpate.adapters.experiments.policies import learning_policy, loaded_policy, perception_of
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.training import Trainer
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.perception import perception_to_dict
from tests.unit.adapters.samples import QUICK, ready_pose, run_policy

STAGES = {
    "pca+clusters": PerceptionConfig(features="pca", symbols="clusters", symbol_count=6, fit_trials=2),
    "som+random": PerceptionConfig(features="som", som_side=3, symbols="random", symbol_count=6, fit_trials=2),
    "channels+random": PerceptionConfig(symbols="random", channels=("fx", "ty"), symbol_count=6, fit_trials=2),
}

each_stage = pytest.mark.parametrize("stages", ["pca+clusters", pytest.param("som+random", marks=pytest.mark.nightly)])


def config_of(stages):
    return replace(QUICK, perception=STAGES[stages])


def fit(config):
    with SimulatedRig(config, ready_pose()) as rig:
        return fitted_perception(config, ready_pose(), rig)


@cache
def fitted(stages):
    return perception_to_dict(fit(config_of(stages)))


def test_fitting_shares_no_random_stream_with_the_run(monkeypatch):
    numbers = []

    def record(config, rig, task, trial, *more):
        numbers.append(trial)
        return run_scored_trial(config, rig, task, trial, *more)

    monkeypatch.setattr(trials, "run_scored_trial", record)
    fit(config_of("channels+random"))
    assert len(set(numbers)) == 2
    assert min(numbers) >= 1_000_000  # no run has so many trials of its own


@each_stage
def test_fitted_perception_trains_and_its_policy_runs(stages, tmp_path):
    config, ready = config_of(stages), ready_pose()
    folder = RunFolder(tmp_path)
    with SimulatedRig(config, ready) as rig:
        perception = fitted_perception(config, ready, rig)
        assert len(perception.states) == 6
        assert perception_to_dict(perception) == fitted(stages)
        trainer = Trainer(config, folder, ready, rig, perception, learning_policy(config, perception))
        trainer.train(2, lambda scored: None)
        trainer.save_policy()
    assert [row.trial for row in folder.read_trials()] == [0, 1]

    document = load_policy(tmp_path / "policy.json")
    assert sum(row.visits or 0 for row in document.table) > 0
    with SimulatedRig(config, ready) as rig:
        perception = perception_of(document, config, configured_perception(config))
        assert perception_to_dict(perception) == fitted(stages)
        policy = loaded_policy(document, config, perception, frozen=True)
        rows = run_policy(config, rig, policy, 1, perception=perception)
    assert rows[0].actions > 0


DOWEL = read_job(Path(__file__).parents[4] / "examples" / "jobs" / "dowel-12-h7.toml")


def planned(**place):
    return compose("job", "q-learning", {"place": place, "seed": 3}, job=DOWEL)


def test_each_trial_has_a_world_from_the_ranges_of_the_job():
    config = planned()
    worlds = [drawn_world(config, trial, {}).cell for trial in range(200)]
    for name, least, most in (
        ("friction", 0.1, 0.4), ("tilt", 0.0, 2.0), ("height", -0.5, 0.5), ("noise", 0.08, 0.125),
        ("axial", 18.0, 22.0),
    ):  # fmt: skip
        values = [
            {
                "friction": cell.peg.friction, "tilt": cell.tilt_mrad, "height": cell.hole_height_error_mm,
                "noise": cell.sensor.force_noise_N, "axial": cell.compliance.axial_N_per_mm,
            }[name]
            for cell in worlds
        ]  # fmt: skip
        span = 0.05 * (most - least)
        assert least <= min(values) < least + span, name
        assert most - span < max(values) <= most, name
    # All of a gripper's springs are of the same batch.
    assert {round(cell.compliance.lateral_N_per_mm / cell.compliance.axial_N_per_mm, 9) for cell in worlds} == {2.0}


def test_world_depends_on_seed_and_trial_alone_and_keeps_a_stated_friction():
    config = planned()
    assert drawn_world(config, 7, {}) == drawn_world(config, 7, {})
    assert drawn_world(config, 7, {"peg": {"friction": 0.2}}).cell.peg.friction == 0.2
    assert drawn_world(config, 7, {}).task == config.task


@pytest.mark.nightly
def test_rule_counts_every_trial_and_a_learner_all_but_the_first():
    rule = next(simulate(planned(position_uncertainty_mm=0.0), "oracle", 2, 1, {}))
    assert (len(rule[0]), rule[1]) == (2, 2)
    learner = compose("job", "belief", {"seed": 3}, job=DOWEL)
    counted, ran = next(simulate(learner, "", 2, 1, {}))
    assert ([each.report.setup.index for each in counted], ran) == ([1], 2)


def test_trip_ends_one_trial_and_no_more():
    config = compose("job", "q-learning", {"supervision": {"max_force_rate_N_s": 150.0}, "seed": 3}, job=DOWEL)
    trips = [scored.trip.partition(":")[0] for scored in run_series(config, "torque", range(2))]
    assert trips == ["FORCE_RATE", "FORCE_RATE"]


def test_oracle_knows_each_trials_hole():
    config = compose("job", "q-learning", {"seed": 3}, job={**DOWEL, "arm": {"name": "ur5e"}})
    assert all(scored.success for scored in run_series(config, "oracle", range(2)))
