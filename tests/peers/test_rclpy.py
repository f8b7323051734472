"""The real rclpy drives the emulated robot, and is driven, by unicast on the loopback: ``make ros2-check``."""

import json
import os
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from palpate.drivers.errors import DriverError
from palpate.drivers.ros2 import (
    JOINT_STATE,
    WRENCH,
    Ros2Arm,
    Ros2ArmSettings,
    Ros2Link,
    Ros2Network,
    Ros2Wrench,
    await_publisher,
)
from palpate.simulation.emulators.ros2 import Ros2Robot, Ros2Server

pytest.importorskip("cyclonedds", reason="needs the extra ros2")
# Two at a time would find each other.
pytestmark = pytest.mark.xdist_group("rclpy")
PEERS = Path(__file__).parents[2] / "runs" / "ros2-peers"
DOMAINS = {"kilted": 58, "jazzy": 59}
NAMES = ("pan", "lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
HOME = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
SETTINGS = Ros2ArmSettings(
    joints=NAMES, lower_rad=(-3.0,) * 6, upper_rad=(3.0,) * 6, velocity_rad_s=(1.0,) * 6, period_s=1 / 140,
    start_s=20.0, silence_s=0.5,
)  # fmt: skip


@pytest.fixture(params=DOMAINS)
def distribution(request):
    if not (PEERS / request.param / "installed").exists():
        pytest.skip(f"no rclpy of {request.param}: make ros2-check installs it where its wheels can be had")
    return str(request.param)


class Peer:
    """A process of rclpy."""

    def __init__(self, distribution, role, domain):
        call = [str(PEERS / distribution / "bin" / "python"), str(Path(__file__).with_name("rclpy_peer.py")), role]
        env = {**os.environ, "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(call, env=env, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)

    def ended(self):
        """What it has seen."""
        seen, _ = self.process.communicate(timeout=20)
        return json.loads(seen)


@contextmanager
def peer(distribution, role, domain):
    made = Peer(distribution, role, domain)
    try:
        yield made
    finally:
        made.process.kill()
        made.process.communicate()


@contextmanager
def opened(domain):
    arm = Ros2Arm(link(domain, "/joint_states", JOINT_STATE), SETTINGS, now_ns=time.monotonic_ns, sleep=time.sleep)
    try:
        arm.open()
        yield arm
    finally:
        arm.close()


def link(domain, topic, kind):
    network = Ros2Network(domain, "127.0.0.1", ("127.0.0.1",))
    return Ros2Link(network, (topic, kind), "/forward_position_controller/commands")


def lead(arm, ticks):
    goal = list(HOME)
    for _ in range(ticks):
        goal[5] += 0.001
        arm.cycle(goal)
        time.sleep(1 / 140)
    return tuple(goal)


def test_rclpy_robot_is_driven_until_it_leaves(distribution):
    wire = link(DOMAINS[distribution], "/force_torque_sensor_broadcaster/wrench", WRENCH)
    wrench = Ros2Wrench(wire, "tool0")
    with peer(distribution, "robot", DOMAINS[distribution]) as robot, opened(DOMAINS[distribution]) as arm:
        wire.open()
        await_publisher(wire, 10.0, time.sleep)
        arm.enable()
        goal = lead(arm, 140)
        wrench.poll(time.monotonic_ns())
        wrench.check()
        assert wrench.latest.force_N == (0.0, 0.0, -5.0)
        assert str(wrench.latest.torque_Nm[0]) == "-0.0"
        for _ in range(200):
            # A robot that comes late is waited for.
            found = arm.cycle(goal).position_rad
            time.sleep(0.01)
        assert found == pytest.approx(goal)
        seen = robot.ended()
        assert seen["commands"] >= 140
        assert seen["last"] == pytest.approx(goal)
        with pytest.raises(DriverError, match="no subscriber to /forward_position_controller/commands"):
            lead(arm, 300)
    wire.close()


def test_rclpy_client_drives_the_emulated_robot(distribution):
    robot = Ros2Robot(NAMES, HOME)
    with Ros2Server(robot, lambda now_ns: (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), rate_Hz=140.0) as server:
        with peer(distribution, "client", server.domain) as client:
            end_s = time.monotonic() + 20.0
            while robot.targets_rad()[5] < HOME[5] + 0.1 and time.monotonic() < end_s:
                robot.measured_rad(robot.targets_rad())
                time.sleep(0.002)
            seen = client.ended()
    assert HOME[5] + 0.1 <= robot.targets_rad()[5]
    assert robot.targets_rad()[:5] == HOME[:5]
    assert (seen["frame"], seen["names"], seen["force"]) == ("tool0", list(NAMES), [1.0, 2.0, 3.0])
    assert min(seen["joints"], seen["wrenches"]) > 10
