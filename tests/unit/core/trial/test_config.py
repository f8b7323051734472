"""The task's settings: defaults are the paper's, and nonsense is refused by name."""

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.trial.config import TaskConfig


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
