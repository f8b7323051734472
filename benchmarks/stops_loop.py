"""A loop in a separate process that moves an arm until it falls silent, for ``benchmarks.stops``."""

from __future__ import annotations

import argparse
import ctypes
import mmap
import os
import select
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from palpate.adapters.config import RealTimeConfig
from palpate.adapters.config.rig import DeviceEntry, RigFile
from palpate.adapters.hardware.arm_client import ArmClient, arm_in_process
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import RigContext, arm_maker
from palpate.adapters.hardware.real_time import RealTime, join_loop
from palpate.adapters.hardware.served_arm import DriverArm
from palpate.core.errors import PalpateError
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, CommandReason, JointCommand, JointVector

NS = 10**9
MOVING = (0, 5)
"""Joints to move."""
FASTEST_RAD_S = 0.5
FAR_RAD = 1.2
HANG_S = 1.0


ADAPTER = "STOPS_ADAPTER"
HANG_SIGNAL = signal.SIGUSR2


def hang(*_: object) -> None:
    """Hang without releasing the interpreter."""
    ctypes.PyDLL(None).usleep(round(HANG_S * 1e6))


class Unlimited:
    """Limiter that limits nothing."""

    def __init__(self, joints: int) -> None:
        self.joints = joints

    def start(self, held_rad: JointVector) -> None: ...

    def limited(self, requested_rad: JointVector, now_ns: int) -> AppliedCommand:
        return AppliedCommand(requested_rad)


def make_arm(settings: Mapping[str, Any], context: RigContext) -> Any:
    """Return the arm of the adapter named in the environment. Its process hangs in C after a signal."""
    signal.signal(HANG_SIGNAL, hang)
    made = arm_maker(os.environ[ADAPTER])(settings, context)
    assert isinstance(made, DriverArm)
    return made


def arm_of(rig: RigFile, arm: str, wishes: RealTimeConfig, timeout_ms: float) -> tuple[ArmClient, MonotonicClock]:
    """Return the arm of a rig file, in a separate process."""
    clock, before = MonotonicClock(), signal.getsignal(HANG_SIGNAL)
    context = RigContext.of(arm, clock)
    limits = tuple(min(limit, FASTEST_RAD_S) for limit in context.velocity_limit_rad_s)
    context = replace(
        context, velocity_limit_rad_s=limits, set_priority=lambda: join_loop(wishes), accept_kinematics=True
    )
    os.environ[ADAPTER] = rig.arm.adapter
    entry = DeviceEntry("benchmarks.stops_loop:make_arm", rig.arm.settings)
    client = arm_in_process(entry, context, wishes, round(timeout_ms * 1e6))
    signal.signal(HANG_SIGNAL, before)
    return client, clock


def loop(path: str, arm_name: str, note_path: str, start_rad: tuple[float, ...], timeout_ms: float, rt: bool) -> None:
    """Move the arm until it is killed. After each fault, print it on one line, and wait for an input line to resume."""
    wishes = RealTimeConfig(scheduling=rt)
    arm, clock = arm_of(RigFile.load(Path(path)), arm_name, wishes, timeout_ms)
    with Path(note_path).open("r+b") as file:
        note = mmap.mmap(file.fileno(), 8)
    # A loop that has gone wrong as far as it can: what it asks for is not held back here.
    vars(arm)["_limiter"] = Unlimited(len(start_rad))
    sys.stdin.readline()
    with arm, RealTime(wishes) as granted, granted.loop():
        while True:
            home = arm.read().position_rad
            far = JointCommand(
                tuple(
                    q + (FAR_RAD if q < begin else -FAR_RAD) if i in MOVING else q
                    for i, (q, begin) in enumerate(zip(home, start_rad, strict=True))
                )
            )
            start_ns, tick = clock.now_ns(), 0
            print("moving", flush=True)
            try:
                while True:
                    deadline_ns = start_ns + tick * NS // CONTROL_RATE_HZ
                    clock.sleep_until(deadline_ns)
                    sent_ns = time.monotonic_ns()
                    applied = arm.send(far)
                    if applied.reason is CommandReason.STOPPED:
                        raise PalpateError("stopped")
                    note[:] = sent_ns.to_bytes(8, "little")
                    arm.read()
                    tick = max(tick + 1, (clock.now_ns() - start_ns) * CONTROL_RATE_HZ // NS)
                    if select.select([sys.stdin], [], [], 0)[0] and sys.stdin.readline():
                        hang()
            except PalpateError as error:
                print(f"fault {error}", flush=True)
                sys.stdin.readline()
                free(arm)


def free(arm: ArmCommand) -> None:
    """Activate the arm again, with several attempts, because an emulated device may fail on a busy machine."""
    for attempt in range(5):
        # Where the driver fails, its error comes before its fault.
        time.sleep(0.05 + 0.2 * attempt)
        try:
            if arm.life is Life.FAULTED:
                arm.acknowledge_fault()
            if arm.life is Life.ACTIVE:
                arm.deactivate()
            arm.activate()
            return
        except PalpateError as error:
            print(f"once more: {error}", file=sys.stderr, flush=True)
    raise SystemExit("the arm cannot be made active")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for word in ("--rig", "--arm", "--note", "--start"):
        parser.add_argument(word, required=True)
    parser.add_argument("--timeout-ms", type=float, required=True)
    parser.add_argument("--rt", action="store_true")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    start_rad = tuple(map(float, options.start.split(",")))
    loop(options.rig, options.arm, options.note, start_rad, options.timeout_ms, options.rt)


if __name__ == "__main__":
    main()
