"""What differs from trial to trial, what cannot be, and what costs accuracy."""

from dataclasses import replace
from math import atan2, degrees, hypot, sin

import numpy as np
import pytest

from palpate.core.ports import axis_of
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.core.trial import TRIALS_OF_A_SERIES as SERIES
from palpate.core.trial import Purpose, draw_in_disc, generator
from palpate.simulation.work_cell import CellConfig, ConditionsConfig, trial_world
from palpate.simulation.work_cell.accuracy import valid, validity_lines
from palpate.simulation.work_cell.config import PegConfig
from tests.unit.simulation.work_cell.test_cell import SILENT, advance, cell_of, ready_rad


def world(trial=0, seed=5, **conditions):
    return trial_world(CellConfig(tilt_mrad=4.0, conditions=ConditionsConfig(**conditions)), seed, trial)


def test_without_conditions_only_the_hole_is_drawn_and_as_ever():
    config = CellConfig(hole_uncertainty_mm=3.0, tilt_mrad=4.0, tilt_heading_deg=30.0)
    for trial in (0, 7, SERIES):
        plain = trial_world(config, 5, trial)
        assert plain.cell == config
        assert plain.hole_in_task_m[:2] == draw_in_disc(generator(5, Purpose.HOLE, trial), 3e-3, "disc")
        assert (plain.drawn, plain.zero_shift, plain.zero_drift_per_s) == ({}, (0.0,) * 6, (0.0,) * 6)


@pytest.mark.parametrize(
    ("name", "batch", "conditions"),
    [
        ("tilt_heading_deg", "grip_trials", {"tilt_heading": "drawn"}),
        ("zero_heading_deg", "zero_trials", {"zero_heading": "drawn", "zero_shift_Nm": 0.03}),
        ("hole_shift_x_mm", "hole_shift_trials", {"hole_shift_mm": 2.5}),
    ],
)
def test_value_holds_for_a_seed_or_a_batch_and_is_another_in_the_next(name, batch, conditions):
    def drawn(trial, seed=5, **more):
        return world(trial, seed, **conditions, **more).drawn[name]

    assert drawn(0) == drawn(99) == drawn(SERIES + 3) != drawn(0, seed=6)
    trials = [0, 1, 19, 20, 39, 40, SERIES, SERIES + 19, SERIES + 20]
    headings = [drawn(trial, **{batch: 20}) for trial in trials]
    assert [headings.index(each) for each in headings] == [0, 0, 0, 3, 3, 5, 6, 6, 8]
    assert len({drawn(trial, **{batch: 1}) for trial in range(50)}) == 50


def test_yaw_and_lean_of_the_plate_are_drawn_for_each_trial_and_turn_the_hole():
    both = [world(trial, yaw_deg=5.0, plate_tilt_mrad=17.5) for trial in range(40)]
    for each in both:
        axis = axis_of(each.hole_turn_rad)
        assert hypot(*axis[:2]) == pytest.approx(sin(17.5e-3))
        assert degrees(atan2(axis[1], axis[0])) == pytest.approx(each.drawn["plate_heading_deg"], abs=1e-4)
        # The lean adds to the yaw in second order only.
        assert degrees(each.hole_turn_rad[2]) == pytest.approx(each.drawn["hole_yaw_deg"], abs=1e-3)
    yaws = [each.drawn["hole_yaw_deg"] for each in both]
    assert -5.0 <= min(yaws) < -4.0 < 4.0 < max(yaws) <= 5.0
    assert [world(trial, yaw_deg=5.0).drawn for trial in range(40)] == [{"hole_yaw_deg": yaw} for yaw in yaws]


def pressed(cell, ticks):
    """Let the peg sink on the plate: the arm's joints go on by what brings the tip some mm down."""
    cell.command(tuple(ready_rad("zebra-zero") + np.array([0.0, 0.012, 0.0, 0.0, 0.0, 0.0])))
    advance(cell, ticks)


def test_zero_shifts_under_load_and_is_back_before_the_next_tare():
    shift = ConditionsConfig(zero_shift_N=0.2, zero_shift_Nm=0.03, zero_heading_deg=90.0)
    cell = cell_of(CellConfig(sensor=SILENT, conditions=shift, hole_uncertainty_mm=3.0, hole_height_error_mm=2.0))
    plain = cell_of(replace(cell.config, conditions=ConditionsConfig()))

    def off():
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


def test_zero_drifts_with_the_time_of_a_trial():
    cell = cell_of(CellConfig(sensor=SILENT, conditions=ConditionsConfig(zero_drift_Nm_s=0.01)))
    for trial in range(2):
        cell.reset(0, trial)
        before = cell.measure_wrench()
        advance(cell, CONTROL_RATE_HZ)
        assert cell.measure_wrench()[3] - before[3] == pytest.approx(0.01, abs=1e-3)


def test_cell_regripped_is_the_cell_of_that_grip():
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


def test_cell_outside_the_valid_range_is_reported():
    assert validity_lines(CellConfig()) == []
    (line,) = validity_lines(CellConfig(peg=PegConfig(clearance_mm=0.001)))
    assert line.startswith("outside the simulator's valid range: its play error is 0.9 um ")


@pytest.mark.parametrize("diameter_mm", [4.0, 12.0, 29.0, 60.0])
@pytest.mark.parametrize("tilt_mrad", [0.0, 2.0, 4.0])
@pytest.mark.parametrize("clearance_mm", [0.001, 0.003, 0.008, 0.02, 0.075, 0.3])
@pytest.mark.parametrize("section", ["round", "square"])
def test_valid_range_ends_between_3_and_8_micrometres(diameter_mm, tilt_mrad, clearance_mm, section):
    for depth_mm in (10.0, 30.0):
        peg = PegConfig(
            cross_section=section, diameter_mm=diameter_mm, clearance_mm=clearance_mm, hole_depth_mm=depth_mm
        )
        assert valid(CellConfig(peg=peg, tilt_mrad=tilt_mrad)) == (clearance_mm >= 0.008)
