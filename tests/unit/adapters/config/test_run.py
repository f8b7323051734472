"""Every setting refuses what it cannot use, by its own name."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from math import inf, nan
from typing import Any

import pytest

from palpate.adapters.config.run import SCENARIOS, RunConfig, scenario
from palpate.adapters.config.toml import overlay
from palpate.adapters.experiments.build import require_usable
from palpate.core.errors import ConfigurationError
from tests.unit.adapters.samples import ready_pose


def table_of(field: str, value: Any) -> dict[str, Any]:
    """The nested table that sets one field, given by its dotted name."""
    *path, name = field.split(".")
    table: dict[str, Any] = {name: value}
    for outer in reversed(path):
        table = {outer: table}
    return table


def numbers_in(config: Any, prefix: str = "") -> Iterator[tuple[str, type]]:
    """Dotted name and type of every number in a configuration."""
    for f in dataclasses.fields(config):
        value = getattr(config, f.name)
        if dataclasses.is_dataclass(value):
            yield from numbers_in(value, f"{prefix}{f.name}.")
        elif isinstance(value, (int, float)):
            yield prefix + f.name, type(value)


NUMBERS = dict(numbers_in(RunConfig()))
FLOATS = [name for name, kind in NUMBERS.items() if kind is float]
WHOLE = [name for name, kind in NUMBERS.items() if kind is int]


def require_refused(field: str, value: Any) -> None:
    with pytest.raises(ConfigurationError) as caught:
        # Gains are checked by the control laws themselves, when a task is built.
        require_usable(overlay(RunConfig(), table_of(field, value)), ready_pose())
    assert caught.value.field == field


def test_the_tables_below_are_about_something() -> None:
    assert len(FLOATS) > 40
    assert len(WHOLE) > 8


@pytest.mark.parametrize("field", FLOATS)
@pytest.mark.parametrize("value", [nan, inf, -inf, -1e300])
def test_no_number_may_be_unbounded(field: str, value: float) -> None:
    require_refused(field, value)


@pytest.mark.parametrize("field", WHOLE)
@pytest.mark.parametrize("value", [-2, 10**30])
def test_no_count_may_be_unbounded(field: str, value: int) -> None:
    require_refused(field, value)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("scenario", "papre"),
        ("arm", "puma"),
        ("seed", -1),
        ("task.start_shape", "square"),
        ("task.area_centre", "hole"),
        ("task.start_uncertainty_mm", 3.6),  # trials would start outside the area
        ("task.press_kgf", 0.1),  # would not count as contact
        ("task.max_force_N", 4.9),  # pressing alone would exceed it
        ("cell.peg.clearance_mm", -0.01),
        ("cell.peg.cross_section", "star"),
        ("perception.cutoff_Hz", 0.0),
        ("perception.cutoff_Hz", 70.0),
        ("perception.filter_order", 3),
        ("perception.features", "magic"),
        ("perception.symbols", "clouds"),
        ("perception.calibration", [1, 1, 0, 1, 1, 1]),
        ("perception.calibration", [1, nan, 1, 1, 1, 1]),
        ("perception.channels", ["x", "roll"]),
        ("perception.channels", ["x", "x"]),
        ("perception.channels", []),
        ("learning.alpha", 0.0),
        ("learning.alpha", 1.1),
        ("learning.alpha_floor", 0.31),  # above alpha itself
        ("learning.alpha_visits", -1.0),
        ("learning.gamma", 1.01),
        ("learning.temperature", 0.0),
        ("learning.temperature_decay", 1.01),
        ("learning.temperature_floor", 5.1),
        ("learning.reinforcement", "praise"),
        ("learning.effort_per_N_s", 0.1),
        ("control.damping_N_s_per_m", 10.0),
        ("control.position_gain_per_s", 1e4),
        ("control.force_integral_m_per_N_s", 1.0),
    ],
)
def test_a_refused_setting_is_named(field: str, value: Any) -> None:
    require_refused(field, value)


def test_just_below_half_the_control_rate_is_accepted() -> None:
    require_usable(overlay(RunConfig(), table_of("perception.cutoff_Hz", 69.9)), ready_pose())


@pytest.mark.parametrize(
    ("perception", "field"),
    [
        # The regions of the paper are made of x, y, tx, ty; nothing else fits them.
        ({"features": "pca"}, "perception.symbols"),
        ({"channels": ["x", "y"]}, "perception.symbols"),
        ({"symbols": "grid", "features": "som"}, "perception.symbols"),
        ({"symbols": "clusters", "features": "pca", "components": 5}, "perception.components"),
    ],
)
def test_stages_that_do_not_fit_together_are_refused(perception: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        overlay(RunConfig(), {"perception": perception})
    assert caught.value.field == field


def test_presets() -> None:
    assert set(SCENARIOS) == {"paper", "blind"}
    paper, blind = scenario("paper"), scenario("blind")
    assert paper == RunConfig()
    assert paper.cell.hole_uncertainty_mm == 0.0
    assert blind.cell.hole_uncertainty_mm == 3.0
    assert blind.task == paper.task
    with pytest.raises(ConfigurationError, match="one of paper, blind"):
        scenario("dark")
