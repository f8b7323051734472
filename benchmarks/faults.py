"""What a log survives: flipped bits, and a kill of loop and writer at any moment; and what a minute of it weighs.

    python -m benchmarks.faults            1000 flips, 100 kills, 20 trials (some minutes)
    python -m benchmarks.faults --quick    100 flips, 8 kills, 3 trials

For the kills a trial is paced by a real clock at the control rate. What a tick holds follows from its number, and
the loop leaves the number of the newest tick that it has handed to the recorder in a file that outlives it.
"""

from __future__ import annotations

import argparse
import mmap
import os
import random
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import sin
from pathlib import Path

from palpate.adapters.log.file import dump_json
from palpate.adapters.log.reader import read_log
from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.records import StartRecord, TickRecord
from palpate.adapters.log.recover import recover
from palpate.adapters.log.schema import SCHEMA
from palpate.adapters.log.writer_client import Opening, ProcessSink
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import LogError
from palpate.core.ports.devices import ArmCommand, Clock, ForceSensor, JointEncoder, Ports
from palpate.core.ports.lifecycle import ManagedDevice
from palpate.core.ports.values import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    JointCommand,
    JointSample,
    JointVector,
    Snapshot,
    WrenchSample,
)
from palpate.core.trial import TrialReport, TrialSetup

ROOT = Path(__file__).parents[1]
MOST_LOST_S = 0.5
LONGEST_S = 4.0
NEWEST = struct.Struct("<qq")
"""The newest tick that the recorder has, and the writer's process."""


# What is recorded: real pace, contents that can be checked.


def joints_at(tick: int) -> JointVector:
    return tuple(sin(0.01 * tick + joint) for joint in range(6))


def force_at(tick: int) -> tuple[float, float, float]:
    return (sin(tick), sin(2.0 * tick), -5.0 + sin(3.0 * tick))


class RealClock(Clock):
    def __init__(self) -> None:
        self._start_ns = time.monotonic_ns()
        self.read_ns = 0

    def now_ns(self) -> int:
        self.read_ns = time.monotonic_ns() - self._start_ns
        return self.read_ns

    def sleep_until(self, deadline_ns: int) -> None:
        while (left := deadline_ns - (time.monotonic_ns() - self._start_ns)) > 0:
            time.sleep(left * 1e-9)


class Device(ManagedDevice):
    def __init__(self, clock: RealClock) -> None:
        super().__init__("paced")
        self.clock, self.count = clock, 0


class Sensor(Device, ForceSensor):
    def read(self) -> WrenchSample:
        tick, now = self.count, self.clock.read_ns
        self.count += 1
        return WrenchSample(force_at(tick), (0.1, 0.2, sin(tick)), now, now, tick)


class Encoder(Device, JointEncoder):
    def read(self) -> JointSample:
        tick, now = self.count, self.clock.read_ns
        self.count += 1
        return JointSample(joints_at(tick), now, now, tick)


class Arm(Device, ArmCommand):
    def send(self, command: JointCommand) -> AppliedCommand:
        return AppliedCommand(command.position_rad)

    def stop(self) -> None: ...


class Counted(LoopObserver):
    """Behind the recorder: when it is called, the recorder has the tick."""

    def __init__(self, state: mmap.mmap, writer: int) -> None:
        self._state, self._writer = state, writer

    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        NEWEST.pack_into(self._state, 0, snapshot.tick, self._writer)


class EndlessTask:
    def __init__(self) -> None:
        self.report = TrialReport(TrialSetup(0, 0, (0.0, 0.0)))

    def begin(self, setup: TrialSetup) -> None:
        self.report = TrialReport(setup)

    def sense(self, snapshot: Snapshot) -> None:
        self._tick = snapshot.tick

    def act(self) -> JointCommand:
        return JointCommand(joints_at(self._tick + 1))


def starting() -> StartRecord:
    return StartRecord(
        schema=SCHEMA, command="faults", config_toml="", arm="none", model_sha256="", core_sha256="", seed=0, trial=0,
        start_m=(0.0, 0.0), ready_rad=joints_at(0), tip_rotation=(1.0,) * 9, perception_json="{}", policy="none",
        learner_json=dump_json([sin(k) for k in range(150)]),
    )  # fmt: skip


def paced(path: Path, shared: Path) -> None:
    """Record until killed."""
    with shared.open("r+b") as stream:
        state = mmap.mmap(stream.fileno(), NEWEST.size)
    sink = ProcessSink(queue_bytes=1 << 22, patient=False)
    recorder, task, clock = FlightRecorder(sink), EndlessTask(), RealClock()
    ports = Ports(clock, Sensor(clock), Encoder(clock), Arm(clock))
    recorder.begin(Opening(path, {}), starting)
    observers = (recorder, Counted(state, sink.process_id))
    run_trial(task, ports, TrialSetup(0, 0, (0.0, 0.0)), None, observers)  # type: ignore[arg-type]


# Kills.


@dataclass(frozen=True)
class Kill:
    """What one kill cost."""

    after_s: float
    handed: int
    readable: int
    wrong: int
    unreadable: str = ""

    @property
    def lost_s(self) -> float:
        return (self.handed - self.readable) / CONTROL_RATE_HZ


def kill_once(folder: Path, number: int, after_s: float) -> Kill:
    path, shared = folder / f"{number}.mcap", folder / f"{number}.state"
    shared.write_bytes(NEWEST.pack(-1, 0))
    command = [sys.executable, "-m", "benchmarks.faults", "--paced", str(path), str(shared)]
    with subprocess.Popen(command, cwd=ROOT, start_new_session=True, stderr=subprocess.PIPE) as child:
        while NEWEST.unpack(shared.read_bytes())[0] < 0:
            if child.poll() is not None:
                raise SystemExit(f"the recording did not start: {child.stderr and child.stderr.read()!r}")
            time.sleep(0.002)
        time.sleep(after_s)
        # The writer is in a group of its own, out of the way of Ctrl-C: both groups, the writer first, which is worse.
        os.killpg(NEWEST.unpack(shared.read_bytes())[1], signal.SIGKILL)
        os.killpg(child.pid, signal.SIGKILL)
        # Open as long as either lives.
        said = child.stderr.read() if child.stderr else b""
    if said:
        raise SystemExit(f"the recording went wrong: {said!r}")
    handed = NEWEST.unpack(shared.read_bytes())[0]
    try:
        readable, wrong = what_is_left(path, folder / f"{number}.recovered.mcap")
    except LogError as error:
        return Kill(after_s, handed, -1, 0, str(error))
    return Kill(after_s, handed, readable, wrong)


def what_is_left(path: Path, out: Path) -> tuple[int, int]:
    """The newest tick that recovery gives, and how many ticks are not what was recorded."""
    records = list(read_log(path if recover(path, out) is None else out).records())
    wrong = sum(not is_right(record, tick) for tick, record in enumerate(records))
    return len(records) - 1, wrong


def is_right(record: TickRecord, tick: int) -> bool:
    now = record.time_ns or 0
    deadline = record.deadline_ns or 0
    asked = joints_at(tick + 1)
    return (
        record
        == TickRecord(
            tick,
            now,
            deadline,
            WrenchSample(force_at(tick), (0.1, 0.2, sin(tick)), now, now, tick),
            JointSample(joints_at(tick), now, now, tick),
            asked,
            AppliedCommand(asked),
        )
        and now >= deadline
    )


def kills(count: int, jobs: int) -> bool:
    chance = random.Random(0)
    moments = [chance.uniform(0.0, LONGEST_S) for _ in range(count)]
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(jobs) as pool:
        done = list(pool.map(lambda job: kill_once(Path(name), *job), enumerate(moments)))
    lost = [kill.lost_s for kill in done]
    unreadable = [kill for kill in done if kill.unreadable]
    wrong = sum(kill.wrong for kill in done)
    ticks = sum(kill.readable + 1 for kill in done)
    print(f"\nkill -9 of loop and writer together, {count} times, 0 to {LONGEST_S:g} s after the first tick")
    print("| | |\n|---|---|")
    print(f"| files recovered and readable | {count - len(unreadable)} of {count} |")
    print(f"| ticks recovered, of these not as recorded | {ticks}, {wrong} |")
    print(f"| lost, median | {statistics.median(lost):.3f} s |")
    print(f"| lost, mean | {statistics.fmean(lost):.3f} s |")
    print(f"| lost, most | {max(lost):.3f} s (at most {MOST_LOST_S} s) |")
    print(f"| kills that cost more than that | {sum(each > MOST_LOST_S for each in lost)} |")
    for kill in sorted(done, key=lambda kill: -kill.lost_s)[:5]:
        print(f"  worst: after {kill.after_s:.3f} s, handed over to {kill.handed}, readable to {kill.readable}", end="")
        print(f" ({kill.unreadable})" if kill.unreadable else "")
    return not unreadable and not wrong and max(lost) <= MOST_LOST_S


# Flipped bits, and sizes, of real logs.


def train(folder: Path, trials: int) -> list[Path]:
    """The logs of a real training run."""
    command = [sys.executable, "-m", "palpate.adapters.cli.main", "train", "--trials", str(trials), "--out"]
    subprocess.run([*command, str(folder)], check=True, capture_output=True)
    return sorted((folder / "logs").glob("*.mcap"))


def flips(path: Path, count: int) -> bool:
    data = path.read_bytes()
    whole = read_log(path)
    before = (whole.start, list(whole.records()), whole.calls, whole.decisions, whole.reinforcements, whole.events)
    chance, noticed, tracebacks, same = random.Random(0), 0, 0, 0
    with tempfile.TemporaryDirectory() as name:
        broken_path = Path(name) / "broken.mcap"
        for bit in chance.sample(range(8 * len(data)), count):
            broken = bytearray(data)
            broken[bit // 8] ^= 1 << bit % 8
            broken_path.write_bytes(broken)
            try:
                log = read_log(broken_path)
                after = (log.start, list(log.records()), log.calls, log.decisions, log.reinforcements, log.events)
                same += after == before
            except LogError:
                noticed += 1
            except Exception as error:
                print(f"bit {bit}: {error!r}")
                tracebacks += 1
    print(f"\nsingle bit flips in a real log of {len(data)} bytes, {len(whole.ticks)} ticks")
    print("| | |\n|---|---|")
    print(f"| noticed | {noticed} of {count} |")
    print(f"| not noticed, but read the same | {same} |")
    print(f"| misread | {count - noticed - same - tracebacks} |")
    print(f"| tracebacks | {tracebacks} |")
    return noticed == count


def sizes(paths: list[Path]) -> None:
    logs = [read_log(path) for path in paths]
    minutes = sum(len(log.ticks) for log in logs) / CONTROL_RATE_HZ / 60
    raw, packed = sum(log.raw_bytes for log in logs), sum(log.size_bytes for log in logs)
    print(f"\nsize of {len(logs)} logs of a training run, {minutes:.2f} minutes of trial time")
    print("| | MB | MB per minute |\n|---|---|---|")
    print(f"| messages, raw | {raw / 1e6:.2f} | {raw / 1e6 / minutes:.3f} |")
    print(f"| files, compressed and indexed | {packed / 1e6:.2f} | {packed / 1e6 / minutes:.3f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--jobs", type=int, default=2, help="recordings that run beside each other")
    parser.add_argument("--paced", nargs=2, type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.paced:
        paced(*options.paced)
        return
    with tempfile.TemporaryDirectory() as name:
        logs = train(Path(name) / "run", 3 if options.quick else 20)
        sizes(logs)
        good = flips(logs[0], 100 if options.quick else 1000)
    good = kills(8 if options.quick else 100, options.jobs) and good
    raise SystemExit(0 if good else "a requirement is not met")


if __name__ == "__main__":
    main()
