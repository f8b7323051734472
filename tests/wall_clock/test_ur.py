"""The client ur_rtde itself against an emulated controller, over sockets of this computer."""

import time
from contextlib import contextmanager
from dataclasses import replace

import pytest

from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.core.errors import DeviceError
from palpate.core.ports import Life
from palpate.drivers.errors import DriverError
from palpate.drivers.ur import UrLink
from palpate.simulation.emulators.ur import ControllerConfig, UrController, UrServer
from tests.support.arm_thread import arm_in_thread
from tests.support.arms import driver_arm
from tests.virtual_ur import HOME
from tests.wall_clock.late import TooLateError, lead, wait_for

pytest.importorskip("rtde_control", reason="needs the extra ur")
TIMEOUT_NS = 10**9
THERE = (*HOME[:5], HOME[5] + 0.3)


class Following(UrController):
    """Joints that stand at their set-points at once."""

    def step(self, now_ns):
        super().step(now_ns)
        self.measured_rad(self.targets_rad())


@contextmanager
def served(**settings):
    controller = Following(HOME, lambda now_ns: (0.0, 0.0, -5.0, 0.0, 0.0, 0.0), ControllerConfig(**settings))
    with UrServer(controller) as server:
        yield server


@pytest.fixture
def context():
    return replace(RigContext.of("ur5", MonotonicClock()), accept_kinematics=True)


def require_within(limit_s, since_s):
    if time.monotonic() - since_s > limit_s:
        raise TooLateError(f"it took more than {limit_s} s")


@pytest.mark.usefixtures("real_time")
def test_it_is_led_stops_and_is_there_again_after_a_broken_connection(context):
    with served() as server:
        made = driver_arm("ur-rtde", {"host": server.host, "timeout_scale": 4.0, "max_age_ms": 400.0}, context)
        arm = arm_in_thread(made, context.clock, TIMEOUT_NS)
        with arm:
            lead(arm, THERE, 0.4)
            wait_for(lambda: lead(arm, THERE, 0.05) or arm.read().position_rad == pytest.approx(THERE, abs=2e-3))
            arm.stop()
            server.cut()
            time.sleep(0.1)
            arm.deactivate()
            arm.activate()
            lead(arm, THERE, 0.1)
            server.cut()
            with pytest.raises(DeviceError, match="connection to 127"):
                lead(arm, THERE, 3.0)
            wait_for(lambda: arm.life is Life.FAULTED)
            arm.acknowledge_fault()
            arm.activate()
            lead(arm, THERE, 0.1)


@pytest.mark.parametrize("network", [lambda data: b"", lambda data: b"\x00\x01U"], ids=["silence", "garbage"])
@pytest.mark.usefixtures("real_time")
def test_wire_trouble_ends_in_a_named_fault_with_the_arm_at_rest_within_two_seconds(context, network):
    with served() as server:
        arm = arm_in_thread(
            driver_arm("ur-rtde", {"host": server.host, "timeout_scale": 2.0}, context), context.clock, TIMEOUT_NS
        )
        with arm:
            lead(arm, THERE, 0.1)
            with server.exclusive() as controller:
                server.network = network
            since_s = time.monotonic()
            with pytest.raises(DeviceError, match="Universal Robots arm"):
                lead(arm, THERE, 5.0)
            wait_for(lambda: arm.fault and controller.stationary)
            require_within(2.0, since_s)
            assert server.host in arm.fault


@pytest.mark.usefixtures("real_time")
def test_controller_stops_the_arm_of_a_client_that_is_killed():
    with served() as server:
        link = UrLink(server.host, 500.0)
        link.open(5.0)
        link.call("control", 5.0, 10.0)
        link.servo((*HOME[:5], 3.0), 0.007, 0.03, 1000.0)
        with server.exclusive() as controller:
            pass
        wait_for(lambda: not controller.stationary)
        link._process.kill()
        since_s = time.monotonic()
        wait_for(lambda: controller.stationary)
        require_within(1.0, since_s)
        with pytest.raises(DriverError, match="is broken"):
            wait_for(lambda: link.state() is None)
        link.close()
