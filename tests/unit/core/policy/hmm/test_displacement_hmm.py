"""The offset model: Baum-Welch gains, the map comes out, and what is no lattice or too large is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy import Action, HmmLearner, HmmParameters, compass_actions
from palpate.core.policy.hmm import DisplacementHmm
from palpate.core.policy.hmm.displacement_hmm import fit_displacement_hmm, lattice_steps
from palpate.core.policy.hmm.recorded import Batch
from palpate.simulation.grid import GridMap, grid_actions
from tests.unit.core.policy.hmm.worlds import AMBIGUOUS, STEPS, random_trials, true_offsets


def log_prior(model: DisplacementHmm) -> float:
    """What the pseudo-counts add: the quantity that Baum-Welch never lowers has them in it."""
    n = len(model.offsets)
    squares = np.array([u * u + v * v for u, v in model.offsets])
    total = 0.05 * np.log(model.emissions).sum() + (0.5 * np.exp(-squares / 32.0) * np.log(model.start)).sum()
    free = model.targets() != n + 1
    blocked = model.blocked[free]
    return float(total + (0.1 * np.log(blocked) + 0.9 * np.log1p(-blocked)).sum())


@given(seed=st.integers(0, 10_000))
@settings(max_examples=8, deadline=None)
def test_no_iteration_loses_likelihood(seed: int) -> None:
    batch = Batch.of(random_trials(AMBIGUOUS, 12, seed))
    model = DisplacementHmm.blank(STEPS, 4, 3, np.random.default_rng(seed))
    before = -np.inf
    for _ in range(6):
        prior = log_prior(model)
        model, _, log_likelihood = model.improved(batch)
        assert log_likelihood + prior >= before - 1e-4
        before = log_likelihood + prior


def test_the_map_is_found_from_random_walks() -> None:
    trials = random_trials(AMBIGUOUS, 150)
    found, truth = fit_displacement_hmm(trials, STEPS, 6, 3), true_offsets(AMBIGUOUS)
    assert set(truth.offsets) <= set(found.offsets)
    place = {offset: number for number, offset in enumerate(found.offsets)}
    told = [found.emissions[place[offset]].argmax() for offset in truth.offsets]
    assert told == list(truth.emissions.argmax(axis=1))


def test_trials_that_never_arrived_fill_no_offsets_of_their_own() -> None:
    rows = "AEAFDBAD ADFDGEEF GCBBEFEC BCCBAAGB BBBCFDFB GEDAGEGG GCGCEDGB GACABDED FBABFDCD C·DADFBD EFFCCGDB"
    grid = GridMap.from_text(rows.replace(" ", "\n"))
    found = fit_displacement_hmm(random_trials(grid, 60, limit=60), STEPS, 10, 7)
    assert len(found.offsets) < 1.2 * len(grid.cells)


def test_actions_on_no_lattice_are_refused_and_a_model_too_large_before_it_is_built() -> None:
    assert lattice_steps(grid_actions())[:3] == ((1, 0), (1, 1), (0, 1))
    with pytest.raises(ConfigurationError, match="whole multiples of the shortest"):
        lattice_steps(compass_actions(1e-3))
    # Along a diagonal 2.12 of three steps each way.
    assert lattice_steps(compass_actions(1e-3), 3)[:3] == ((3, 0), (2, 2), (0, 3))
    with pytest.raises(ConfigurationError, match="at least half a step along x or y, the longest side being 1 steps"):
        lattice_steps((*compass_actions(1e-3), Action("nudge", (4e-4, 0.0))), 1)
    with pytest.raises(ConfigurationError, match="'40400 hidden states' is refused: at most 2896"):
        HmmLearner(("A", "B"), grid_actions(), HmmParameters(reach=100))
