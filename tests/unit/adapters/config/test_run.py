"""Settings that do not go with others, or that only the objects made of them can judge, are refused by their names."""

import inspect
import re
from dataclasses import replace
from pathlib import Path
from tomllib import loads
from typing import Any

import pytest

from palpate.adapters.config import compose, overlay, task_kind, to_toml
from palpate.adapters.config.compose import scenario
from palpate.adapters.config.run import RunConfig
from palpate.adapters.config.scenarios import JOB, SCENARIOS
from palpate.adapters.experiments.build import ready_pose as ready_pose_of
from palpate.adapters.experiments.build import require_usable
from palpate.core.errors import ConfigurationError
from palpate.core.trial import find_ready_pose
from tests.unit.adapters.samples import ready_pose


def table_of(field: str, value: Any) -> dict[str, Any]:
    """The nested table that sets one field, given by its dotted name."""
    *path, name = field.split(".")
    table: dict[str, Any] = {name: value}
    for outer in reversed(path):
        table = {outer: table}
    return table


def require_refused(field: str, value: Any) -> None:
    with pytest.raises(ConfigurationError) as caught:
        # Gains are checked by the control laws themselves, when a task is built.
        require_usable(overlay(RunConfig(), table_of(field, value)), ready_pose())
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("arm", "puma"),
        ("task.start_uncertainty_mm", 3.6),  # trials would start outside the area
        ("task.press_kgf", 0.1),  # would not count as contact
        ("task.max_force_N", 4.9),  # pressing alone would exceed it
        ("task.insertion_depth_mm", 0.7),  # the plate itself may lie as deep
        ("learning.alpha_floor", 0.31),  # above alpha itself
        ("learning.temperature_floor", 5.1),
        ("control.damping_N_s_per_m", 10.0),
        ("control.position_gain_per_s", 1e4),
        ("control.force_integral_m_per_N_s", 1.0),
        *(
            (f"control.{gain}", -1e300)
            for gain in ("damping_N_s_per_m", "position_gain_per_s", "force_proportional_m_per_N")
        ),
    ],
)
def test_a_refused_setting_is_named(field: str, value: Any) -> None:
    require_refused(field, value)


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


@pytest.mark.parametrize("name", ["insertion", "insertion-6dof"])
def test_a_force_that_ends_a_trial_latches_as_the_task_comes(name: str) -> None:
    config = overlay(RunConfig(), task_kind(name).preset)
    assert config.supervision.max_force_N <= config.task.max_force_N


def test_presets() -> None:
    paper, blind = scenario("paper"), scenario("blind")
    assert paper == RunConfig()
    assert paper.cell.hole_uncertainty_mm == 0.0
    assert blind.cell.hole_uncertainty_mm == 3.0
    assert (paper.perception.position_threshold_mm, blind.perception.position_threshold_mm) == (1.0, 50.0)
    assert blind.task == paper.task
    with pytest.raises(ConfigurationError, match="one of paper, blind"):
        scenario("dark")


@pytest.mark.parametrize("learner", ["q-learning", "belief"])
def test_where_the_sensor_is_noisy_the_tool_presses_harder(learner: str) -> None:
    noisy, quiet = scenario("blind-noise", learner), scenario("blind", learner)
    require_usable(noisy, find_ready_pose(noisy.arm, noisy.tool.geometry, noisy.task))
    assert noisy.task.press_kgf > quiet.task.press_kgf
    assert noisy.task.contact_kgf > quiet.task.contact_kgf


# Without a job file the preset job is the paper's.
PRESETS = {name: scenario(name) for name in SCENARIOS if name != JOB}
TURNED_MRAD = 10.0
"""Beyond it a tool that does not turn cannot tell the depth as well as is asked."""


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_can_be_run_differs_from_the_others_and_is_told_of(name: str) -> None:
    config = scenario(name)
    usable = compose(name, task="insertion-6dof") if config.place.tilt_uncertainty_mrad > TURNED_MRAD else config
    require_usable(usable, ready_pose_of(usable))
    assert config.scenario == name
    assert overlay(RunConfig(), loads(to_toml(config))) == config
    assert sum(replace(other, scenario=name) == config for other in PRESETS.values()) == 1
    assert config.cell.hole_reach_mm <= config.task.area_half_width_mm
    declared = inspect.getsource(RunConfig)
    page = Path(__file__).parents[4] / "docs" / "how-to" / "choose-conditions.md"
    assert re.search(rf"\b{name}\b", declared)
    assert f"| `{name}` |" in page.read_text(encoding="utf-8")


def test_a_hole_deeper_than_it_comes_is_used_by_policies_without_states_of_their_own() -> None:
    # Their perception was made of the task and a hole as it comes, which refused the two.
    config = overlay(RunConfig(), {"cell": {"peg": {"hole_depth_mm": 18.0}}})
    config = overlay(config, {"task": {"insertion_depth_mm": 18.0}})
    require_usable(config, find_ready_pose(config.arm, config.tool.geometry, config.task))
