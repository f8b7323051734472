"""A loop that moves an arm until it falls silent, in a process of its own, for ``benchmarks.deadman``."""

from __future__ import annotations

import argparse
import ctypes
import mmap
import select
import sys
import time
from dataclasses import replace
from pathlib import Path

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.rig import RigFile
from palpate.adapters.hardware.bus_process import host_arm
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext
from palpate.adapters.hardware.real_time import RealTime, join_loop
from palpate.core.errors import PalpateError
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CONTROL_RATE_HZ, CommandReason, JointCommand

NS = 10**9
MOVING = (0, 5)
"""Joints that are moved."""
FASTEST_RAD_S = 0.5
FAR_RAD = 1.2
HANG_S = 1.0


def hosted_arm(rig: RigFile, arm: str, wishes: RealTimeConfig, deadman_ms: float) -> tuple[ArmAdapter, MonotonicClock]:
    """The arm of a rig file, in a process of its own."""
    clock = MonotonicClock()
    context = RigContext.of(arm, clock)
    limits = tuple(min(limit, FASTEST_RAD_S) for limit in context.velocity_limit_rad_s)
    context = replace(context, velocity_limit_rad_s=limits, hurry=lambda: join_loop(wishes))
    deadman_ns = round(deadman_ms * 1e6)
    hosted = host_arm(rig.arm.adapter, rig.arm.settings, context, clock, real_time=wishes, deadman_ns=deadman_ns)
    return ArmAdapter(hosted, hosted), clock


def loop(path: str, arm_name: str, note_path: str, start_rad: tuple[float, ...], deadman_ms: float, rt: bool) -> None:
    """Moves the arm until it is killed; says what happened, a line each."""
    wishes = RealTimeConfig(scheduling=rt)
    adapter, clock = hosted_arm(RigFile.load(Path(path)), arm_name, wishes, deadman_ms)
    hang = ctypes.PyDLL(None).usleep
    with Path(note_path).open("r+b") as file:
        note = mmap.mmap(file.fileno(), 8)
    sys.stdin.readline()
    with adapter.arm as arm, RealTime(wishes) as granted, granted.loop():
        while True:
            home = adapter.encoder.read().position_rad
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
                    adapter.encoder.read()
                    tick = max(tick + 1, (clock.now_ns() - start_ns) * CONTROL_RATE_HZ // NS)
                    if select.select([sys.stdin], [], [], 0)[0] and sys.stdin.readline():
                        # Without letting go of the interpreter.
                        hang(round(HANG_S * 1e6))
            except PalpateError as error:
                print(f"fault {error}", flush=True)
                free(arm)


def free(arm: ArmCommand) -> None:
    """Make the arm active again. On a busy machine an emulated device may fail meanwhile, and then once more."""
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
    parser.add_argument("--deadman-ms", type=float, required=True)
    parser.add_argument("--rt", action="store_true")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    start_rad = tuple(map(float, options.start.split(",")))
    loop(options.rig, options.arm, options.note, start_rad, options.deadman_ms, options.rt)


if __name__ == "__main__":
    main()
