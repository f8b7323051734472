"""Calibration in the simulated cell, in virtual time, of hidden values."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.adapters.config import overlay, scenario
from palpate.adapters.experiments.calibration import Commissioning
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import DeviceError, UndeterminedError
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell import HiddenValues

CONFIG = replace(scenario("paper"), seed=7)
READY = find_ready_pose(CONFIG.arm, CONFIG.tool.geometry, CONFIG.task)


@pytest.fixture(autouse=True)
def _hurried(monkeypatch):
    """Nobody stands beside a simulated arm: ten times as fast as a commissioning is."""
    hurried = {
        "guarded_moves.SPEED_M_S": 0.05, "guarded_moves._TURN_RAD_S": 1.0, "guarded_moves._SETTLE_TICKS": 20,
        "steps._PRESS_M_S": 1e-3, "steps._DOWN_M_S": 4e-3, "steps._INSERTIONS": 2, "steps._HOLD_TICKS": 200,
        "steps._TARE_TICKS": 60,
    }  # fmt: skip
    for name, value in hurried.items():
        monkeypatch.setattr(f"palpate.adapters.experiments.calibration.{name}", value)


def test_hidden_values_are_found_and_the_peg_is_inserted_by_them():
    hidden = HiddenValues.drawn(CONFIG.seed)
    with SimulatedRig(CONFIG, READY, hidden) as rig:
        rig.prepare(0)
        hole_in_base = np.array([0.4, 0.0, 0.02]) + np.array(rig.truth().hole_in_task_m) * [1, -1, -1]
        commissioning = Commissioning(rig, CONFIG)
        load = commissioning.payload()
        height, stiffness = commissioning.plate()
        found = {"task": {"goal": {"z_mm": height.value * 1e3}}}
        commissioning.believe(overlay(CONFIG, found))
        x, y = commissioning.insert(load.mounting_deg.value, load.weight_N.value)
        assert rig.truth().peak_force_N < 10.0
    # Of the configured cell hang 0.35 kg there, 0.3 of them 50 mm above the tip.
    mass_kg = 0.35 + hidden.gripper_kg
    centre_m = (hidden.gripper_kg * np.array(hidden.centre_of_mass_m) + 0.3 * np.array([0.0, 0.0, 0.09])) / mass_kg
    assert load.weight_N.value == pytest.approx(9.81 * mass_kg, rel=0.02)
    assert [each.value for each in load.centre_of_mass_m] == pytest.approx(centre_m.tolist(), abs=2e-3)
    assert load.mounting_deg.value == pytest.approx(hidden.mounting_deg, abs=0.5)
    assert height.value == pytest.approx(hole_in_base[2], abs=1e-4)
    assert stiffness.value == pytest.approx(5e3 * hidden.axial_share, rel=0.05)
    assert [x.value, y.value] == pytest.approx(hole_in_base[:2].tolist(), abs=3e-4)


def test_a_plate_that_is_not_where_it_is_believed_to_be_is_not_searched_for_long():
    config = overlay(CONFIG, {"task": {"goal": {"z_mm": 45.0}}})
    with SimulatedRig(CONFIG, READY) as rig:
        rig.prepare(0)
        with pytest.raises(UndeterminedError, match="no contact down to 8 mm below its nominal height"):
            Commissioning(rig, config).plate()


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"force_N": (11.5, 0.0, 0.0)}, "changed by more than 10 N during calibration"),
        # An old sample as a new one.
        ({"source_time_ns": 0}, "SAMPLE_STALE: age of the force sample"),
    ],
)
def test_force_and_sample_that_nobody_expects_stop_the_arm(monkeypatch, change, text):
    with SimulatedRig(CONFIG, READY) as rig:
        rig.prepare(0)
        read = rig.ports.force_sensor.read

        def struck():
            sample = read()
            return replace(sample, **change) if rig.cell.ticks > 100 else sample

        monkeypatch.setattr(rig.ports.force_sensor, "read", struck)
        with pytest.raises(DeviceError, match=text):
            Commissioning(rig, CONFIG).payload()
        assert rig.cell.ticks < 150
