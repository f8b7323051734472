"""How clone-structured models are fitted: in rounds, merged and divided until there is one clone a place."""

import numpy as np
import pytest

from palpate.core.policy.memory.clone_fit import clones_of, divided, fit_clones, ripened
from palpate.core.policy.memory.clone_model import CloneModel
from palpate.core.policy.memory.misread_counts import third_readings
from palpate.core.policy.memory.recorded import Batch
from palpate.simulation.grid import Disturbance
from tests.unit.core.policy.memory.worlds import AMBIGUOUS, random_trials


def test_rounds_go_on_while_other_trials_are_foretold_the_better_for_it() -> None:
    trials, held = random_trials(AMBIGUOUS, 60), random_trials(AMBIGUOUS, 20, seed=1)
    begun = CloneModel.blank(clones_of(trials, 3, 40), 3, 8, np.random.default_rng(0)).fitted(Batch.of(trials), 10)
    ripe = ripened(begun, Batch.of(trials), held)
    assert ripe.log_loss(held) < begun.trimmed(Batch.of(trials)).fitted(Batch.of(trials), 15).log_loss(held)


@pytest.mark.parametrize("slips", [0.0, 0.1])
def test_merged_and_divided_there_is_a_clone_a_place_and_the_share_of_failing_moves(slips: float) -> None:
    disturbance = Disturbance(slips=slips)
    trials = random_trials(AMBIGUOUS, 200, disturbance=disturbance)
    held, batch = random_trials(AMBIGUOUS, 40, seed=1, disturbance=disturbance), Batch.of(trials)
    begun = CloneModel.blank(clones_of(trials, 3, 60), 3, 8, np.random.default_rng(0)).fitted(batch, 25)
    found, left = divided(begun, batch, held, np.random.default_rng(1)), ripened(begun, batch, held)
    cells = len(AMBIGUOUS.cells)
    assert cells <= len(found.clones) <= cells + 2
    assert found.fails == pytest.approx(slips, abs=0.02)
    assert found.log_loss(held) < left.log_loss(held)


def test_where_readings_are_wrong_their_share_is_learned_and_there_is_about_a_clone_a_place() -> None:
    disturbance = Disturbance(misreads=0.05)
    trials = random_trials(AMBIGUOUS, 250, limit=25, disturbance=disturbance)
    held = random_trials(AMBIGUOUS, 40, seed=1, disturbance=disturbance)
    (found,) = fit_clones(trials, 3, 8, misreading=True)
    cells = len(AMBIGUOUS.cells)
    assert cells <= len(found.clones) <= cells + 3
    assert found.misread == pytest.approx(0.05, abs=0.02)
    # Held against one that takes each reading for right.
    assert found.log_loss(held) < 0.9 * fit_clones(trials, 3, 8, guesses=1, kept=1)[0].log_loss(held)


def test_where_no_reading_is_wrong_models_are_those_that_took_each_for_right() -> None:
    trials = random_trials(AMBIGUOUS, 12)
    (allowing,), (before,) = (fit_clones(trials, 3, 8, guesses=1, kept=1, misreading=mend) for mend in (True, False))
    assert allowing.transitions.tolist() == before.transitions.tolist()
    assert allowing.misread == 0.0


def test_where_wrong_readings_are_seen_but_no_places_found_each_is_taken_for_right() -> None:
    trials = random_trials(AMBIGUOUS, 100, limit=15, disturbance=Disturbance(misreads=0.05))
    (found,) = fit_clones(trials, 3, 8, guesses=1, kept=1, misreading=True)
    assert third_readings(trials, 8) > 0.01
    assert found.misread == 0.0
