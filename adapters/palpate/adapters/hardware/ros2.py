"""Adapters for an arm and a force sensor that use ROS 2: connection and sample validity."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final

from typing_extensions import override

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.clock import sleeping
from palpate.adapters.hardware.errors import translating
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.polled_sensor import PolledForceSensor, SensorTable
from palpate.adapters.hardware.served_arm import ArmTable, DriverArm, OpenArm, StandBy
from palpate.core.errors import ConfigurationError
from palpate.core.motion import Kinematics, ToolGeometry
from palpate.core.ports import CONTROL_RATE_HZ, Clock, JointVector, OneOf, Range, Settings
from palpate.drivers.ros2 import (
    JOINT_STATE,
    WRENCH,
    Ros2Arm,
    Ros2ArmSettings,
    Ros2Link,
    Ros2Network,
    Ros2Wrench,
    await_publisher,
    held,
)

_POSITIONS, _VELOCITIES = "positions", "velocities"
_NAME: Final = "ROS 2 arm"


@dataclass(frozen=True)
class Ros2Table(Settings):
    """Network settings that the arm and the force sensor share."""

    domain: Annotated[int, Range(0, 232)] = 0
    """ROS_DOMAIN_ID of the robot."""
    address: str = Ros2Network.address
    """This computer's address on the robot's network. Default: chosen by the system."""
    peers: tuple[str, ...] = Ros2Network.peers
    """Addresses of the computers that run ROS. Default: found by multicast."""

    def network(self) -> Ros2Network:
        """Return the robot's network settings."""
        return Ros2Network(self.domain, self.address, self.peers)


@dataclass(frozen=True)
class Ros2ArmTable(Ros2Table, ArmTable):
    """The ``[arm]`` table of a rig file."""

    start_timeout_s: Annotated[float, Range(0.1, 600.0)] = Ros2ArmSettings.start_s
    """Maximum time to wait for the publisher and its first message."""

    joint_states: str = "/joint_states"
    """Topic for the joint angles, sensor_msgs/msg/JointState."""
    commands: str = "/forward_position_controller/commands"
    """Command topic of a forward_command_controller, std_msgs/msg/Float64MultiArray. Its joints are in the model's
    order, base first."""
    joints: tuple[str, ...] = ()
    """Names of the joints in the messages, base first. Default: the names in the model."""
    mode: Annotated[str, OneOf(_POSITIONS, _VELOCITIES)] = _POSITIONS
    """Kind of command."""
    stops_without_commands: bool = False
    """The robot's driver stops the arm by itself when commands cease. Required for velocities."""


@dataclass(frozen=True)
class Ros2WrenchTable(Ros2Table, SensorTable):
    """The ``[force_sensor]`` table of a rig file."""

    topic: str = "/force_torque_sensor_broadcaster/wrench"
    """Topic for the wrenches, geometry_msgs/msg/WrenchStamped."""
    frame: str = "tool0"
    """frame_id in the messages. A different frame_id ends the run."""
    sign: Annotated[int, OneOf(1, -1)] = 1
    """Use -1 if the messages contain the wrench that the tool exerts on its environment."""
    rate_Hz: Annotated[float, Range(1.0, 10_000.0)] = 500.0
    """Message rate."""


class Ros2DriverArm(DriverArm):
    """An arm whose controller does not stop it by itself; therefore both processes connect to it."""

    def __init__(
        self, table: Ros2ArmTable, settings: Ros2ArmSettings, link: Callable[[], Ros2Link], context: RigContext
    ) -> None:
        clock = context.clock

        def open_bus() -> OpenArm:
            wire = link()
            return OpenArm(Ros2Arm(wire, settings, now_ns=clock.now_ns, sleep=sleeping(clock)), wire.close)

        super().__init__(_NAME, open_bus, clock, context.limiter, table)
        self._link, self._velocities = link, settings.velocities

    @override
    def run_out(self) -> float | None:
        driver = self.driver
        with translating(self.name):
            return driver.run_out() if isinstance(driver, Ros2Arm) else None

    @override
    def stand_by(self) -> StandBy:
        wire = self._link()
        with translating(self.name):
            wire.open()

        def hold(position_rad: JointVector) -> None:
            with translating(self.name):
                wire.write(held(position_rad, self._velocities))

        return StandBy(hold, wire.close)


def make_ros2_arm(table: Ros2ArmTable, context: RigContext, link: Callable[[], Ros2Link] | None = None) -> DriverArm:
    """Return an arm with a ROS 2 forward_command_controller, over a new or a given link."""
    reach = link or partial(Ros2Link, table.network(), (table.joint_states, JOINT_STATE), table.commands)
    joints = table.joints or tuple(Kinematics(context.arm, ToolGeometry()).model.names)[1:]
    if len(set(joints)) != len(context.lower_rad):
        accepted = f"{len(context.lower_rad)} names, one per joint of {context.arm.name}"
        raise ConfigurationError("arm.joints", joints, accepted)
    velocities = table.mode == _VELOCITIES
    if velocities and not table.stops_without_commands:
        accepted = "positions; velocities only with stops_without_commands = true: the controller keeps the last"
        raise ConfigurationError("arm.mode", table.mode, accepted)
    settings = Ros2ArmSettings(
        joints=joints, lower_rad=context.lower_rad, upper_rad=context.upper_rad,
        velocity_rad_s=context.velocity_limit_rad_s, period_s=table.divider / CONTROL_RATE_HZ, velocities=velocities,
        start_s=table.start_timeout_s, silence_s=Ros2ArmSettings.silence_s * table.timeout_scale,
    )  # fmt: skip
    return Ros2DriverArm(table, settings, reach, context)


class Ros2ForceSensor(PolledForceSensor[Ros2Wrench]):
    """Force sensor whose measured or estimated wrenches are published over ROS 2."""

    REMEDY = "check that the robot's driver publishes, and that its clock and this computer's are synchronised"

    def __init__(self, link: Callable[[], Ros2Link], clock: Clock, table: Ros2WrenchTable) -> None:
        super().__init__("ROS 2 wrench", clock, table)
        self._link, self._table = link, table

    @property
    @override
    def period_ns(self) -> int:
        return round(1e9 / self._table.rate_Hz)

    def reported_facts(self) -> SensorFactsTable:
        """Return the configured rate. Messages contain neither range nor noise."""
        return SensorFactsTable(rate_Hz=self._table.rate_Hz, frame="sensor")

    def _connect(self) -> None:
        wire = self._link()
        self._close_wire = wire.close
        wire.open()
        await_publisher(wire, self._start_timeout_s, sleeping(self._clock))
        self.device = Ros2Wrench(wire, self._table.frame, self._table.sign)


def make_ros2_wrench(table: Ros2WrenchTable, context: RigContext) -> Ros2ForceSensor:
    """Return a force sensor that reads wrenches from a topic."""
    return Ros2ForceSensor(lambda: Ros2Link(table.network(), (table.topic, WRENCH)), context.clock, table)
