"""Checks of settings: what is refused, and what the refusal says."""

from math import inf, nan
from typing import Any

import pytest

from palpate.core.errors import ConfigurationError, PalpateError, require_in, require_one_of, require_whole


@pytest.mark.parametrize("value", [1.0, 1, 1.5, 2.0, 2])
def test_a_number_of_the_range_passes_ends_included(value: float) -> None:
    require_in("a.b", value, 1.0, 2.0)


@pytest.mark.parametrize("value", [0.999, 2.001, nan, inf, -inf, "1.5", None, [1.5]])
def test_what_is_not_a_number_of_the_range_is_refused(value: Any) -> None:
    with pytest.raises(ConfigurationError) as caught:
        require_in("task.step_mm", value, 1.0, 2.0)
    assert str(caught.value) == f"task.step_mm = {value!r} is refused: a number from 1 to 2"
    assert caught.value.field == "task.step_mm"
    assert caught.value.accepted == "a number from 1 to 2"
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, PalpateError)


@pytest.mark.parametrize("value", [1, 2, 10])
def test_a_whole_number_passes(value: int) -> None:
    require_whole("a.b", value, 1, 10)


@pytest.mark.parametrize("value", [0, 11, 2.0, 2.5, nan, True, "2", None])
def test_what_is_not_a_whole_number_of_the_range_is_refused(value: Any) -> None:
    with pytest.raises(ConfigurationError, match="a whole number from 1 to 10") as caught:
        require_whole("task.tare_ticks", value, 1, 10)
    assert caught.value.field == "task.tare_ticks"


def test_a_known_name_passes() -> None:
    require_one_of("a.b", "disc", ("disc", "ball"))


@pytest.mark.parametrize("value", ["Disc", "", "discball"])
def test_an_unknown_name_is_refused_with_the_known_ones(value: str) -> None:
    with pytest.raises(ConfigurationError, match="one of disc, ball") as caught:
        require_one_of("task.start_shape", value, ("disc", "ball"))
    assert caught.value.value == value


def test_a_long_value_is_cut_short_in_the_message() -> None:
    with pytest.raises(ConfigurationError) as caught:
        require_one_of("a.b", "x" * 1000, ("disc",))
    assert len(str(caught.value)) < 150
    assert caught.value.value == "x" * 1000
