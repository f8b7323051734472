"""Pegs of every shape go into their holes."""

from dataclasses import replace

import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import Run
from palpate.core.job import KEYED, SIDES
from palpate.core.motion.arm import ARMS
from palpate.core.trial.report import Outcome
from palpate.simulation.work_cell.config import CellConfig, PegConfig

# A keyed peg fits in one way only: it shows how each arm holds it.
CASES = [
    *((section, "zebra-zero") for section in ("round", *SIDES)),
    (KEYED, "panda"),
    *(pytest.param(KEYED, arm, marks=pytest.mark.nightly) for arm in ARMS if arm not in ("zebra-zero", "panda")),
]


def config_of(arm, section):
    return RunConfig(arm=arm, cell=CellConfig(peg=PegConfig(cross_section=section)))


@pytest.mark.parametrize(("section", "arm"), CASES)
def test_centred_peg_goes_in_to_10_mm(section, arm):
    config = config_of(arm, section)
    config = replace(config, task=replace(config.task, start_uncertainty_mm=0.0))
    (row,) = Run(config).evaluate(1, "oracle").rows
    assert row.outcome == Outcome.INSERTED.value
    assert row.depth_mm == pytest.approx(10.0, abs=0.05)
    assert row.peak_force_N < config.task.max_force_N
