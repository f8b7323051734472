"""The task's settings: defaults are the paper's, and nonsense is refused by name."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from math import inf, nan
from typing import Any

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.insertion.config import N_PER_KGF, ControlConfig, GoalConfig, TaskConfig
from palpate.core.ports.values import CONTROL_RATE_HZ


def test_the_defaults_are_the_papers_figures() -> None:
    task = TaskConfig()
    assert CONTROL_RATE_HZ == 140
    assert task.ticks_per_action == 14  # ten actions a second
    assert task.time_limit_s == 20.0
    assert task.contact_kgf == 0.10
    assert task.insertion_depth_mm == 10.0
    assert task.start_uncertainty_mm == 3.0
    assert N_PER_KGF == 9.80665


OUT_OF_RANGE: dict[str, list[Any]] = {
    "start_uncertainty_mm": [-0.1, 51.0],
    "start_shape": ["square"],
    "area_half_width_mm": [0.0, 51.0],
    "area_centre": ["hole"],
    "step_mm": [0.0, 5.1],
    "ticks_per_action": [1, 1401, 14.5],
    "time_limit_s": [0.0, 3601.0],
    "contact_kgf": [0.0, 11.0],
    "press_kgf": [0.01, 11.0],
    "insertion_depth_mm": [0.4, 61.0],
    "depth_tolerance_mm": [0.0, 6.0],
    "surface_uncertainty_mm": [-0.1, 5.1],
    "max_force_N": [0.5, 501.0],
    "ready_height_mm": [0.4, 101.0],
    "travel_speed_mm_s": [0.5, 101.0],
    "tare_ticks": [0, 1401, 2.5],
}


@pytest.mark.parametrize(("name", "value"), [(n, v) for n, values in OUT_OF_RANGE.items() for v in values])
def test_a_value_out_of_range_is_refused_by_its_name(name: str, value: object) -> None:
    with pytest.raises(ConfigurationError) as caught:
        replace(TaskConfig(), **{name: value})  # type: ignore[arg-type]
    assert (caught.value.field, caught.value.value) == (f"task.{name}", value)


def test_every_setting_of_the_task_is_checked() -> None:
    assert set(OUT_OF_RANGE) == set(vars(TaskConfig())) - {"goal"}


@pytest.mark.parametrize("name", [n for n, v in vars(TaskConfig()).items() if isinstance(v, (int, float))])
@pytest.mark.parametrize("value", [nan, inf])
def test_a_number_must_be_finite(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        replace(TaskConfig(), **{name: value})  # type: ignore[arg-type]
    assert caught.value.field == f"task.{name}"


@pytest.mark.parametrize("name", ["x_mm", "y_mm", "z_mm"])
@pytest.mark.parametrize("value", [-2001.0, 2001.0, nan])
def test_a_goal_must_be_near_the_arm(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        GoalConfig(**{name: value})
    assert caught.value.field == f"task.goal.{name}"


def test_pressing_must_be_harder_than_contact() -> None:
    with pytest.raises(ConfigurationError, match=r"more than task\.contact_kgf = 0\.5") as caught:
        TaskConfig(contact_kgf=0.5, press_kgf=0.5)
    assert caught.value.field == "task.press_kgf"


def test_the_force_limit_must_leave_room_for_pressing() -> None:
    with pytest.raises(ConfigurationError, match=r"more than the pressing force, 19\.6 N") as caught:
        TaskConfig(press_kgf=2.0, max_force_N=19.0)
    assert caught.value.field == "task.max_force_N"


def test_trials_may_not_start_outside_an_area_round_the_goal() -> None:
    with pytest.raises(ConfigurationError, match="outside the exploration area") as caught:
        TaskConfig(start_uncertainty_mm=3.0, area_half_width_mm=2.5)
    assert caught.value.field == "task.start_uncertainty_mm"
    literal = TaskConfig(start_uncertainty_mm=3.0, area_half_width_mm=2.5, area_centre="start")
    assert literal.area_half_width_mm == 2.5


@pytest.mark.parametrize("name", ["axial_stiffness_N_per_mm", "lateral_stiffness_N_per_mm"])
@pytest.mark.parametrize("value", [0.0, 1e6, nan])
def test_a_stiffness_must_make_sense(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError) as caught:
        ControlConfig(**{name: value})
    assert caught.value.field == f"control.{name}"


@pytest.mark.parametrize("config", [GoalConfig(), TaskConfig(), ControlConfig()])
def test_a_configuration_cannot_be_changed(config: object) -> None:
    name = next(iter(vars(config)))
    with pytest.raises(FrozenInstanceError):
        setattr(config, name, 1.0)


def test_a_wider_area_and_other_figures_are_accepted() -> None:
    TaskConfig(start_uncertainty_mm=0.0, ticks_per_action=2, press_kgf=10.0, max_force_N=500.0)
