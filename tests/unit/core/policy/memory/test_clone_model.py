"""Clone-structured models: Baum-Welch gains, each clone has its symbol, and alike places are told apart."""

import numpy as np
import pytest

from palpate.core.policy.memory.clone_fit import clones_of
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.recorded import Batch, RecordedTrial
from palpate.simulation.grid import GridMap
from tests.unit.core.policy.memory.worlds import AMBIGUOUS, random_trials


@pytest.mark.parametrize("seed", range(3))
def test_no_iteration_loses_likelihood(seed: int) -> None:
    trials = random_trials(AMBIGUOUS, 15, seed)
    batch = Batch.of(trials)
    clones = clones_of(trials, 3, 14)
    model, before = CloneModel.blank(clones, 3, 8, np.random.default_rng(seed)), -np.inf
    for _ in range(8):
        prior = sum(np.log(part).sum() for part in (model.transitions, model.goal, model.start)) / len(clones)
        model, log_likelihood = model.improved(batch)
        assert log_likelihood + prior >= before - 1e-4
        before = log_likelihood + prior


def test_it_tells_places_apart_that_read_alike() -> None:
    corridor = GridMap.from_text("AABA·")
    trials = random_trials(corridor, 120)
    clones = clones_of(trials, 2, 8)
    assert clones == tuple(sorted(clones))
    assert clones.count(1) >= 2
    held = random_trials(corridor, 40, seed=1)
    guesses = [CloneModel.blank(clones, 2, 8, np.random.default_rng(seed)) for seed in range(4)]
    losses = [guess.fitted(Batch.of(trials), 30).log_loss(held) for guess in guesses]
    # One state a symbol can do no better than this.
    alone = CloneModel.blank((0, 1), 2, 8, np.random.default_rng(0)).fitted(Batch.of(trials), 30).log_loss(held)
    assert min(losses) < 0.8 * alone


def test_clones_that_no_trial_needs_are_left_out_and_one_a_symbol_stays() -> None:
    corridor = GridMap.from_text("AABA·")
    trials = random_trials(corridor, 40)
    batch = Batch.of(trials)
    model = CloneModel.blank(clones_of(trials, 2, 30), 2, 8, np.random.default_rng(0)).fitted(batch, 40)
    fewer = model.trimmed(batch)
    assert set(fewer.clones) == {0, 1}
    assert len(fewer.clones) < len(model.clones)
    assert fewer.log_loss(trials) < model.log_loss(trials) + 0.01
    assert set(model.trimmed(Batch.of([RecordedTrial((0, 0), (2, 2), True)])).clones) == {0, 1}
