"""What the arm's own process costs: lateness of loop and bus beside an arm in the loop's process."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from math import floor
from pathlib import Path

import numpy as np

from benchmarks.deadman.arm import MOVING, NS, adapter_of
from benchmarks.deadman.cell import emulated
from benchmarks.jitter import open_task
from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.rig import RigFile
from palpate.adapters.config.run import scenario
from palpate.adapters.hardware.real_time import RealTime
from palpate.core.ports.values import CONTROL_RATE_HZ, JointCommand, Snapshot
from tests.fake_devices import FakeForceSensor

SPEED_RAD_S, AMPLITUDE_RAD = 0.15, 0.06


def swing(home: tuple[float, ...], seconds: float) -> tuple[float, ...]:
    """To and fro at one speed, beginning at home."""
    phase = seconds * SPEED_RAD_S / AMPLITUDE_RAD
    way = AMPLITUDE_RAD * (phase % 1.0 if floor(phase) % 2 == 0 else 1.0 - phase % 1.0)
    return tuple(q + way if i in MOVING else q for i, q in enumerate(home))


def spread(values: list[float]) -> str:
    found = np.array(values)
    if not len(found):
        return "nothing"
    marks = np.quantile(found, [0.5, 0.99, 0.999])
    return f"median {marks[0]:7.3f}  p99 {marks[1]:7.3f}  p99.9 {marks[2]:7.3f}  most {found.max():7.3f} ms"


def lateness(options: argparse.Namespace) -> None:
    """The loop's ticks over the arm, in turns in the loop's process and in one of its own."""
    config = scenario("paper")
    wishes = RealTimeConfig(scheduling=options.rt)
    task = open_task(config)
    found: dict[tuple[str, str], list[float]] = {}
    file = RigFile.load(Path(options.rig))
    period_ms = 1e3 * file.arm.settings.get("divider", 1) / CONTROL_RATE_HZ
    end_s = time.monotonic() + options.lateness
    turn = 0
    while time.monotonic() < end_s:
        name, deadman_ms = (("in the loop's process", 0.0), ("in its own", 1000.0))[turn % 2]
        turn += 1
        adapter, clock = adapter_of(file, options.arm, wishes, deadman_ms)
        sensor = FakeForceSensor(clock)
        sensor.configure()
        sensor.activate()
        with adapter.arm as hand, RealTime(wishes) as rt, rt.loop():
            home = adapter.encoder.read().position_rad
            task.start_at(home)
            start_ns = clock.now_ns()
            applied, last = None, None
            tick = slot = 0

            def note(what: str, ns: int, name: str = name) -> None:
                found.setdefault((what, name), []).append(ns * 1e-6)

            while tick < options.segment * CONTROL_RATE_HZ:
                deadline_ns = start_ns + slot * NS // CONTROL_RATE_HZ
                clock.sleep_until(deadline_ns)
                time_ns = clock.now_ns()
                joints = adapter.encoder.read()
                read_ns = clock.now_ns()
                task.plain_step(Snapshot(tick, time_ns, sensor.read(), joints, applied))
                stepped_ns = clock.now_ns()
                applied = hand.send(JointCommand(swing(home, tick / CONTROL_RATE_HZ)))
                sent_ns = clock.now_ns()
                if tick >= CONTROL_RATE_HZ:
                    note("loop: lateness", time_ns - deadline_ns)
                    note("loop: reading the joints", read_ns - time_ns)
                    note("loop: the core's step", stepped_ns - read_ns)
                    note("loop: sending", sent_ns - stepped_ns)
                    note("joints' age", time_ns - joints.source_time_ns)
                    if last is not None and joints.sequence == last.sequence + 1:
                        gap_ns = joints.source_time_ns - last.source_time_ns
                        note("bus: cycle beyond its period", max(gap_ns - round(period_ms * 1e6), 0))
                last = joints
                tick, slot = tick + 1, max(slot + 1, (time_ns - start_ns) * CONTROL_RATE_HZ // NS + 1)
            hand.stop()
    print(f"{options.arm}: {turn} turns of {options.segment:g} s")
    for what in dict.fromkeys(key[0] for key in found):
        print(f"  {what}")
        for name in dict.fromkeys(key[1] for key in found):
            print(f"    {name:22} {spread(found.get((what, name), []))}")


def measure_lateness(arm: str, options: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory() as name, emulated(arm, Path(name), options.rt) as (_, rig, model):
        words = ["--rig", str(rig), "--arm", model, "--lateness", str(options.lateness), "--segment"]
        call = [sys.executable, "-m", "benchmarks.deadman.lateness", *words, str(options.segment)]
        done = subprocess.run([*call, *(["--rt"] if options.rt else [])], capture_output=True, text=True, check=False)
        print(done.stdout.replace(model, arm, 1) or done.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rig", required=True)
    parser.add_argument("--arm", required=True)
    parser.add_argument("--lateness", type=float, required=True)
    parser.add_argument("--segment", type=float, required=True)
    parser.add_argument("--rt", action="store_true")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    lateness(options)


if __name__ == "__main__":
    main()
