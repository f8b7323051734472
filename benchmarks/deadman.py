"""Whether the arm comes to rest when the loop falls silent, on each emulated bus; and what its own process costs.

    python -m benchmarks.deadman --trials 100              stopped (SIGSTOP), killed and hanging, 100 times each
    python -m benchmarks.deadman --trials 5 --arm cia402   one bus
    python -m benchmarks.deadman --lateness 120 --rt       lateness of loop and bus beside an arm in the loop's process

A loop sends set-points that are far away, so that the arm goes on towards the last of them at 0.5 rad/s, the limit in
the rig files that come with palpate, if nobody stops it. Time counts from the last set-point, and the arm is at rest
when what the emulated motors hold moves no more: the simulated arm itself swings for another fifth of a second, after
any stop, which is told beside it.
"""

from __future__ import annotations

import argparse
import ctypes
import mmap
import os
import random
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile
from math import floor
from pathlib import Path
from queue import Queue
from typing import NamedTuple

import numpy as np

from benchmarks.jitter import open_task
from palpate.adapters.config import EMULATED_ARMS, EmulationConfig
from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.rig import RigFile
from palpate.adapters.config.run import scenario
from palpate.adapters.hardware.bus_process import host_arm
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.emulated_cell import EmulatedCell
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext, arm_maker
from palpate.adapters.hardware.real_time import RealTime, take_real_time
from palpate.adapters.hardware.real_time.real_time import join_loop
from palpate.core.errors import PalpateError
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CONTROL_RATE_HZ, CommandReason, JointCommand, Snapshot
from palpate.core.trial.ready_pose import find_ready_pose
from tests.fake_devices import FakeForceSensor

NS = 10**9
WAYS = ("stopped", "killed", "hanging")
SPEED_RAD_S, AMPLITUDE_RAD = 0.15, 0.06
FAR_RAD, STILL_RAD, REST_RAD_S = 1.2, 1e-6, 0.005
MOVING = (0, 5)
LOOK_S = 0.002
FASTEST_RAD_S = 0.5
ALLOWED_MS = 50.0
HANG_S = 1.0
GONE_S = 5.0
EMULATED_PRIORITY = 30


def context_of(arm: str, clock: MonotonicClock, wishes: RealTimeConfig) -> RigContext:
    context = RigContext.of(arm, clock)
    limits = tuple(min(limit, FASTEST_RAD_S) for limit in context.velocity_limit_rad_s)
    return replace(context, velocity_limit_rad_s=limits, hurry=lambda: join_loop(wishes))


def adapter_of(rig: RigFile, arm: str, wishes: RealTimeConfig, deadman_ms: float) -> tuple[ArmAdapter, MonotonicClock]:
    """The arm of a rig file, in a process of its own unless the deadman's time is 0."""
    clock = MonotonicClock()
    context = context_of(arm, clock, wishes)
    if not deadman_ms:
        return arm_maker(rig.arm.adapter)(rig.arm.settings, context), clock
    deadman_ns = round(deadman_ms * 1e6)
    hosted = host_arm(rig.arm.adapter, rig.arm.settings, context, clock, real_time=wishes, deadman_ns=deadman_ns)
    return ArmAdapter(hosted, hosted), clock


def swing(home: tuple[float, ...], seconds: float) -> tuple[float, ...]:
    """To and fro at one speed, beginning at home."""
    phase = seconds * SPEED_RAD_S / AMPLITUDE_RAD
    way = AMPLITUDE_RAD * (phase % 1.0 if floor(phase) % 2 == 0 else 1.0 - phase % 1.0)
    return tuple(q + way if i in MOVING else q for i, q in enumerate(home))


# --- The loop, in a process of its own.


def loop(path: str, arm_name: str, note_path: str, start_rad: tuple[float, ...], deadman_ms: float, rt: bool) -> None:
    """Moves the arm until it is killed; says what happened, a line each."""
    wishes = RealTimeConfig(scheduling=rt)
    adapter, clock = adapter_of(RigFile.load(Path(path)), arm_name, wishes, deadman_ms)
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


class Loop:
    """That process, seen from the bench."""

    def __init__(self, rig: Path, arm: str, folder: Path, start: str, options: argparse.Namespace) -> None:
        self.note = Path(tempfile.mkstemp(dir=folder)[1])
        self.note.write_bytes(bytes(8))
        words = ["--loop", str(rig), "--arm", arm, "--note", str(self.note), "--deadman-ms", str(options.deadman_ms)]
        call = [sys.executable, "-m", "benchmarks.deadman", *words, f"--start={start}"]
        call += ["--rt"] if options.rt else []
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(call, stdin=pipe, stdout=pipe, text=True, bufsize=1)
        self.begun = False
        self.arms: list[Path] = []
        self.lines: Queue[str] = Queue()
        threading.Thread(target=self.listen, daemon=True).start()

    def say(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    def listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.put(line.strip())
        self.lines.put("")

    def until_moving(self) -> str:
        """What it said before it moved."""
        if not self.begun:
            self.begun = True
            self.say()
        said = ""
        while (line := self.lines.get()) != "moving":
            if not line:
                raise SystemExit(f"the loop has ended: {said}")
            said = line
        return said

    def forget(self) -> None:
        """What it said of trips for which nobody asked: on a busy machine they come."""
        while not self.lines.empty():
            if not self.lines.get():
                raise SystemExit("the loop has ended")

    def last_set_ns(self) -> int:
        return int.from_bytes(self.note.read_bytes(), "little")

    def note_arms(self) -> None:
        number = self.process.pid
        begun = Path(f"/proc/{number}/task/{number}/children")
        self.arms += [Path("/proc") / child for child in (begun.read_text().split() if begun.exists() else [])]

    def kill(self) -> None:
        """End it, and wait until the arm's process has found out and has gone too."""
        self.note_arms()
        self.process.kill()
        self.process.wait()
        end_s = time.monotonic() + GONE_S
        while any(arm.exists() for arm in self.arms):
            if time.monotonic() > end_s:
                raise SystemExit(f"the arm's process is left behind: {self.arms}")
            time.sleep(0.01)


# --- The bench.


class Trial(NamedTuple):
    """When all motion had ended, in ms beyond the deadman's time after the last set-point.

    Attributes:
        still_ms: Of what the motors hold.
        rest_ms: Of the simulated joints, down to 0.005 rad/s.
        blink_ms: Longest time between two looks.
        was_moving: Whether the motors moved before. One that stood already shows nothing.
    """

    still_ms: float
    rest_ms: float
    blink_ms: float
    was_moving: bool


class Watched:
    """The emulated cell at work in a thread, and where its joints were when."""

    def __init__(self, cell: EmulatedCell) -> None:
        self.cell, self.ended = cell, False
        self.held: deque[tuple[int, tuple[float, ...]]] = deque(maxlen=2000)
        self.stood: deque[tuple[int, tuple[float, ...]]] = deque(maxlen=1000)
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self.run, self.watch)]
        for thread in self.threads:
            thread.start()

    def run(self) -> None:
        self.cell.run(self.look, lambda truth: None)

    def look(self) -> bool:
        self.stood.append((time.monotonic_ns(), tuple(self.cell.cell.joint_angles())))
        return self.ended

    def watch(self) -> None:
        while not self.ended:
            self.held.append((time.monotonic_ns(), self.cell.targets_rad()))
            time.sleep(LOOK_S)

    def last_motion_ns(self, since_ns: int) -> tuple[int, int, int, int]:
        """When what the motors hold first and last moved, when a joint was last fast, and the longest blink."""
        held_ns, held = since(self.held, since_ns)
        stood_ns, stood = since(self.stood, since_ns)
        moved = held_ns[1:][np.abs(np.diff(held, axis=0)).max(axis=1) > STILL_RAD]
        speed = np.abs(np.diff(stood, axis=0)).max(axis=1) / (np.diff(stood_ns) * 1e-9)
        fast = stood_ns[1:][speed > REST_RAD_S]
        blink_ns = int(np.diff(held_ns).max())
        return min(moved, default=1 << 62), max(moved, default=0), max(fast, default=0), blink_ns


def since(noted: deque[tuple[int, tuple[float, ...]]], begin_ns: int) -> tuple[np.ndarray, np.ndarray]:
    """The newest notes. Quickly: the emulated devices wait for this interpreter."""
    newest = list(takewhile(lambda entry: entry[0] >= begin_ns, reversed(noted.copy())))[::-1]
    times, angles = zip(*newest, strict=True)
    return np.array(times), np.array(angles)


@contextmanager
def emulated(arm: str, folder: Path, rt: bool) -> Iterator[tuple[Watched, Path, str]]:
    config = replace(scenario("paper"), seed=1, **({"arm": "ur5"} if arm == "ur5-rtde" else {}))
    counts = str(folder / "counts.json")
    emulation = EmulationConfig(arm=arm, force="jr3-can")
    if rt:
        take_real_time(EMULATED_PRIORITY)
    with EmulatedCell(config, find_ready_pose(config.arm, config.task), emulation, counts) as cell:
        rig = folder / "rig.toml"
        # Where the adapter has a limit of its own, that is the one of the rig files that come with palpate.
        text = cell.rig_toml()
        own = f"velocity_rad_s = {FASTEST_RAD_S}\n" if arm == "zebra-nmc" else ""
        rig.write_text(text.replace("[arm]\n", f"[arm]\n{own}"))
        watched = Watched(cell)
        if rt:
            # All that serves has its priority; what is started from here on is not to compete with it.
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        try:
            yield watched, rig, config.arm
        finally:
            watched.ended = True
            for thread in watched.threads:
                thread.join()


def silence(way: str, loop: Loop) -> None:
    if way == "killed":
        loop.note_arms()
        loop.process.kill()
    elif way == "stopped":
        loop.process.send_signal(signal.SIGSTOP)
    else:
        loop.say()


def one_trial(way: str, loop: Loop, watched: Watched, rng: random.Random, deadman_ms: float) -> tuple[Trial, str]:
    """What was seen, and what the loop said of it."""
    time.sleep(rng.uniform(0.2, 0.5))
    loop.forget()
    silence(way, loop)
    time.sleep(deadman_ms * 1e-3 + 0.5)
    last_ns = loop.last_set_ns()
    first_ns, still_ns, rest_ns, blink_ns = watched.last_motion_ns(last_ns - NS // 20)
    beyond = ((at - last_ns) * 1e-6 - deadman_ms for at in (still_ns, rest_ns))
    trial = Trial(*beyond, blink_ns * 1e-6, first_ns < last_ns)
    said = ""
    if way == "killed":
        loop.kill()
    else:
        if way == "stopped":
            loop.process.send_signal(signal.SIGCONT)
        said = loop.until_moving()
    return trial, said


def bench(arm: str, options: argparse.Namespace) -> None:
    rng = random.Random(1)
    with tempfile.TemporaryDirectory() as name, emulated(arm, Path(name), options.rt) as (watched, rig, model):
        start = ",".join(map(str, watched.cell.cell.joint_angles()))
        for way in options.ways:
            seen: list[Trial] = []
            said: dict[str, int] = {}
            at_work = Loop(rig, model, Path(name), start, options)
            after = None
            try:
                for _ in range(options.trials):
                    if way == "killed" and after is None:
                        at_work.until_moving()
                        after = Loop(rig, model, Path(name), start, options)
                    elif not seen:
                        at_work.until_moving()
                    trial, text = one_trial(way, at_work, watched, rng, options.deadman_ms)
                    seen.append(trial)
                    text = text.partition("; ")[2] or text
                    said[text] = said.get(text, 0) + 1
                    if after is not None:
                        at_work, after = after, None
            finally:
                at_work.kill()
                if after is not None:
                    after.kill()
            judge(arm, way, seen, options)
            for text, count in sorted(said.items(), key=lambda entry: -entry[1]):
                if text:
                    print(f"    {count} x {text}")


def judge(arm: str, way: str, seen: list[Trial], options: argparse.Namespace) -> None:
    still, swung = (np.array(values) for values in zip(*(t[:2] for t in seen), strict=True))
    unmoved = sum(not trial.was_moving for trial in seen)
    good = sum(trial.was_moving and trial.still_ms <= ALLOWED_MS for trial in seen)
    print(
        f"{arm}, {way}: at rest within {ALLOWED_MS:g} ms of the deadman's {options.deadman_ms:g} ms in {good} of"
        f" {len(seen)}; beyond it median {np.median(still):.1f}, most {still.max():.1f} ms;"
        f" the simulated arm swung until {np.median(swung):.0f} ms" + (f"; {unmoved} did not move" if unmoved else "")
    )
    print(f"    the bench itself was blind for {max(t.blink_ms for t in seen):.1f} ms at most", flush=True)


# --- What it costs.


def spread(values: list[float]) -> str:
    found = np.array(values)
    if not len(found):
        return "nothing"
    marks = np.quantile(found, [0.5, 0.99, 0.999])
    return f"median {marks[0]:7.3f}  p99 {marks[1]:7.3f}  p99.9 {marks[2]:7.3f}  most {found.max():7.3f} ms"


def lateness(arm: str, rig: str, model: str, options: argparse.Namespace) -> None:
    """The loop's ticks over the arm, in turns in the loop's process and in one of its own."""
    config = scenario("paper")
    wishes = RealTimeConfig(scheduling=options.rt)
    task = open_task(config)
    found: dict[tuple[str, str], list[float]] = {}
    file = RigFile.load(Path(rig))
    period_ms = 1e3 * file.arm.settings.get("divider", 1) / CONTROL_RATE_HZ
    end_s = time.monotonic() + options.lateness
    turn = 0
    while time.monotonic() < end_s:
        name, deadman_ms = (("in the loop's process", 0.0), ("in its own", 1000.0))[turn % 2]
        turn += 1
        adapter, clock = adapter_of(file, model, wishes, deadman_ms)
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
    print(f"{arm}: {turn} turns of {options.segment:g} s")
    for what in dict.fromkeys(key[0] for key in found):
        print(f"  {what}")
        for name in dict.fromkeys(key[1] for key in found):
            print(f"    {name:22} {spread(found.get((what, name), []))}")


def measure_lateness(arm: str, options: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory() as name, emulated(arm, Path(name), options.rt) as (_, rig, model):
        words = ["--rig", str(rig), "--arm", model, "--lateness", str(options.lateness), "--segment"]
        call = [sys.executable, "-m", "benchmarks.deadman", *words, str(options.segment)]
        done = subprocess.run([*call, *(["--rt"] if options.rt else [])], capture_output=True, text=True, check=False)
        print(done.stdout.replace(model, arm, 1) or done.stderr, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20, help="of each way to fall silent")
    parser.add_argument("--arm", default="", help="one emulated arm; all of them without it")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--deadman-ms", type=float, default=100.0)
    parser.add_argument(
        "--lateness", type=float, default=0.0, help="seconds to measure what it costs, and nothing else"
    )
    parser.add_argument("--segment", type=float, default=10.0, help="seconds between two turns of that")
    parser.add_argument("--rt", action="store_true", help="ask for SCHED_FIFO")
    for hidden in ("--loop", "--note", "--rig", "--start"):
        parser.add_argument(hidden, default="", help=argparse.SUPPRESS)
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    if options.loop:
        start_rad = tuple(map(float, options.start.split(",")))
        loop(options.loop, options.arm, options.note, start_rad, options.deadman_ms, options.rt)
        return
    if options.rig:
        lateness(options.arm, options.rig, options.arm, options)
        return
    measure: Callable[[str, argparse.Namespace], None] = measure_lateness if options.lateness else bench
    for arm in (options.arm,) if options.arm else EMULATED_ARMS:
        measure(arm, options)


if __name__ == "__main__":
    main()
