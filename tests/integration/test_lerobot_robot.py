"""The package by which LeRobot has palpate as a robot.

Where LeRobot is not installed, a STAND-IN of its two base classes takes its place: that shows what the package does,
not that LeRobot finds it.
"""

import importlib
import importlib.util
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

PACKAGE = Path(__file__).parents[2] / "examples" / "lerobot_robot_palpate"
NAME = "lerobot_robot_palpate"


class StandInConfig:
    """Of LeRobot's ``RobotConfig`` that it registers kinds."""

    kinds: dict[str, type]

    @classmethod
    def register_subclass(cls, name: str) -> Any:
        def register(kind: type) -> type:
            cls.kinds[name] = kind
            return kind

        return register


class StandInRobot:
    """Of LeRobot's ``Robot`` nothing but that it takes a configuration."""

    def __init__(self, config: StandInConfig) -> None:
        self.robot_type = self.name  # type: ignore[attr-defined]


@pytest.fixture
def plugin(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The package, over LeRobot or the stand-in."""
    if importlib.util.find_spec("lerobot") is None:
        parts = {
            name: ModuleType(name) for name in ("lerobot", "lerobot.robots", "lerobot.utils", "lerobot.utils.errors")
        }
        errors = {
            name: type(name, (ConnectionError,), {})
            for name in ("DeviceAlreadyConnectedError", "DeviceNotConnectedError")
        }
        StandInConfig.kinds = {}
        vars(parts["lerobot.robots"]).update(Robot=StandInRobot, RobotConfig=StandInConfig)
        vars(parts["lerobot.utils.errors"]).update(errors)
        for name, module in parts.items():
            monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.syspath_prepend(str(PACKAGE))
    yield importlib.import_module(NAME)
    for name in [name for name in sys.modules if name.startswith(NAME)]:
        del sys.modules[name]


def test_lerobot_finds_it_by_its_name_and_its_module_by_that() -> None:
    project = tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]
    # LeRobot imports what a distribution is called, when that begins with lerobot_robot_.
    assert project["name"] == NAME
    assert (PACKAGE / NAME / "__init__.py").is_file()


def test_it_records_wrench_source_times_and_the_applied_command(plugin: Any, tmp_path: Path) -> None:
    settings = tmp_path / "quick.toml"
    settings.write_text("[task]\ntime_limit_s = 0.6\n[cell]\nhole_uncertainty_mm = 3.0\n")
    config = plugin.PalpateConfig(settings=str(settings), seed=3)
    robot = plugin.Palpate(config)
    assert not robot.is_connected
    robot.connect()
    first = robot.get_observation()
    assert first.keys() == robot.observation_features.keys()
    assert first["force_z_N"] != 0.0
    assert robot.send_action({"delta_x": 3.0, "delta_y": 4.0, "delta_z": 9.0}) == {"delta_x": 0.6, "delta_y": 0.8}
    then = robot.get_observation()
    # A step is 14 ticks, each with a new sample.
    elapsed_s = sum(
        (then[name] - first[name]) * unit for name, unit in (("wrench_source_s", 1.0), ("wrench_source_us", 1e-6))
    )
    assert elapsed_s == pytest.approx(0.1, abs=2e-6)
    assert 0.0 <= then["wrench_age_s"] < 0.05
    assert [then[f"applied_{k}_rad"] for k in (1, 2)] != [first[f"applied_{k}_rad"] for k in (1, 2)]
    while not robot.get_observation()["trial_over"]:
        robot.send_action({"delta_x": 0.0, "delta_y": 0.0})
    robot.send_action({"delta_x": 0.0, "delta_y": 0.0})
    assert robot.get_observation()["trial_over"] == 1.0
    robot.send_action({"delta_x": 0.1, "delta_y": 0.0})
    again = robot.get_observation()
    assert (again["trial"], again["trial_over"]) == (first["trial"] + 1.0, 0.0)
    robot.disconnect()
    with pytest.raises(ConnectionError, match="connect"):
        robot.get_observation()
    with pytest.raises(ValueError, match="not the number of joints"):
        plugin.Palpate(plugin.PalpateConfig(joints=7)).connect()
