"""Stages of perception that are fitted to samples of random walks."""

from dataclasses import replace
from functools import cache

import pytest

from palpate.adapters.config.run import PerceptionConfig
from palpate.adapters.experiments import trials
from palpate.adapters.experiments.fitting import configured_perception, fitted_perception
from palpate.adapters.experiments.policies import learning_policy, loaded_policy, perception_of
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.training import Trainer
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.files import load_policy
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.perception import perception_to_dict
from tests.unit.adapters.samples import QUICK, ready_pose, run_policy

STAGES = {
    "pca+clusters": PerceptionConfig(features="pca", symbols="clusters", symbol_count=6, fit_trials=2),
    "som+random": PerceptionConfig(features="som", som_side=3, symbols="random", symbol_count=6, fit_trials=2),
    "channels+random": PerceptionConfig(symbols="random", channels=("fx", "ty"), symbol_count=6, fit_trials=2),
}

each_stage = pytest.mark.parametrize("stages", STAGES)


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
