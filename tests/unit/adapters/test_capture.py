"""How far beside the hole a pass still ends in it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from palpate.adapters.capture import capture_half_width_m
from palpate.adapters.config import RunConfig
from tests.unit.adapters.samples import ready_pose

PRECISION_M = 4e-5


def width_m(config: RunConfig) -> float:
    return capture_half_width_m(config, ready_pose(), headings=1, precision_m=PRECISION_M)


@pytest.fixture(scope="module")
def usual_m() -> float:
    return width_m(RunConfig())


def test_capture_width_is_a_fraction_of_a_millimetre(usual_m: float) -> None:
    assert 0.05e-3 < usual_m < 0.5e-3


def test_a_wider_hole_captures_from_further_away(usual_m: float) -> None:
    cell = RunConfig().cell
    wide = replace(RunConfig(), cell=replace(cell, peg=replace(cell.peg, clearance_mm=0.5)))
    assert width_m(wide) > usual_m + 2 * PRECISION_M


def test_the_scenario_does_not_matter(usual_m: float) -> None:
    # The hole lies where the passes are aimed, and no noise decides.
    blind = replace(RunConfig(), cell=replace(RunConfig().cell, hole_uncertainty_mm=3.0), seed=9)
    assert width_m(blind) == usual_m
