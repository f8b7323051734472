"""The package by which LeRobot has palpate as a robot, and recorded trials as a dataset.

Where LeRobot is not installed, a STAND-IN of its classes takes its place: that shows what the package does, not that
LeRobot finds it, or what it writes.
"""

import importlib
import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from palpate.adapters.log import DecisionEntry, EndRecord, ReinforcementEntry, read_log
from palpate.core.errors import LogError
from palpate.core.ports import JointSample, Validity, WrenchSample
from tests.unit.adapters.log.made_logs import POSTURE, tick, write_log

PACKAGE = Path(__file__).parents[2] / "examples" / "lerobot_robot_palpate"
NAME = "lerobot_robot_palpate"


class StandInConfig:
    """Of LeRobot's ``RobotConfig`` that it registers kinds."""

    @classmethod
    def register_subclass(cls, name):
        def register(kind):
            cls.kinds[name] = kind
            return kind

        return register


class StandInRobot:
    """Of LeRobot's ``Robot`` nothing but that it takes a configuration."""

    def __init__(self, config):
        self.robot_type = self.name


class StandInDataset:
    """Of LeRobot's ``LeRobotDataset`` that it takes only frames that are as their features say."""

    def __init__(self, features):
        self.features, self.frames, self.episodes, self.finished = features, [], 0, False
        made.append(self)

    @classmethod
    def create(cls, repo_id, fps, features, **_):
        return cls(features)

    def add_frame(self, frame):
        assert frame.keys() == {*self.features, "task"}
        for name, feature in self.features.items():
            value = frame[name]
            if feature["dtype"] == "string":
                assert type(value) is str
            else:
                assert (value.dtype, value.shape) == (np.dtype(feature["dtype"]), tuple(feature["shape"]))
        plain = {
            name: value if isinstance(value, str) else value.item() if value.size == 1 else value.tolist()
            for name, value in frame.items()
        }
        self.frames.append({**plain, "episode_index": self.episodes})

    def save_episode(self):
        self.episodes += 1

    def finalize(self):
        self.finished = True


made = []


@pytest.fixture
def plugin(monkeypatch):
    """The package, over LeRobot or the stand-in."""
    if importlib.util.find_spec("lerobot") is None:
        parts = {
            f"lerobot{name}": ModuleType(f"lerobot{name}")
            for name in ("", ".robots", ".utils", ".utils.errors", ".datasets", ".datasets.lerobot_dataset")
        }
        errors = {
            name: type(name, (ConnectionError,), {})
            for name in ("DeviceAlreadyConnectedError", "DeviceNotConnectedError")
        }
        StandInConfig.kinds = {}
        vars(parts["lerobot.robots"]).update(Robot=StandInRobot, RobotConfig=StandInConfig)
        vars(parts["lerobot.utils.errors"]).update(errors)
        vars(parts["lerobot.datasets.lerobot_dataset"]).update(LeRobotDataset=StandInDataset)
        for name, module in parts.items():
            monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.syspath_prepend(str(PACKAGE))
    yield importlib.import_module(NAME)
    for name in [name for name in sys.modules if name.startswith(NAME)]:
        del sys.modules[name]


def test_it_records_wrench_source_times_and_the_applied_command(plugin, tmp_path):
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


@pytest.fixture
def dataset(plugin):
    """The module that writes and reads datasets."""
    made.clear()
    return importlib.import_module(f"{NAME}.dataset")


def exact(number, **changes):
    """A tick at the very time of the control rate, with a wrench of 2 ms before."""
    now = 123 + number * 1_000_000_000 // 140
    wrench = WrenchSample((0.1 * number, -1.0, 3.0), (0.01, 0.02, 0.03), now - 2_000_000, now, number)
    joints = JointSample(tuple(q + 1e-4 * number for q in POSTURE), now, now, number)
    return tick(number, time_ns=now, deadline_ns=now, wrench=wrench, joints=joints, **changes)


def frames(dataset, folder, ticks, fps, **more):
    return dataset.frames_of(read_log(write_log(folder / "a.mcap", ticks, **more)), fps)


def test_invalid_sample_leaves_the_one_before(dataset, tmp_path):
    bad = WrenchSample((0.0,) * 3, (0.0,) * 3, 5, 5, 9, Validity.INVALID)
    silent = replace(exact(0), wrench=None, requested_rad=None, applied=None)
    found = frames(dataset, tmp_path, [silent, exact(1), replace(exact(2), wrench=bad), exact(3)], 140)
    assert found["tick"].tolist() == [1, 2, 3]
    assert found["observation.wrench"][:, 0] == pytest.approx([0.1, 0.1, 0.3])
    assert found["observation.valid"].tolist() == [True, False, True]
    with pytest.raises(LogError, match="nothing to export"):
        dataset.frames_of(read_log(write_log(tmp_path / "b.mcap", [silent])), 140)


@pytest.mark.parametrize("fps", [7, 400])
def test_rewards_are_neither_lost_nor_counted_twice(dataset, tmp_path, fps):
    earned = [ReinforcementEntry(tick=k, number=k, reinforcement=-1.0 - k) for k in (0, 1, 14, 28, 28, 59)]
    found = frames(dataset, tmp_path, [exact(k) for k in range(60)], fps, others=earned)
    assert found["next.reward"].sum() == sum(entry.reinforcement for entry in earned)


@pytest.mark.parametrize(
    ("end", "success", "ended"),
    [
        (None, False, False),
        (EndRecord(tick=1, outcome="inserted", success=False), False, True),
        (EndRecord(tick=1, error="DeviceError"), False, False),
    ],
)
def test_success_by_truth_or_else_by_outcome(dataset, tmp_path, end, success, ended):
    found = frames(dataset, tmp_path, [exact(0), exact(1)], 140, end=end)
    assert (found["next.success"].tolist(), found["next.done"].tolist()) == ([False, success], [False, ended])


def test_log_is_an_episode_and_its_examples_come_back(dataset, tmp_path):
    message = [
        DecisionEntry(tick=14 * (k + 1), number=k, symbol="s", state="s", action=action, source="learned", index=index)
        for k, (action, index) in enumerate((("-x", 4), ("rest", None), ("+y", 2)))
    ]
    ends = [EndRecord(tick=69, outcome=outcome) for outcome in ("inserted", "time limit")]
    paths = [
        write_log(tmp_path / f"{k}.mcap", [exact(n) for n in range(70)], others=message, end=end)
        for k, end in enumerate(ends)
    ]
    assert dataset.export(paths, tmp_path / "out", 140) == 140
    (one,) = made
    assert (one.episodes, one.finished, len(one.frames)) == (2, True, 140)
    assert one.features["observation.state"]["names"] == [f"joint_{i}_rad" for i in range(1, 7)]
    assert one.frames[0]["task"] == "insert the round peg of 29 mm into its hole by touch"
    assert dataset.examples_in(one.frames) == [(0, 0, "s", "-x"), (0, 2, "s", "+y")]
    made.clear()
    dataset.export(paths, tmp_path / "few", 3)
    with pytest.raises(ValueError, match="more frames a second"):
        dataset.examples_in(made[0].frames)
