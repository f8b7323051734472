"""The adapters behind ROS 2 against an emulated robot, by DDS over the loopback of this computer."""

import time
from itertools import pairwise

import pytest

from palpate.adapters.config import DeviceEntry, RealTimeConfig
from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.arm_client import arm_in_process
from palpate.core.errors import DeviceError
from palpate.simulation.emulators.ros2 import Ros2Robot, Ros2Server
from tests.virtual_ros2 import HOME, NAMES
from tests.wall_clock.late import TooLateError, late_if, lead, wait_for

pytest.importorskip("cyclonedds", reason="needs the extra ros2")
THERE = (*HOME[:5], HOME[5] + 3.0)


class Following(Ros2Robot):
    """Joints that stand at their set-points at once; notes what the last one was sent to, and when."""

    def __init__(self):
        super().__init__(NAMES, HOME)
        self.came = []

    def command(self, data, now_ns):
        super().command(data, now_ns)
        self.came.append((now_ns, data[5]))

    def step(self, now_ns):
        super().step(now_ns)
        self.measured_rad(self.targets_rad())


@pytest.fixture
def robot():
    return Following()


@pytest.fixture
def server(robot):
    with Ros2Server(robot, lambda now_ns: (0.0,) * 6, rate_Hz=250.0) as served:
        yield served


def table(server, **settings):
    network = {"domain": server.domain, "address": server.address, "peers": (server.address,), "max_age_ms": 500.0}
    return network | settings


def owned(server):
    """The arm in a process of its own."""
    context = RigContext.of("ur5e", MonotonicClock())
    settings = table(server, joints=NAMES, commands=f"/{server.commands}", timeout_scale=10.0)
    return arm_in_process(DeviceEntry("ros2", settings), context, RealTimeConfig(), 10**9)


def held_after_ns(robot, since_ns):
    """When it was sent no further than before."""
    came = pairwise(list(robot.came))
    return [at_ns - since_ns for (_, before), (at_ns, there) in came if at_ns > since_ns and there <= before]


@pytest.mark.usefixtures("real_time")
def test_arm_is_led_and_held_where_its_process_ends(server, robot):
    with owned(server) as arm, late_if("no message", DeviceError):
        wait_for(lambda: lead(arm, THERE, 0.05) or robot.targets_rad()[5] > HOME[5] + 0.1)
        arm._host._process.kill()
        ended_ns = time.monotonic_ns()
        with pytest.raises(DeviceError, match=r"arm's process was killed by SIGKILL"):
            lead(arm, THERE, 3.0)
        # What was sent is received a little later.
        wait_for(lambda: held_after_ns(robot, ended_ns))
    assert robot.targets_rad()[5] < THERE[5]
    if held_after_ns(robot, ended_ns)[0] > 100_000_000:
        raise TooLateError("it was held more than 0.1 s after its process had ended")
