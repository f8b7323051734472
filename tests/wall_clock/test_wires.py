"""Each wire once as it is on a rig: adapters with their threads, kernel terminals, real time; the emulator is near."""

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import pytest

from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.adapters.hardware.plugins import force_sensor_maker
from palpate.adapters.hardware.served_arm import DriverArm
from palpate.core.errors import DeviceError
from palpate.core.motion.arm import arm_named
from palpate.core.ports import Clock, CommandReason, ForceSensor, JointCommand, Life, Validity
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.cia402.servo import PowerState
from palpate.simulation.emulators.jr3 import Jr3CanNode, Jr3Config
from palpate.simulation.emulators.lines import EmulatedCanBus, PtyServer, SlcanServer
from palpate.simulation.emulators.motors import HOME_RAD, DirectMotors
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.arm_thread import arm_in_thread
from tests.support.arms import driver_arm
from tests.support.ideal_motors import IdealPlant
from tests.wall_clock.late import late_if, wait_for

pytestmark = pytest.mark.usefixtures("real_time")
LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
LONG_NS = 60 * 10**9
LATE = "silent|missing|does not answer|delivers no|answers|no reply in time|failures in a row|unanswered"
"""What a driver says of a device that comes late."""


@pytest.fixture
def context() -> RigContext:
    return RigContext(MonotonicClock(), arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)


@pytest.fixture
def served() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


class Following(DirectMotors):
    """Motors whose joints stand at their set-points at once."""

    def set_motor_counts(self, axis: int, counts: float) -> None:
        super().set_motor_counts(axis, counts)
        self.measured_rad(self.targets_rad())


class Load:
    """What presses on the emulated sensor."""

    def __init__(self) -> None:
        self.fz_N = 0.0

    def __call__(self, now_ns: int) -> tuple[float, ...]:
        return (0.0, 0.0, self.fz_N, 0.0, 0.0, 0.0)


def slcan(served: ExitStack, *nodes: Any) -> SlcanServer:
    return served.enter_context(SlcanServer(EmulatedCanBus(nodes)))


def move_and_stop(made: DriverArm, clock: Clock) -> None:
    """A small move, a stop in its middle of life, and the angles in between."""
    with arm_in_thread(made, clock, LONG_NS) as arm:
        start = arm.read()
        assert start.validity is Validity.VALID
        assert start.position_rad == pytest.approx(HOME_RAD, abs=2e-4)
        goal = tuple(q + 0.002 for q in HOME_RAD)
        applied = arm.send(JointCommand(goal))
        assert (applied.reason, applied.position_rad) == (CommandReason.AS_ASKED, goal)
        wait_for(lambda: arm.read().position_rad == pytest.approx(goal, abs=2e-4), 2.0)
        arm.stop()
        assert arm.send(JointCommand(HOME_RAD)).reason is CommandReason.STOPPED
        wait_for(lambda: arm.read().sequence > start.sequence + 20, 2.0)
        assert arm.read().position_rad == pytest.approx(goal, abs=2e-4)


def test_nmc_on_a_terminal(context: RigContext, served: ExitStack) -> None:
    plant = IdealPlant()
    server = served.enter_context(PtyServer(NmcChain(plant)))
    table = {
        "port": server.path,
        "baud": 230_400,
        "adapter_latency_ms": 0.0,
        "divider": 2,
        "at_home": True,
        "patience": 2.0,
    }
    with late_if(LATE, DeviceError):
        move_and_stop(driver_arm("zebra-nmc", table, context), context.clock)
    assert plant.joints_rad() == pytest.approx([q + 0.002 for q in HOME_RAD], abs=2e-4)


@pytest.fixture
def drives() -> list[CanopenDrive]:
    motors = Following((30_000.0,) * 6, HOME_RAD)
    return [CanopenDrive(axis + 1, motors, axis) for axis in range(6)]


CIA402 = {"interface": "slcan", "counts_per_rad": [30_000.0] * 6, "divider": 2, "patience": 5.0}


def test_cia402_on_a_serial_adapter(context: RigContext, served: ExitStack, drives: list[CanopenDrive]) -> None:
    server = slcan(served, *drives)
    with late_if(LATE, DeviceError):
        move_and_stop(driver_arm("cia402", {**CIA402, "channel": server.channel}, context), context.clock)
    assert {drive.machine.state for drive in drives} == {PowerState.SWITCH_ON_DISABLED}


@pytest.mark.parametrize("line", [b"t181501234567zz\r", None], ids=repr)
def test_an_adapter_that_ends_receiving_or_is_unplugged_is_noticed(
    context: RigContext, served: ExitStack, drives: list[CanopenDrive], line: bytes | None
) -> None:
    server = slcan(served, *drives)
    arm = arm_in_thread(
        driver_arm("cia402", {**CIA402, "channel": server.channel, "divider": 4}, context), context.clock, LONG_NS
    )
    with late_if(LATE, DeviceError):
        arm.configure()
        arm.activate()
        time.sleep(0.1)
    if line is None:
        server.unplug()
    else:
        server.inject(line)
    wait_for(lambda: arm.life is Life.FAULTED)
    arm.stop()
    arm.close()


def read_and_press(sensor: ForceSensor, load: Load) -> None:
    with sensor:
        before = sensor.read()
        assert before.validity is Validity.VALID
        load.fz_N = 20.0
        wait_for(lambda: abs(sensor.read().force_N[2] - before.force_N[2]) > 19.9, 2.0)
        after = sensor.read()
        assert after.validity is Validity.VALID
        assert after.sequence > before.sequence
        assert abs(after.force_N[2] - before.force_N[2]) == pytest.approx(20.0, abs=0.1)


def test_jr3_on_a_serial_can_adapter(context: RigContext, served: ExitStack) -> None:
    load = Load()
    node = Jr3CanNode(1, load, replace(Jr3Config(), boot_ns=1_000_000))
    server = slcan(served, node)
    with late_if(LATE, DeviceError):
        read_and_press(force_sensor_maker("jr3-can")({"interface": "slcan", "channel": server.channel}, context), load)
