"""How far beside the hole a pass still ends in it."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import capture_half_width_m
from palpate.adapters.experiments import capture_width as capture
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.ports.devices import Ports
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import TrialSetup
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


def test_the_width_is_an_average_over_all_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    passes: list[tuple[float, float]] = []

    def record(rig: SimulatedRig, task: InsertionTask, heading_rad: float, precision_m: float) -> float:
        passes.append((heading_rad, precision_m))
        return 1e-4 * len(passes)

    monkeypatch.setattr(capture, "_widest_pass", record)
    assert capture_half_width_m(RunConfig(), ready_pose(), headings=5) == pytest.approx(3e-4)
    headings = [heading for heading, _ in passes]
    assert np.diff(headings) == pytest.approx(2 * pi / 5)


def test_the_pass_goes_by_at_the_distance_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    starts: list[tuple[float, float]] = []

    def record(task: InsertionTask, ports: Ports, setup: TrialSetup) -> None:
        starts.append(setup.start_m)

    monkeypatch.setattr(capture, "run_trial", record)
    # No pass that is not run ends in the hole: the bisection goes down to nothing.
    assert capture_half_width_m(RunConfig(), ready_pose(), headings=1, precision_m=1e-4) == 0.0
    along = np.array([cos(pi / 2), sin(pi / 2)])  # a quarter of the spacing off, here of a whole turn
    across = np.array([-along[1], along[0]])
    assert np.array(starts) @ along == pytest.approx(-2e-3)
    assert np.array(starts) @ across == pytest.approx([1e-3 / 2**k for k in range(len(starts))])
