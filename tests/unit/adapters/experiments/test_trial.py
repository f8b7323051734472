"""Setups follow from seed and number alone; success is a matter of the truth."""

from dataclasses import replace
from typing import Any

import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import fit_of, run_scored_trial, trial_setup, truth_fields
from palpate.adapters.experiments import trial as experiment
from palpate.core.errors import ConfigurationError
from palpate.core.ports import FaultLatch, Truth
from palpate.core.tasks.insertion.kind import INSERTION
from palpate.core.trial.report import Outcome
from palpate.simulation.work_cell import CellConfig
from tests.unit.adapters.samples import scored_trial


def test_a_setup_depends_on_seed_and_number_alone():
    config = RunConfig(seed=4)
    assert trial_setup(config, 3) == trial_setup(replace(config, arm="ur5"), 3)
    starts = {trial_setup(RunConfig(seed=seed), k).start_m for seed in range(4) for k in range(4)}
    assert len(starts) == 16
    assert (trial_setup(config, 3).index, trial_setup(config, 3).seed) == (3, 4)


@pytest.mark.parametrize("trial", [-1, 1.5, 2**70])
def test_a_trial_that_has_no_number_leaves_the_rig_as_it_is(trial):
    with pytest.raises(ConfigurationError, match=r"trial = .* a whole number from 0"):
        run_scored_trial(RunConfig(), None, None, trial)  # type: ignore[arg-type]


class StandIn:
    """A rig about which only the truth is known."""

    ports: Any = None
    simulated = True

    def __init__(self, truth):
        self._truth, self.latch = truth, FaultLatch()
        self.prepared = []

    def prepare(self, trial):
        self.prepared.append(trial)

    def truth(self):
        return self._truth

    def stopped_by(self):
        return ""


@pytest.mark.parametrize(
    ("outcome", "aside_m", "depth_m", "false"),
    [
        (Outcome.INSERTED, 0.0, 0.00981, False),
        (Outcome.INSERTED, 0.0, 0.00979, True),
        (Outcome.INSERTED, 0.0012, 0.01, True),  # beside the plate
        (Outcome.WEDGED, 0.0, 0.005, False),
    ],
)
def test_a_false_success_is_a_peg_called_inserted_that_is_not(outcome, aside_m, depth_m, false):
    report = replace(scored_trial(5).report, outcome=outcome)
    truth = Truth((0.0, 0.0, 0.0), (aside_m, 0.0, depth_m), depth_m, 5.0)
    assert INSERTION.untrue(RunConfig().task, report, truth, fit_of(RunConfig())) is false


@pytest.mark.parametrize(
    ("outcome", "depth_m", "peak_N", "success"),
    [
        (Outcome.INSERTED, 0.01, 29.99, True),
        (Outcome.INSERTED, 0.00996, 5.0, True),
        (Outcome.INSERTED, 0.00994, 5.0, False),  # the core believes so, the peg is not there
        (Outcome.INSERTED, 0.01, 30.0, False),  # a peak between two samples
        (Outcome.TIME_LIMIT, 0.01, 5.0, False),
        (Outcome.WEDGED, 0.01, 5.0, False),
    ],
)
def test_success_is_full_depth_within_the_force_limit(monkeypatch, outcome, depth_m, peak_N, success):
    report = replace(scored_trial(5).report, outcome=outcome)
    monkeypatch.setattr(experiment, "run_trial", lambda *_: report)
    rig = StandIn(Truth((0.0, 0.0, 0.0), (0.0, 0.0, depth_m), depth_m, peak_N))
    task = None
    scored = run_scored_trial(RunConfig(), rig, task, 5)
    assert scored.success is success
    assert rig.prepared == [5]


@pytest.mark.parametrize(("tilt_mrad", "depth_m", "success"), [(5.0, 0.00993, True), (5.0, 0.00986, False)])
def test_a_leaning_pegs_centre_stands_above_its_edge(tilt_mrad, depth_m, success):
    config = RunConfig(cell=CellConfig(tilt_mrad=tilt_mrad))
    report = replace(scored_trial(5).report, outcome=Outcome.INSERTED)
    truth = Truth((0.0, 0.0, 0.0), (0.0, 0.0, depth_m), depth_m, 5.0)
    assert experiment.score(config, report, truth).success is success


def test_where_nobody_knows_the_truth_a_log_holds_none():
    scored = replace(scored_trial(0), truth=None)
    assert truth_fields(scored) == {}
    assert truth_fields(scored_trial(0))["success"] is True
