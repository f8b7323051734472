"""Bags of ROS 2, written and read by rosbags."""

import numpy as np
import pytest

from palpate.adapters.config import configured
from palpate.adapters.experiments import plain_perception, ready_pose
from palpate.adapters.log import BagTopics, describe, export_bags, info_of, log_of_bag, read_log, score_of
from palpate.adapters.log.bags import JOINT_STATE, WRENCH, joint_names
from palpate.adapters.log.series import series_of
from palpate.adapters.replay import WhatIf, replay_files
from palpate.core.errors import ConfigurationError, LogError
from tests.golden.record import HERE

pytest.importorskip("rosbags")
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
CONFIG = configured(arm="ur5")
ANY = BagTopics()
READY, PERCEPTION = ready_pose(CONFIG), plain_perception(CONFIG)


def imported(bag, out, topics=ANY):
    out.write_bytes(log_of_bag(bag, CONFIG, READY, PERCEPTION, topics))
    return read_log(out)


def made(folder, names, storage, topics=("/joint_states", "/wrench"), step_s=0.01, *, stamped=True):
    """A bag of one second; angles grow by 0.1 rad/s, forces by 1 N/s."""
    types = STORE.types

    def header(time_ns):
        time_ns *= stamped
        stamp = types["builtin_interfaces/msg/Time"](sec=time_ns // 10**9, nanosec=time_ns % 10**9)
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id="tool0")

    with Writer(folder, version=9, storage_plugin=storage) as bag:
        states, *wrenches = (
            bag.add_connection(topic, kind, typestore=STORE)
            for topic, kind in zip(topics, (JOINT_STATE, WRENCH, WRENCH), strict=False)
        )
        for tick in range(round(1.0 / step_s)):
            time_ns = 5 * 10**9 + round(tick * step_s * 1e9)
            angles, none = np.array([*READY.q_rad, 7.0])[: len(names)] + 0.1 * tick * step_s, np.zeros(0)
            state = types[JOINT_STATE](header(time_ns), list(names), angles, none, none)
            bag.write(states, time_ns, STORE.serialize_cdr(state, JOINT_STATE))
            vector = types["geometry_msgs/msg/Vector3"]
            wrench = types["geometry_msgs/msg/Wrench"](vector(tick * step_s, 0.0, 0.0), vector(0.0, 0.0, 0.1))
            for each in wrenches:
                bag.write(each, time_ns, STORE.serialize_cdr(types[WRENCH](header(time_ns), wrench), WRENCH))
    return folder


def test_trial_that_was_exported_comes_back_with_its_samples(tmp_path):
    original = HERE / "torque-ur5.mcap"
    (bag,) = export_bags([original], tmp_path / "bags")
    before, after = series_of(read_log(original)), series_of(imported(bag, tmp_path / "x.mcap"))
    ends = [(each.joints_rad[row], each.wrench[row] + each.tare.bias) for each in (before, after) for row in (10, -3)]
    for (joints, wrench), (joints_then, wrench_then) in (ends[::2], ends[1::2]):
        assert joints == pytest.approx(joints_then, abs=3e-3)
        assert wrench == pytest.approx(wrench_then, abs=1.0)
    assert after.time_s[-1] == pytest.approx(before.time_s[-1], abs=0.03)
    trial, depth_mm = score_of(read_log(tmp_path / "x.mcap")), after.tip_mm[-1, 2]
    assert (trial.basis, trial.score.duration) == ("encoders", 12.0)
    assert trial.score.success == pytest.approx(38.0 + 12.0 * depth_mm / CONFIG.task.insertion_depth_mm)
    assert "imported from a bag, which has no outcome" in describe(info_of(read_log(tmp_path / "x.mcap")))
    ((replayed,),) = replay_files([tmp_path / "x.mcap"], WhatIf(), 1)
    assert replayed.causes[0] == "the motion, which comes from a bag"


@pytest.mark.parametrize("storage", list(StoragePlugin))
def test_joints_are_found_by_name_and_samples_held_between_messages(storage, tmp_path):
    names = (*joint_names(CONFIG), "gripper")
    bag = made(tmp_path / "bag", names, storage, step_s=0.05)
    log = imported(bag, tmp_path / "x.mcap", BagTopics(sign=-1))
    records = list(log.records())
    assert len(records) == pytest.approx(140 * 0.95, abs=1)
    assert {len(record.joints.position_rad) for record in records} == {6}
    assert [record.joints.sequence for record in records[:8]] == [0] * 7 + [1]
    assert records[-1].wrench.force_N[0] == pytest.approx(-0.9)
    assert records[0].time_ns == 0


@pytest.mark.parametrize(
    ("names", "topics", "chosen", "message"),
    [
        (("a", "b"), ("/joint_states", "/wrench"), BagTopics(), r"joints must be the names of the joints in .*: a, b"),
        (None, ("/joint_states",), BagTopics(), r"no single topic of type .* it has none"),
        (None, ("/joint_states", "/one", "/two"), BagTopics(), r"it has /one, /two"),
        (None, ("/joint_states", "/wrench"), BagTopics(joint_states="/js"), r"it has /joint_states"),
    ],
)
def test_bag_that_lacks_something_is_refused(names, topics, chosen, message, tmp_path):
    bag = made(tmp_path / "bag", names or joint_names(CONFIG), StoragePlugin.MCAP, topics)
    with pytest.raises(ConfigurationError, match=message):
        imported(bag, tmp_path / "x.mcap", chosen)


def test_bag_with_one_of_two_wrenches_chosen_is_read(tmp_path):
    bag = made(tmp_path / "bag", joint_names(CONFIG), StoragePlugin.MCAP, ("/joint_states", "/one", "/two"))
    assert len(list(imported(bag, tmp_path / "x.mcap", BagTopics(wrench="/two")).records())) > 100


def test_messages_without_a_stamp_count_from_their_receipt(tmp_path):
    bag = made(tmp_path / "bag", joint_names(CONFIG), StoragePlugin.MCAP, stamped=False)
    assert len(list(imported(bag, tmp_path / "x.mcap").records())) == pytest.approx(140, abs=3)


def test_folder_that_is_no_bag_is_refused(tmp_path):
    with pytest.raises(LogError, match="is not a bag"):
        imported(tmp_path, tmp_path / "x.mcap")
