"""A serial CAN adapter that fails under an arm that moves: kernel terminals, threads, real time."""

import time

import pytest

from palpate.adapters.hardware import MonotonicClock, RigContext
from palpate.core.errors import DeviceError
from palpate.core.motion.arm import arm_named
from palpate.core.ports import Life
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.lines import EmulatedCanBus, PtyServer, SlcanAdapter
from palpate.simulation.emulators.motors import HOME_RAD, DirectGears, JointPlant
from tests.support.arm_thread import arm_in_thread
from tests.support.arms import driver_arm
from tests.wall_clock.late import late_if, wait_for

LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
SCALE = (30_000.0,) * 6
LONG_NS = 60 * 10**9
LATE = "silent|missing|does not answer|answers|unanswered|too late|kept the drives waiting"
"""What a driver says of a device that comes late."""


class Following(JointPlant):
    """Motors whose joints stand at their set-points at once."""

    def set_motor_counts(self, axis, counts):
        super().set_motor_counts(axis, counts)
        self.measured_rad(self.targets_rad())


@pytest.mark.usefixtures("real_time")
@pytest.mark.parametrize("line", [b"t181501234567zz\r", None], ids=["ends receiving", "unplugged"])
def test_serial_adapter_that_fails_is_noticed(line):
    motors = Following(HOME_RAD, DirectGears(SCALE))
    context = RigContext(MonotonicClock(), arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)
    bus = EmulatedCanBus([CanopenDrive(axis + 1, motors, axis) for axis in range(6)])
    with PtyServer(SlcanAdapter(bus), paced=False) as server:
        table = {
            "interface": "slcan", "channel": server.path, "counts_per_rad": list(SCALE), "divider": 4,
            "patience": 5.0,
        }  # fmt: skip
        arm = arm_in_thread(driver_arm("cia402", table, context), context.clock, LONG_NS)
        with late_if(LATE, DeviceError):
            arm.configure()
            arm.activate()
            time.sleep(0.1)
        if line is None:
            server.unplug()
        else:
            with server.exclusive():
                server._backlog += line
        wait_for(lambda: arm.life is Life.FAULTED)
        arm.stop()
        arm.close()
