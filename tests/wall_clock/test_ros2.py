"""The adapters behind ROS 2 against an emulated robot, by DDS over the loopback of this computer."""

import time
from collections.abc import Iterator
from typing import Any

import pytest

from palpate.adapters.config import DeviceEntry, RealTimeConfig
from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.arm_client import ArmClient, arm_in_process
from palpate.adapters.hardware.plugins import force_sensor_maker
from palpate.core.errors import DeviceError
from palpate.core.ports import JointCommand
from palpate.simulation.emulators.ros2 import Ros2Robot, Ros2Server
from tests.virtual_ros2 import HOME, NAMES
from tests.wall_clock.late import TooLateError, late_if, wait_for

pytest.importorskip("cyclonedds", reason="needs the extra ros2")
THERE = (*HOME[:5], HOME[5] + 0.3)
WRENCH = (1.5, -2.0, -10.0, 0.1, 0.2, -0.3)


class Following(Ros2Robot):
    """Joints that stand at their set-points at once."""

    def step(self, now_ns: int) -> None:
        super().step(now_ns)
        self.measured_rad(self.targets_rad())


@pytest.fixture
def server() -> Iterator[Ros2Server]:
    with Ros2Server(Following(NAMES, HOME), lambda now_ns: WRENCH, rate_Hz=250.0) as served:
        yield served


def table(server: Ros2Server, **settings: Any) -> dict[str, Any]:
    network = {"domain": server.domain, "address": server.address, "peers": (server.address,), "max_age_ms": 500.0}
    return network | settings


def owned(server: Ros2Server) -> ArmClient:
    """The arm in a process of its own."""
    context = RigContext.of("ur5e", MonotonicClock())
    settings = table(server, joints=NAMES, commands=f"/{server.commands}", patience=10.0)
    return arm_in_process(DeviceEntry("ros2", settings), context, RealTimeConfig(), 10**9)


def lead(arm: ArmClient, seconds: float) -> None:
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        arm.send(JointCommand(THERE))
        arm.read()
        time.sleep(0.007)


@pytest.mark.usefixtures("real_time")
def test_arm_is_led_and_held_where_its_process_dies(server: Ros2Server) -> None:
    with owned(server) as arm, late_if("no message|has not run", DeviceError):
        lead(arm, 0.2)
        with server.exclusive() as robot:
            led = robot.targets_rad()
        assert HOME[5] < led[5] <= THERE[5]
        process: Any = arm._host
        process._process.kill()
        killed_ns = time.monotonic_ns()
        with pytest.raises(DeviceError, match="arm's process was killed by SIGKILL"):
            lead(arm, 3.0)
        wait_for(lambda: robot.command_ns > killed_ns)
        assert robot.targets_rad()[5] == pytest.approx(led[5], abs=0.1)
        time.sleep(0.1)
        if robot.command_ns - killed_ns > 100_000_000:
            raise TooLateError("it was held after 100 ms only")


def test_wrench_is_read_and_one_that_ends_is_named(server: Ros2Server) -> None:
    context = RigContext.of("ur5e", MonotonicClock())
    with force_sensor_maker("ros2")(table(server, max_age_ms=200.0), context) as sensor:
        assert (*sensor.read().force_N, *sensor.read().torque_Nm) == WRENCH
        found = sensor.diagnostics()  # type: ignore[attr-defined]
        offered = found["publishers of /force_torque_sensor_broadcaster/wrench"]
        assert offered.startswith("geometry_msgs/msg/WrenchStamped, ")
        server.is_unplugged = True
        time.sleep(2.2)
        with pytest.raises(DeviceError, match="no message of /force_torque_sensor_broadcaster/wrench has come for"):
            sensor.read()


REFUSALS: dict[str, tuple[dict[str, Any], str]] = {
    "another topic": ({"topic": "/wrench"}, "nobody publishes /wrench in domain"),
    "wrong type": (
        {"topic": "/joint_states"}, "/joint_states carries sensor_msgs/msg/JointState, not geometry_msgs/msg/Wrench",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSALS)
def test_sensor_that_is_not_there_is_refused(server: Ros2Server, case: str) -> None:
    settings, problem = REFUSALS[case]
    sensor = force_sensor_maker("ros2")(
        table(server, start_timeout_s=1.0, **settings), RigContext.of("ur5e", MonotonicClock())
    )
    with pytest.raises(DeviceError, match=problem):
        sensor.configure()


def test_without_the_library_one_line_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.drivers.ros2.link.find_spec", lambda name: None)
    sensor = force_sensor_maker("ros2")({}, RigContext.of("ur5e", MonotonicClock()))
    with pytest.raises(Exception, match=r"cyclonedds is not installed.*pip install 'palpate\[ros2\]'"):
        sensor.configure()
