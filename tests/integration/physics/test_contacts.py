"""Listed contacts change no bit of a trial."""

from dataclasses import replace

import pytest

from palpate.simulation.work_cell.config import PegConfig
from tests.integration.physics.test_reproducible import short_run
from tests.integration.physics.trials import digests


@pytest.mark.parametrize(
    ("arm", "section", "tilt_mrad"),
    [("zebra-zero", "round", 0.0), ("ur5", "round", 20.0), ("zebra-zero", "hexagon", 5.0)],
)
def test_a_trial_with_listed_contacts_is_that_with_all_of_them_searched(
    arm: str, section: str, tilt_mrad: float
) -> None:
    run = short_run(arm)
    found = set()
    for contacts in ("listed", "searched"):
        peg = PegConfig(cross_section=section)
        cell = replace(run.cell, peg=peg, tilt_mrad=tilt_mrad, contacts=contacts)
        found.add(tuple(digests(replace(run, cell=cell), range(2))))
    assert len(found) == 1
