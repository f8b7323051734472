"""Wrong readings: told from failing moves by trials alone, and allowed for by messages and counts."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.misread_counts import third_readings
from palpate.core.policy.memory.recorded import Batch, RecordedTrial
from palpate.simulation.grid import Disturbance
from tests.unit.core.policy.memory.worlds import AMBIGUOUS, random_trials


@pytest.mark.parametrize("slips", [0.0, 0.2])
def test_there_and_back_no_third_symbol_is_read_unless_readings_are_wrong(slips: float) -> None:
    assert third_readings(random_trials(AMBIGUOUS, 100, disturbance=Disturbance(slips=slips)), 8) == 0.0
    wrong = Disturbance(slips=slips, misreads=0.05)
    assert 0.01 < third_readings(random_trials(AMBIGUOUS, 100, disturbance=wrong), 8) < 0.1


@pytest.mark.parametrize("count", [1, 4, 12, 30])
def test_few_trials_that_do_not_show_which_action_leads_back_tell_nothing(count: int) -> None:
    assert third_readings(random_trials(AMBIGUOUS, count), 8) == 0.0


def test_messages_and_counts_are_those_of_every_path_that_there_may_be() -> None:
    rng = np.random.default_rng(0)
    model = replace(CloneModel.blank((0, 0, 1), 2, 2, rng), misread=0.3)
    trials = [RecordedTrial((0, 1, 1), (0, 1, 0), True), RecordedTrial((1, 0), (1,), False)]
    moves, goals, starts = np.zeros((2, 3, 3)), np.zeros((2, 3)), np.zeros(3)
    log_likelihood = 0.0
    for trial in trials:
        paths = np.stack(np.meshgrid(*[range(3)] * len(trial.symbols), indexing="ij"), -1).reshape(
            -1, len(trial.symbols)
        )
        weights = model.start[paths[:, 0]] * model.emissions[paths, list(trial.symbols)].prod(axis=1)
        steps = list(zip(range(len(trial.symbols) - 1), trial.actions, strict=False))
        for at, action in steps:
            weights = weights * model.transitions[action, paths[:, at], paths[:, at + 1]]
        if trial.reached:
            weights = weights * model.goal[trial.actions[-1], paths[:, -1]]
            np.add.at(goals[trial.actions[-1]], paths[:, -1], weights / weights.sum())
        log_likelihood += np.log(weights.sum())
        np.add.at(starts, paths[:, 0], weights / weights.sum())
        for at, action in steps:
            np.add.at(moves[action], (paths[:, at], paths[:, at + 1]), weights / weights.sum())
    found = model.expected(Batch.of(trials))
    for got, right in zip((found.moves, found.goals, found.starts), (moves, goals, starts), strict=True):
        assert got == pytest.approx(right, abs=1e-4)
    assert found.log_likelihood == pytest.approx(log_likelihood, abs=1e-6)
    assert model.log_loss(trials) == pytest.approx(-log_likelihood / 6, abs=1e-6)
