"""The task's settings: defaults are the paper's, and nonsense is refused by name."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

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


@pytest.mark.parametrize("config", [GoalConfig(), TaskConfig(), ControlConfig()])
def test_a_configuration_cannot_be_changed(config: object) -> None:
    name = next(iter(vars(config)))
    with pytest.raises(FrozenInstanceError):
        setattr(config, name, 1.0)


def test_a_wider_area_and_other_figures_are_accepted() -> None:
    TaskConfig(start_uncertainty_mm=0.0, ticks_per_action=2, press_kgf=10.0, max_force_N=500.0)
