"""Proof that an unmodified LeRobot finds ``lerobot_robot_palpate`` and records with it, by LeRobot's own loop.

LeRobot gets an environment of its own, with palpate and the package in it:

    python3 -m venv /tmp/lerobot && /tmp/lerobot/bin/pip install lerobot . examples/lerobot_robot_palpate
    HF_HUB_OFFLINE=1 /tmp/lerobot/bin/python benchmarks/lerobot_robot.py /tmp/recorded
"""

from __future__ import annotations

import argparse
from importlib.metadata import version
from pathlib import Path
from typing import Any

from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.datasets.utils import hw_to_dataset_features
from lerobot.processor import make_default_processors
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.scripts.lerobot_record import record_loop
from lerobot.teleoperators import Teleoperator, TeleoperatorConfig
from lerobot.utils.import_utils import register_third_party_plugins

FPS = 10
SECONDS = 4


class Wanderer(Teleoperator):
    """Leads the peg round and round."""

    config_class = TeleoperatorConfig
    name = "wanderer"
    feedback_features: dict[str, type] = {}  # noqa: RUF012
    action_features = {"delta_x": float, "delta_y": float}  # noqa: RUF012
    is_connected = is_calibrated = True

    def __init__(self) -> None:
        self._steps = 0

    def connect(self, calibrate: bool = True) -> None:
        """It is."""

    calibrate = configure = disconnect = send_feedback = lambda *_: None

    def get_action(self) -> dict[str, float]:
        """The next side of a square."""
        self._steps += 1
        x, y = ((1, 0), (0, 1), (-1, 0), (0, -1))[self._steps // 3 % 4]
        return {"delta_x": 0.5 * x, "delta_y": 0.5 * y}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    register_third_party_plugins()
    robot: Any = make_robot_from_config(RobotConfig.get_choice_class("palpate")(id="cell", seed=3))
    features = {
        **hw_to_dataset_features(robot.action_features, "action"),
        **hw_to_dataset_features(robot.observation_features, "observation"),
    }
    dataset = LeRobotDataset.create("palpate/recorded", FPS, root=out, robot_type=robot.name, features=features)
    shown: list[dict[str, float]] = []
    with robot:
        seen = robot.get_observation

        def observe() -> dict[str, float]:
            shown.append(seen())
            return shown[-1]

        robot.get_observation = observe
        events = {"exit_early": False}
        processors = make_default_processors()
        record_loop(
            robot, events, FPS, *processors, dataset=dataset, teleop=Wanderer(), control_time_s=SECONDS,
            single_task="insert the peg",
        )  # fmt: skip
        dataset.save_episode()
    dataset.finalize()
    again = LeRobotDataset("palpate/recorded", root=out)
    names = again.features["observation.state"]["names"]
    for row, told in zip(again, shown, strict=True):
        for name, value in zip(names, row["observation.state"].tolist(), strict=True):
            if abs(value - told[name]) > 1e-6 * max(1.0, abs(told[name])):
                raise SystemExit(f"frame {row['frame_index']}: {name} is {value}, the robot gave {told[name]}")
    print(f"lerobot {version('lerobot')}: found {type(robot).__module__}.{type(robot).__name__} by itself")
    print(f"{again.num_frames} frames at {again.fps} Hz, {len(names)} numbers each, all as the robot gave them")


if __name__ == "__main__":
    main()
