"""Import and export of ROS 2 bags (rosbag2, MCAP or SQLite) with joint states, wrenches and commands.

This module uses the rosbags library from the ``ros2`` extra. In each message, joints are identified by name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from palpate.adapters.config import RunConfig, simulated_noise
from palpate.adapters.files import new_folder
from palpate.adapters.log.container import LogFile, RawMessage
from palpate.adapters.log.export_csv import names_for
from palpate.adapters.log.json_text import dump_json
from palpate.adapters.log.messages import encode
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.records import IMPORTED, EndRecord, EventEntry, StartRecord, TickRecord
from palpate.adapters.log.schema import BY_RECORD, SCHEMA
from palpate.adapters.log.series import config_of
from palpate.adapters.log.trial_recorder import start_facts
from palpate.adapters.log.world import sensor_facts
from palpate.core.errors import ConfigurationError, LogError, UsageError
from palpate.core.motion import Kinematics, arm_named
from palpate.core.perception import Perception
from palpate.core.ports import CONTROL_RATE_HZ, AppliedCommand, JointSample, WrenchSample
from palpate.core.trial import ReadyPose

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

JOINT_STATE: Final = "sensor_msgs/msg/JointState"
WRENCH: Final = "geometry_msgs/msg/WrenchStamped"
COMMANDS: Final = "std_msgs/msg/Float64MultiArray"
TEXT: Final = "std_msgs/msg/String"
_TOPICS: Final = {
    JOINT_STATE: "/joint_states",
    WRENCH: "/force_torque_sensor_broadcaster/wrench",
    COMMANDS: "/forward_position_controller/commands",
    TEXT: "/palpate/events",
}
_FRAME: Final = "sensor"
_NS: Final = 1_000_000_000


@dataclass(frozen=True)
class BagTopics:
    """Topics and conventions for reading a bag.

    Attributes:
        joint_states, wrench: Topics. If empty, the only topic of the required type is used.
        joints: Joint names in the messages, base first; empty to use the model's.
        sign: -1 if the wrenches are those that the tool exerts on its environment.
    """

    joint_states: str = ""
    wrench: str = ""
    joints: tuple[str, ...] = ()
    sign: int = 1


def joint_names(config: RunConfig) -> tuple[str, ...]:
    """Return the joint names in the arm's model, base first."""
    return tuple(Kinematics(arm_named(config.arm), config.tool.geometry).model.names)[1:]


def log_of_bag(bag: Path, config: RunConfig, ready: ReadyPose, perception: Perception, topics: BagTopics) -> bytes:
    """Convert a bag to a log at the control rate, with the latest sample of each kind at every tick.

    The commands are the measured joint angles, because a bag does not show what caused a motion. The policy is the
    torque rule, so that a replay with a different policy shows that policy's perception and choices.

    Raises:
        LogError: The bag cannot be read, or has no joint states or wrenches.
        ConfigurationError: A topic or a joint name is not in the bag.
    """
    names = topics.joints or joint_names(config)
    records: list[Any] = [
        _start(config, ready, perception, bag),
        EventEntry(tick=0, name="phase", detail=IMPORTED),
        *_ticks(bag, names, topics),
    ]
    if len(records) < 3:
        raise LogError(str(bag), "", "has no time with both joint states and wrenches", "name a bag with both")
    records.append(EndRecord(tick=records[-1].tick, outcome=IMPORTED, ticks=len(records) - 2))
    stream = BytesIO()
    log = LogFile(stream, {"schema": SCHEMA, "command": "import", "arm": str(config.arm)})
    log.add(
        RawMessage(
            BY_RECORD[type(each)].id, max(getattr(each, "tick", 0), 0) * _NS // CONTROL_RATE_HZ, encode(each), number
        )
        for number, each in enumerate(records)
    )
    log.finish()
    return stream.getvalue()


def export_bags(paths: Sequence[Path], out: Path) -> list[Path]:
    """Write each log as a bag with MCAP storage that contains samples, commands, and events as text.

    Times are on the run's clock. Returns the folders of the bags.

    Raises:
        LogError: A log cannot be read; nothing is written.
        OutputError: The folder cannot be written.
    """
    store = _store()
    from rosbags.rosbag2 import StoragePlugin, Writer

    names = names_for(paths)
    with new_folder(out) as passing:
        for path, name in zip(paths, names, strict=True):
            log = read_log(path)
            with Writer(passing / name, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
                topics = {kind: bag.add_connection(topic, kind, typestore=store) for kind, topic in _TOPICS.items()}
                for kind, time_ns, message in _messages(log, store.types):
                    bag.write(topics[kind], max(time_ns, 0), store.serialize_cdr(message, kind))
    return [out / name for name in names]


def _messages(log: TrialLog, types: dict[str, Any]) -> Iterator[tuple[str, int, Any]]:
    """Yield the kind, time and message of each new sample, command and event."""
    names, times_ns = list(joint_names(config_of(log))), dict[int, int]()
    seen_joints = seen_wrench = None

    def header(time_ns: int, frame: str) -> Any:
        stamp = types["builtin_interfaces/msg/Time"](sec=time_ns // _NS, nanosec=time_ns % _NS)
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    for record in log.records():
        joints, wrench, applied = record.joints, record.wrench, record.applied
        if joints is not None and joints.sequence != seen_joints:
            seen_joints, none = joints.sequence, np.zeros(0)
            angles = np.array(joints.position_rad)
            head = header(joints.source_time_ns, "")
            state = types[JOINT_STATE](header=head, name=names, position=angles, velocity=none, effort=none)
            yield JOINT_STATE, joints.source_time_ns, state
        if wrench is not None and wrench.sequence != seen_wrench:
            seen_wrench = wrench.sequence
            force, torque = (
                types["geometry_msgs/msg/Vector3"](**dict(zip("xyz", each, strict=True)))
                for each in (wrench.force_N, wrench.torque_Nm)
            )
            stamped = types[WRENCH](
                header=header(wrench.source_time_ns, wrench.frame or _FRAME),
                wrench=types["geometry_msgs/msg/Wrench"](force=force, torque=torque),
            )
            yield WRENCH, wrench.source_time_ns, stamped
        times_ns[record.tick] = record.time_ns or 0
        if applied is not None and record.time_ns is not None:
            layout = types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
            yield COMMANDS, record.time_ns, types[COMMANDS](layout=layout, data=np.array(applied.position_rad))
    for event in log.events:
        text = f"{event.name}: {event.detail}".removesuffix(": ")
        yield TEXT, times_ns.get(event.tick, 0), types[TEXT](data=text)


def _ticks(bag: Path, names: tuple[str, ...], topics: BagTopics) -> Iterator[TickRecord]:
    """Yield ticks, beginning when the joints and the wrench are first known."""
    joints: JointSample | None = None
    wrench: WrenchSample | None = None
    begun_ns: int | None = None
    tick, before_ns = 0, 0
    for time_ns, kind, message in _samples(bag, topics):
        if joints is not None and wrench is not None:
            begun_ns = before_ns if begun_ns is None else begun_ns
            while (due_ns := begun_ns + tick * _NS // CONTROL_RATE_HZ) < time_ns:
                yield _tick(tick, due_ns - begun_ns, begun_ns, joints, wrench)
                tick += 1
        before_ns = time_ns
        if kind == JOINT_STATE:
            angles = _angles(bag, names, message)
            joints = JointSample(angles, time_ns, time_ns, 0 if joints is None else joints.sequence + 1)
        else:
            force, torque = message.wrench.force, message.wrench.torque
            values = [topics.sign * value for value in (force.x, force.y, force.z, torque.x, torque.y, torque.z)]
            number = 0 if wrench is None else wrench.sequence + 1
            wrench = WrenchSample(tuple(values[:3]), tuple(values[3:]), time_ns, time_ns, number)


def _tick(tick: int, time_ns: int, begun_ns: int, joints: JointSample, wrench: WrenchSample) -> TickRecord:
    def based(sample: Any) -> Any:
        since_ns = max(sample.source_time_ns - begun_ns, 0)
        return replace(sample, source_time_ns=since_ns, receive_time_ns=since_ns)

    angles = joints.position_rad
    return TickRecord(tick, time_ns, time_ns, based(wrench), based(joints), angles, AppliedCommand(angles))


def _angles(bag: Path, names: tuple[str, ...], message: Any) -> tuple[float, ...]:
    """Return the joint angles in the model's order."""
    found = dict(zip(message.name, message.position.tolist(), strict=False))
    if missing := [name for name in names if not isfinite(found.get(name, float("nan")))]:
        accepted = f"the names of the joints in {bag}: {', '.join(message.name)}"
        raise ConfigurationError("joints", ", ".join(missing), accepted)
    return tuple(found[name] for name in names)


def _samples(bag: Path, topics: BagTopics) -> Iterator[tuple[int, str, Any]]:
    """Yield the measurement time, kind and message of each sample, in bag order."""
    store = _store()
    from rosbags.highlevel import AnyReader, AnyReaderError

    if not bag.exists():
        raise LogError(str(bag), "", "is not there", "name a folder that ros2 bag recorded")
    try:
        with AnyReader([bag], default_typestore=store) as reader:
            chosen = [
                _only(bag, reader.connections, JOINT_STATE, "joint_states", topics.joint_states),
                _only(bag, reader.connections, WRENCH, "wrench", topics.wrench),
            ]
            for connection, received_ns, data in reader.messages(connections=chosen):
                message: Any = reader.deserialize(data, connection.msgtype)
                stamp = message.header.stamp
                # A driver that leaves its stamps at zero has only the time of receipt.
                yield stamp.sec * _NS + stamp.nanosec or received_ns, connection.msgtype, message
    except (AnyReaderError, OSError) as error:
        raise LogError(str(bag), "", f"is not a bag ({error})", "name a folder that ros2 bag recorded") from error


def _only(bag: Path, connections: Sequence[Connection], kind: str, option: str, topic: str) -> Connection:
    """Return the connection for a topic, or the only connection of its type."""
    found = [each for each in connections if each.msgtype == kind and topic in ("", each.topic)]
    if len({each.topic for each in found}) == 1:
        return found[0]
    there = ", ".join(sorted({each.topic for each in connections if each.msgtype == kind})) or "none"
    raise ConfigurationError(option, topic, f"no single topic of type {kind} in {bag}: it has {there}")


def _store() -> Any:
    try:
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError("bags need rosbags: pip install 'palpate[ros2]'") from None
    return get_typestore(Stores.ROS2_JAZZY)


def _start(config: RunConfig, ready: ReadyPose, perception: Perception, bag: Path) -> StartRecord:
    return StartRecord(
        **start_facts("import", config, ready, perception),
        seed=config.seed,
        trial=0,
        start_m=(0.0, 0.0),
        policy="torque",
        frozen=True,
        world=f"bag {bag.name}",
        world_json=dump_json(sensor_facts(simulated_noise(config))),
    )
