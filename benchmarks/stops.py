"""Time until the arm is stationary after its loop or the arm process stops working, on each emulated bus.

    python -m benchmarks.stops --times 100              each of six ways, 100 times, on three buses
    python -m benchmarks.stops --times 5 --arm cia402   one bus

The loop or the arm process is stopped (SIGSTOP), killed (SIGKILL), or hangs in C while holding the interpreter. The
loop sends distant set-points without limiting them, so that the driver moves the arm towards the latest set-point at
0.5 rad/s, the limit in the rig files included in palpate. Without its loop, the arm process stops the arm after the
set-point time-out, measured from the last set-point. Without the arm process, time is measured from the signal, and the
arm is stopped by a device on its bus: CiA 402 drives miss the heartbeat of this computer, a Universal Robots controller
misses set-points, and an NMC module moves to its last set-point, one cycle away. The arm is stationary when the
set-points held by the emulated motors no longer change; the simulated arm oscillates for another fifth of a second.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from queue import Queue
from typing import Any, NamedTuple

import numpy as np

from benchmarks.stops_loop import FASTEST_RAD_S, HANG_SIGNAL, NS
from palpate.adapters.config import UR, ZEBRA, EmulationConfig
from palpate.adapters.config.compose import scenario
from palpate.adapters.hardware.emulated_cell import EmulatedCell
from palpate.adapters.hardware.real_time import take_real_time
from palpate.core.trial.ready_pose import find_ready_pose

WIRES = ("zebra-nmc", "cia402", "ur-rtde")
WAYS = tuple(f"{who} {how}" for who in ("loop", "arm") for how in ("stopped", "killed", "hanging"))
BUS_MS = {"zebra-nmc": 0.0, "cia402": 100.0, "ur-rtde": 150.0}
"""Time-out of the bus itself, with a timeout_scale of 1 in the rig file."""
STILL_RAD, REST_RAD_S = 1e-6, 0.005
LOOK_S = 0.002
EMULATED_PRIORITY = 30
GONE_S = 5.0
ALLOWED_MS = 50.0
TIMEOUT_SCALE = 2.0
"""Scale for the emulated devices. A larger scale would make their own time-outs too long."""


class Watched:
    """The emulated cell, running in a thread, and a record of its joint positions over time."""

    def __init__(self, cell: EmulatedCell, counts: Path) -> None:
        self.cell, self.counts, self.ended = cell, counts, False
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

    def keep_counts(self) -> None:
        """Store the Zebra's counters, as a person does who knows that its modules never lost power."""
        if self.counts.exists():
            motors: Any = self.cell.arm.motors
            self.counts.write_text(json.dumps([motors.motor_counts(axis) for axis in range(6)]))

    def last_motion_ns(self, since_ns: int) -> tuple[int, int, int, int]:
        """Return when set-points first and last moved, when a joint last moved fast, and the longest gap in time."""
        held_ns, held = since(self.held, since_ns)
        stood_ns, stood = since(self.stood, since_ns)
        moved = held_ns[1:][np.abs(np.diff(held, axis=0)).max(axis=1) > STILL_RAD]
        speed = np.abs(np.diff(stood, axis=0)).max(axis=1) / (np.diff(stood_ns) * 1e-9)
        fast = stood_ns[1:][speed > REST_RAD_S]
        blink_ns = int(np.diff(held_ns).max())
        return min(moved, default=1 << 62), max(moved, default=0), max(fast, default=0), blink_ns


def since(noted: deque[tuple[int, tuple[float, ...]]], begin_ns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the latest records. This must be quick, because the emulated devices wait for the interpreter."""
    newest = list(takewhile(lambda entry: entry[0] >= begin_ns, reversed(noted.copy())))[::-1]
    times, angles = zip(*newest, strict=True)
    return np.array(times), np.array(angles)


@contextmanager
def emulated(arm: str, folder: Path, rt: bool) -> Iterator[tuple[Watched, Path, str]]:
    config = replace(scenario("paper"), seed=1, **({"arm": "ur5"} if arm == UR else {}))
    counts = str(folder / "counts.json")
    emulation = EmulationConfig(wires=arm, force="jr3-can")
    if rt:
        take_real_time(EMULATED_PRIORITY)
    with EmulatedCell(
        config, find_ready_pose(config.arm, config.tool.geometry, config.task), emulation, counts
    ) as cell:
        rig = folder / "rig.toml"
        # Where the adapter has a limit of its own, that is the one of the rig files that come with palpate.
        text = re.sub(r"timeout_scale = [0-9.]+", f"timeout_scale = {TIMEOUT_SCALE}", cell.rig_toml())
        own = f"velocity_rad_s = {FASTEST_RAD_S}\n" if arm == ZEBRA else ""
        rig.write_text(text.replace("[arm]\n", f"[arm]\n{own}"))
        watched = Watched(cell, Path(counts))
        if rt:
            # All that serves has its priority; what is started from here on is not to compete with it.
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        try:
            yield watched, rig, config.arm
        finally:
            watched.ended = True
            for thread in watched.threads:
                thread.join()


class Loop:
    """The loop's process, as seen from the benchmark."""

    def __init__(self, rig: Path, arm: str, folder: Path, start: str, options: argparse.Namespace) -> None:
        self.note = Path(tempfile.mkstemp(dir=folder)[1])
        self.note.write_bytes(bytes(8))
        words = ["--rig", str(rig), "--arm", arm, "--note", str(self.note), "--timeout-ms", str(options.timeout_ms)]
        call = [sys.executable, "-m", "benchmarks.stops_loop", *words, f"--start={start}"]
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
        """Wait until the arm moves, and return the last message before that."""
        if not self.begun:
            self.begun = True
            self.say()
        said = ""
        while (line := self.lines.get()) != "moving":
            if not line:
                raise SystemExit(f"the loop has ended: {said}")
            said = line
        return said

    def moves(self) -> bool:
        """Return True if the arm moves. An emulated device that failed on a busy machine is restarted."""
        if self.lines.empty():
            return True
        if not self.lines.get():
            raise SystemExit("the loop has ended")
        self.say()
        self.until_moving()
        return False

    def arm_number(self) -> int:
        """Return the ID of the process that owns the arm."""
        number = self.process.pid
        return int(Path(f"/proc/{number}/task/{number}/children").read_text().split()[0])

    def last_set_ns(self) -> int:
        return int.from_bytes(self.note.read_bytes(), "little")

    def note_arms(self) -> None:
        number = self.process.pid
        begun = Path(f"/proc/{number}/task/{number}/children")
        self.arms += [Path("/proc") / child for child in (begun.read_text().split() if begun.exists() else [])]

    def kill(self) -> None:
        """Kill the process, and wait until the arm process has noticed this and ended."""
        self.note_arms()
        self.process.kill()
        self.process.wait()
        end_s = time.monotonic() + GONE_S
        while any(arm.exists() for arm in self.arms):
            if time.monotonic() > end_s:
                raise SystemExit(f"the arm's process is left behind: {self.arms}")
            time.sleep(0.01)


class Trial(NamedTuple):
    """Times at which all motion had ended, in ms beyond the time-out.

    Attributes:
        still_ms: Time for the set-points held by the motors.
        rest_ms: Time for the simulated joints, down to 0.005 rad/s.
        blink_ms: Maximum time between two observations.
        was_moving: Whether the motors moved before. If not, the trial shows nothing.
    """

    still_ms: float
    rest_ms: float
    blink_ms: float
    was_moving: bool


def silence(way: str, loop: Loop) -> None:
    who, how = way.split()
    if who == "arm":
        signals = {"stopped": signal.SIGSTOP, "killed": signal.SIGKILL, "hanging": HANG_SIGNAL}
        os.kill(loop.arm_number(), signals[how])
    elif how == "killed":
        loop.note_arms()
        loop.process.kill()
    elif how == "stopped":
        loop.process.send_signal(signal.SIGSTOP)
    else:
        loop.say()


def one_trial(way: str, loop: Loop, watched: Watched, rng: random.Random, timeout_ms: float) -> tuple[Trial, str]:
    """Return the results of a trial, and the message from the loop.

    Args:
        timeout_ms: Time-out of the set-points or of the bus.
    """
    time.sleep(rng.uniform(0.2, 0.5))
    while not loop.moves():
        time.sleep(rng.uniform(0.2, 0.5))
    begin_ns = time.monotonic_ns()
    silence(way, loop)
    time.sleep(timeout_ms * 1e-3 + 0.5)
    last_ns = begin_ns if way.startswith("arm") else loop.last_set_ns()
    first_ns, still_ns, rest_ns, blink_ns = watched.last_motion_ns(last_ns - NS // 20)
    beyond = ((at - last_ns) * 1e-6 - timeout_ms for at in (still_ns, rest_ns))
    trial = Trial(*beyond, blink_ns * 1e-6, first_ns < last_ns)
    if way == "loop killed":
        loop.kill()
        return trial, ""
    if way == "loop stopped":
        loop.process.send_signal(signal.SIGCONT)
    said = loop.lines.get()
    watched.keep_counts()
    loop.say()
    loop.until_moving()
    return trial, said


def bench(arm: str, options: argparse.Namespace) -> None:
    rng = random.Random(1)
    with tempfile.TemporaryDirectory() as name, emulated(arm, Path(name), options.rt) as (watched, rig, model):
        start = ",".join(map(str, watched.cell.cell.joint_angles()))
        for way in options.ways:
            seen: list[Trial] = []
            said = Counter[str]()
            timeout_ms = BUS_MS[arm] * TIMEOUT_SCALE if way.startswith("arm") else options.timeout_ms
            at_work = Loop(rig, model, Path(name), start, options)
            after = None
            try:
                for _ in range(options.times):
                    if way == "loop killed" and after is None:
                        at_work.until_moving()
                        after = Loop(rig, model, Path(name), start, options)
                    elif not seen:
                        at_work.until_moving()
                    trial, text = one_trial(way, at_work, watched, rng, timeout_ms)
                    seen.append(trial)
                    said[re.sub(r"[0-9.]+ ms", "... ms", text)] += 1
                    if after is not None:
                        at_work, after = after, None
            finally:
                at_work.kill()
                if after is not None:
                    after.kill()
            judge(arm, way, seen, timeout_ms)
            for text, count in said.most_common():
                if text:
                    print(f"    {count} x {text}")


def judge(arm: str, way: str, seen: list[Trial], timeout_ms: float) -> None:
    still, swung = (np.array(values) for values in zip(*(t[:2] for t in seen), strict=True))
    unmoved = sum(not trial.was_moving for trial in seen)
    good = sum(trial.was_moving and trial.still_ms <= ALLOWED_MS for trial in seen)
    print(
        f"{arm}, {way}: at rest within {ALLOWED_MS:g} ms of the time-out of {timeout_ms:g} ms in {good} of"
        f" {len(seen)}; beyond it median {np.median(still):.1f}, most {still.max():.1f} ms;"
        f" the simulated arm swung until {np.median(swung):.0f} ms" + (f"; {unmoved} did not move" if unmoved else "")
    )
    print(f"    the bench itself was blind for {max(t.blink_ms for t in seen):.1f} ms at most", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=20, help="of each way")
    parser.add_argument("--arm", default="", choices=("", *WIRES), help="wires of one emulated arm; all by default")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--timeout-ms", type=float, default=100.0, help="set-point time-out")
    parser.add_argument("--rt", action="store_true", help="request SCHED_FIFO")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    for arm in (options.arm,) if options.arm else WIRES:
        bench(arm, options)


if __name__ == "__main__":
    main()
