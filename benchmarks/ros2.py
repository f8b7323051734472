"""A ROS 2 arm over the loopback: delay from the latest wrench to the command, and stops when the arm process dies.

    python -m benchmarks.ros2 --times 100     100 deaths of the arm's process, commanding positions and velocities
    python -m benchmarks.ros2 --times 0       latency only

The emulated robot, whose joints follow their set-points exactly, is a thread of this process that checks for commands
every 2 ms. The arm process is killed with SIGKILL while it moves a joint at 0.5 rad/s. The result is the time until the
robot receives a command from this process that holds it, or zero velocities.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from palpate.adapters.config import DeviceEntry, RealTimeConfig
from palpate.adapters.hardware.arm_client import ArmClient, arm_in_process
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import RigContext, force_sensor_maker
from palpate.adapters.hardware.real_time import RealTime, take_real_time
from palpate.core.errors import PalpateError
from palpate.core.ports import CONTROL_RATE_HZ, JointCommand, JointVector
from palpate.simulation.emulators.ros2 import Ros2Robot, Ros2Server

HOME: JointVector = (0.1, -1.2, 1.3, -1.6, -1.5, 0.2)
NAMES = ("pan", "lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
SPEED_RAD_S, STEP_RAD = 0.5, 1e-7
ALLOWED_MS = 100.0
EMULATED_PRIORITY = 30
NS = 10**9


class Robot(Ros2Robot):
    """Robot whose joints follow their set-points exactly, and which records each command with its arrival time."""

    def __init__(self, *, velocities: bool = False) -> None:
        super().__init__(NAMES, HOME, velocities=velocities)
        self.velocities = velocities
        self.came: list[tuple[int, tuple[float, ...]]] = []

    def command(self, data: Sequence[float], now_ns: int) -> None:
        super().command(data, now_ns)
        self.came.append((time.monotonic_ns(), tuple(data)))

    def step(self, now_ns: int) -> None:
        super().step(now_ns)
        self.measured_rad(self.targets_rad())


@contextmanager
def bench(robot: Robot, rt: bool) -> Iterator[tuple[Ros2Server, ArmClient, RigContext]]:
    begun_ns = time.monotonic_ns()
    if rt:
        # The emulated robot's threads inherit it.
        take_real_time(EMULATED_PRIORITY)
    with Ros2Server(robot, lambda now_ns: ((now_ns - begun_ns) * 1e-9, 0.0, 0.0, 0.0, 0.0, begun_ns * 1e-9)) as server:
        context = RigContext.of("ur5e", MonotonicClock())
        settings = {
            "domain": server.domain, "address": server.address, "peers": (server.address,), "joints": NAMES,
            "commands": f"/{server.commands}", "timeout_scale": 10.0,
        }  # fmt: skip
        if robot.velocities:
            settings |= {"mode": "velocities", "stops_without_commands": True}
        yield server, arm_in_process(DeviceEntry("ros2", settings), context, RealTimeConfig(scheduling=rt), NS), context


def ticks(clock: MonotonicClock, count: int) -> Iterator[int]:
    """Yield ticks at the control rate."""
    start_ns = clock.now_ns()
    for tick in range(count):
        clock.sleep_until(start_ns + tick * NS // CONTROL_RATE_HZ)
        yield tick


def latency(seconds: float, rt: bool) -> None:
    robot, sent = Robot(), dict[int, float]()
    with bench(robot, rt) as (server, arm, context):
        table = {"domain": server.domain, "address": server.address, "peers": (server.address,)}
        sensor = force_sensor_maker("ros2")(table, context)
        clock = context.clock
        assert isinstance(clock, MonotonicClock)
        with arm, sensor, RealTime(RealTimeConfig(scheduling=rt)) as granted, granted.loop():
            for tick in ticks(clock, round(seconds * CONTROL_RATE_HZ)):
                sample = sensor.read()
                arm.read()
                sent[tick] = sample.torque_Nm[2] + sample.force_N[0]
                arm.send(JointCommand((*HOME[:5], HOME[5] + tick * STEP_RAD)))
            time.sleep(0.1)
    taken = dict[int, int]()
    for came_ns, data in robot.came:
        taken.setdefault(round((data[5] - HOME[5]) / STEP_RAD), came_ns)
    late_ms = [taken[tick] * 1e-6 - sent[tick] * 1e3 for tick in sent if tick in taken]
    median, p99, most = np.percentile(late_ms, [50, 99, 100])
    print(f"wrench to command: median {median:.2f} ms, 99 % {p99:.2f} ms, most {most:.2f} ms; {len(late_ms)} of"
          f" {len(sent)} set-points reached the robot as they were")  # fmt: skip


def stops(times: int, rt: bool, *, velocities: bool) -> None:
    rng, robot = random.Random(1), Robot(velocities=velocities)
    late_ms: list[float] = []
    with bench(robot, rt) as (_, arm, context):
        clock = context.clock
        assert isinstance(clock, MonotonicClock)
        arm.configure()
        for trial in range(times):
            arm.activate()
            goal, sign = arm.read().position_rad, 1 if trial % 2 else -1
            killed_ns, after = 0, rng.randrange(40, 80)
            with suppress(PalpateError), RealTime(RealTimeConfig(scheduling=rt)) as granted, granted.loop():
                for tick in ticks(clock, 400):
                    if tick == after:
                        os.kill(arm_number(), 9)
                        killed_ns = time.monotonic_ns()
                    goal = (*goal[:5], goal[5] + sign * SPEED_RAD_S / CONTROL_RATE_HZ)
                    arm.send(JointCommand(goal))
                    arm.read()
            time.sleep(0.3)
            late_ms.append((held_ns(robot, killed_ns, sign) - killed_ns) * 1e-6)
            robot.came.clear()
            arm.acknowledge_fault()
        arm.close()
    good = sum(late <= ALLOWED_MS for late in late_ms)
    what = "zeros" if velocities else "the position to hold"
    print(f"process killed: {what} within {ALLOWED_MS:g} ms in {good} of {times}; median {np.median(late_ms):.1f} ms,"
          f" most {max(late_ms):.1f} ms", flush=True)  # fmt: skip


def held_ns(robot: Robot, since_ns: int, sign: int) -> float:
    """Return the time of the first command that does not continue the motion."""
    commands = zip(robot.came, robot.came[1:], strict=False)
    for (_, before), (came_ns, data) in commands:
        if came_ns > since_ns and (data[5] if robot.velocities else data[5] - before[5]) * sign <= 0.0:
            return came_ns
    return np.inf


def arm_number() -> int:
    """Return the ID of the process that owns the arm."""
    return int(Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=20, help="deaths of the arm's process, of each kind of command")
    parser.add_argument("--seconds", type=float, default=20.0, help="of the latency")
    parser.add_argument("--rt", action="store_true", help="request SCHED_FIFO")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    latency(options.seconds, options.rt)
    for velocities in (False, True) if options.times else ():
        stops(options.times, options.rt, velocities=velocities)


if __name__ == "__main__":
    main()
