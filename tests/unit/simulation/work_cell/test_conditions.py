"""Conditions that change nothing, or cannot be, are refused by name; in the cell, each is there when it should be."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from palpate.adapters.config import overlay
from palpate.core.errors import ConfigurationError
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.simulation.work_cell import CellConfig, ConditionsConfig, WorkCell
from palpate.simulation.work_cell.config import PegConfig
from tests.unit.simulation.work_cell.test_model import SILENT, advance, cell_of, ready_rad


@pytest.mark.parametrize(
    ("conditions", "field"),
    [
        ({"grip_trials": 20}, "grip_trials"),
        ({"zero_trials": 1, "zero_shift_Nm": 0.03}, "zero_trials"),
        ({"hole_shift_trials": 20}, "hole_shift_trials"),
        ({"wear_mm": -0.08}, "wear_mm"),  # below no clearance at all
        ({"wear_mm": 4.95}, "wear_mm"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(conditions: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        CellConfig(conditions=ConditionsConfig(**conditions))
    assert caught.value.field == f"cell.conditions.{field}"
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("peg", "field"),
    [
        ({"cross_section": "pentagon"}, "cross_section"),
        ({"cross_section": "rounded-square", "corner_radius_mm": 14.5}, "corner_radius_mm"),
        ({"cross_section": "keyed", "flat_mm": 14.5}, "flat_mm"),
        ({"cross_section": "keyed", "contact": "spheres"}, "contact"),
        ({"chamfer_mm": 8.0}, "chamfer_mm"),
    ],
)
def test_a_shape_that_cannot_be_is_refused_in_a_line(peg: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        overlay(PegConfig(), peg)
    assert caught.value.field == f"cell.peg.{field}"
    assert "\n" not in str(caught.value)


def test_the_plate_reaches_as_far_as_a_corner_swings() -> None:
    triangle = PegConfig(cross_section="triangle")
    still, turned = CellConfig(triangle), CellConfig(triangle, conditions=ConditionsConfig(yaw_deg=60.0))
    # A corner of a triangle is twice as far from its axis as a side.
    assert turned.plate_reach_m(6e-3) - still.plate_reach_m(6e-3) == pytest.approx(14.5e-3)


def pressed(cell: WorkCell, ticks: int) -> None:
    """Let the peg sink on the plate: the arm's joints go on by what brings the tip some mm down."""
    cell.command(tuple(ready_rad("zebra-zero") + np.array([0.0, 0.012, 0.0, 0.0, 0.0, 0.0])))
    advance(cell, ticks)


def test_the_zero_shifts_under_load_and_is_back_before_the_next_tare() -> None:
    shift = ConditionsConfig(zero_shift_N=0.2, zero_shift_Nm=0.03, zero_heading_deg=90.0)
    cell = cell_of(CellConfig(sensor=SILENT, conditions=shift, hole_uncertainty_mm=3.0, hole_height_error_mm=2.0))
    plain = cell_of(replace(cell.config, conditions=ConditionsConfig()))

    def off() -> list[float]:
        return (np.array(cell.measure_wrench()) - plain.measure_wrench()).tolist()

    assert off() == [0.0] * 6  # What is tared in free air.
    for each in (cell, plain):
        pressed(each, 60)
    assert cell.data.ncon
    assert off() == pytest.approx([0.0, 0.2, 0.0, 0.0, 0.03, 0.0], abs=1e-12)
    for each in (cell, plain):
        each.command(tuple(ready_rad("zebra-zero").tolist()))
        advance(each, 70)
    assert not cell.data.ncon
    assert off() == [0.0] * 6


def test_the_zero_drifts_with_the_time_of_a_trial() -> None:
    cell = cell_of(CellConfig(sensor=SILENT, conditions=ConditionsConfig(zero_drift_Nm_s=0.01)))
    for trial in range(2):
        cell.reset(0, trial)
        before = cell.measure_wrench()
        advance(cell, CONTROL_RATE_HZ)
        assert cell.measure_wrench()[3] - before[3] == pytest.approx(0.01, abs=1e-3)


def test_a_cell_regripped_is_the_cell_of_that_grip() -> None:
    config = CellConfig(tilt_mrad=20.0, conditions=ConditionsConfig(tilt_heading="drawn", grip_trials=1, wear_mm=0.05))
    cell, digests = cell_of(config), list[str]()
    for trial in (0, 1, 0):
        cell.reset(3, trial)
        drawn = cell.truth().drawn
        peg = replace(config.peg, clearance_mm=drawn["clearance_mm"])
        fixed = cell_of(CellConfig(tilt_mrad=20.0, tilt_heading_deg=drawn["tilt_heading_deg"], peg=peg))
        assert cell.data.body("peg").xquat == pytest.approx(fixed.data.body("peg").xquat, abs=1e-9)
        assert cell.model.geom_pos == pytest.approx(fixed.model.geom_pos, abs=1e-9)
        digests.append(cell.model_sha256())
    assert digests[0] == digests[2] != digests[1]
