"""The world of a trial: what is drawn, how often, from which seed; and nothing where no condition is set."""

from dataclasses import replace
from math import atan2, degrees, hypot, sin
from typing import Any

import pytest

from palpate.core.ports import axis_of
from palpate.core.trial import TRIALS_OF_A_SERIES as SERIES
from palpate.core.trial import Purpose, draw_in_disc, generator
from palpate.simulation.work_cell import CellConfig, ConditionsConfig, trial_world
from palpate.simulation.work_cell.trial_world import TrialWorld


def world(trial: int = 0, seed: int = 5, **conditions: Any) -> TrialWorld:
    return trial_world(CellConfig(tilt_mrad=4.0, conditions=ConditionsConfig(**conditions)), seed, trial)


def test_without_conditions_only_the_hole_is_drawn_and_as_ever() -> None:
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
def test_a_value_holds_for_a_seed_or_a_batch_and_is_another_in_the_next(
    name: str, batch: str, conditions: dict[str, Any]
) -> None:
    def drawn(trial: int, seed: int = 5, **more: int) -> float:
        return world(trial, seed, **conditions, **more).drawn[name]

    assert drawn(0) == drawn(99) == drawn(SERIES + 3) != drawn(0, seed=6)
    trials = [0, 1, 19, 20, 39, 40, SERIES, SERIES + 19, SERIES + 20]
    headings = [drawn(trial, **{batch: 20}) for trial in trials]
    assert [headings.index(each) for each in headings] == [0, 0, 0, 3, 3, 5, 6, 6, 8]
    assert len({drawn(trial, **{batch: 1}) for trial in range(50)}) == 50


def test_no_two_conditions_share_their_chance() -> None:
    both = world(tilt_heading="drawn", zero_heading="drawn", zero_shift_Nm=0.03).drawn
    assert both["tilt_heading_deg"] != both["zero_heading_deg"]


def test_the_zero_moves_across_the_tool_axis_towards_its_heading() -> None:
    moved = world(zero_shift_N=0.2, zero_shift_Nm=0.03, zero_drift_Nm_s=0.001, zero_heading_deg=90.0)
    assert moved.zero_shift == pytest.approx((0.0, 0.2, 0.0, 0.0, 0.03, 0.0))
    assert moved.zero_drift_per_s == pytest.approx((0.0, 0.0, 0.0, 0.0, 0.001, 0.0))


def test_holes_of_a_batch_lie_round_their_middle() -> None:
    config = CellConfig(hole_uncertainty_mm=0.5, conditions=ConditionsConfig(hole_shift_mm=2.5, hole_shift_trials=20))
    middles = set()
    for trial in range(100):
        found = trial_world(config, 5, trial)
        middle = found.drawn["hole_shift_x_mm"], found.drawn["hole_shift_y_mm"]
        middles.add(middle)
        assert hypot(*(1e3 * a - b for a, b in zip(found.hole_in_task_m[:2], middle, strict=True))) <= 0.5
    assert len(middles) == 5
    assert max(hypot(*middle) for middle in middles) <= 2.5
    assert config.hole_reach_mm == 3.0


def test_wear_grows_evenly_from_the_beginning_of_a_series_and_ends() -> None:
    def clearance(trial: int) -> float:
        return world(trial, wear_mm=0.05, wear_trials=50).cell.peg.clearance_mm

    first = CellConfig().peg.clearance_mm
    assert [clearance(SERIES + k) - first for k in (0, 25, 50, 80)] == pytest.approx([0.0, 0.025, 0.05, 0.05])
    assert clearance(SERIES + 25) == clearance(25)


def test_peg_and_grip_are_the_only_parts_of_the_cell_that_change() -> None:
    config = CellConfig(conditions=ConditionsConfig(tilt_heading="drawn", wear_mm=0.05))
    changed = trial_world(config, 5, 70).cell
    assert replace(changed, peg=config.peg, tilt_heading_deg=0.0) == config


def test_yaw_and_lean_of_the_plate_are_drawn_for_each_trial_and_turn_the_hole() -> None:
    both = [world(trial, yaw_deg=5.0, plate_lean_mrad=17.5) for trial in range(40)]
    for each in both:
        axis = axis_of(each.hole_turn_rad)
        assert hypot(*axis[:2]) == pytest.approx(sin(17.5e-3))
        assert degrees(atan2(axis[1], axis[0])) == pytest.approx(each.drawn["plate_heading_deg"], abs=1e-4)
        # The lean adds to the yaw in second order only.
        assert degrees(each.hole_turn_rad[2]) == pytest.approx(each.drawn["hole_yaw_deg"], abs=1e-3)
    yaws = [each.drawn["hole_yaw_deg"] for each in both]
    assert -5.0 <= min(yaws) < -4.0 < 4.0 < max(yaws) <= 5.0
    assert [world(trial, yaw_deg=5.0).drawn for trial in range(40)] == [{"hole_yaw_deg": yaw} for yaw in yaws]
