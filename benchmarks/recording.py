"""Methods of writing a log, with the processor time of the loop's thread per tick and the time needed after the trial.

    python -m benchmarks.recording [--trials 20] [--kills 20]

Each method gets the ticks of the same recorded trial. Between two ticks, the caches are cooled, as by physics or a
sleep. The methods alternate, trial by trial. Times are those of the calling thread alone (CLOCK_THREAD_CPUTIME_ID).
With --kills, the method used in palpate runs in real time in a process that is killed, and its log is read.
"""

import argparse
import gc
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from palpate.adapters.log import TICK, FileSink, LogFile, RawMessage, TickRecord, encode, read_log
from palpate.adapters.log.recorder import FlightRecorder
from palpate.core.ports import CONTROL_RATE_HZ, AppliedCommand, JointCommand, Snapshot
from palpate.core.trial import TrialReport, TrialSetup

_LOG = Path(__file__).parents[1] / "tests" / "golden" / "spiral-force-limit.mcap"
_BATCH = 35


def recorded() -> list[tuple[Any, ...]]:
    """Return the deadline, snapshot, command and answer of each complete tick of a golden log."""
    ticks = []
    for r in read_log(_LOG).records():
        if r.time_ns is not None and r.wrench and r.joints and r.requested_rad and r.applied:
            snapshot = Snapshot(r.tick, r.time_ns, r.wrench, r.joints)
            ticks.append((r.deadline_ns, snapshot, JointCommand(r.requested_rad), r.applied))
    return ticks


class Nothing:
    """An empty call, which is the floor. Its slowest ticks are caused by other processes."""

    def __init__(self, path: Path) -> None: ...

    def tick(self, *parts: Any) -> None: ...

    def end(self) -> None: ...


class InTheLoop:
    """Chunks of 35 ticks, packed and written in the loop."""

    def __init__(self, path: Path) -> None:
        self.file, self.batch = path.open("wb"), list[RawMessage]()
        self.log = LogFile(self.file, {})

    def tick(self, *parts: Any) -> None:
        self.batch.append(_packed(*parts))
        if len(self.batch) == _BATCH:
            self.log.add(self.batch)
            self.batch = []

    def end(self) -> None:
        self.log.add(self.batch)
        self.log.finish()
        self.file.close()


class Kept:
    """Tuples that are written after the trial."""

    def __init__(self, path: Path) -> None:
        self.path, self.kept = path, list[tuple[Any, ...]]()

    def tick(self, *parts: Any) -> None:
        self.kept.append(parts)

    def end(self) -> None:
        with self.path.open("wb") as file:
            log = LogFile(file, {})
            for first in range(0, len(self.kept), _BATCH):
                log.add(_packed(*parts) for parts in self.kept[first : first + _BATCH])
            log.finish()


class InAThread:
    """The method used in palpate: records that a thread packs and writes in chunks of 35."""

    def __init__(self, path: Path) -> None:
        self.sink = FileSink()
        self.sink.open(path, {})
        self.recorder = FlightRecorder(self.sink, lambda: read_log(_LOG).start)
        self.recorder.begun(0, TrialReport(TrialSetup(0, 0, (0.0, 0.0))))

    def tick(self, *parts: Any) -> None:
        self.recorder.sent(*parts[1:])

    def end(self) -> None:
        self.recorder.end(None)
        self.sink.close()
        self.sink.shut()


FLOOR = "nothing, the floor"
WAYS: dict[str, tuple[Callable[[Path], Any], str]] = {
    FLOOR: (Nothing, "-"),
    "in the loop": (InTheLoop, "0.25 s"),
    "kept, written after the trial": (Kept, "the trial"),
    "kept, packed and written by a thread": (InAThread, "0.3 s"),
}
"""Each method, and the data that it loses after kill -9."""


def _packed(deadline_ns: int, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> RawMessage:
    return RawMessage(
        TICK.id, snapshot.time_ns, encode(TickRecord.of(deadline_ns, snapshot, command, applied)), snapshot.tick
    )


def killed(path: Path, after_s: float) -> float:
    """Record in real time in a child process, kill it, and return the length of the lost recording in s."""
    command = [sys.executable, "-m", "benchmarks.recording", "--child", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        if child.stdout is None or not child.stdout.readline():
            raise RuntimeError("the child does not start")
        time.sleep(after_s)
        child.kill()
        sent = child.stdout.read().split()
    return (int(sent[-1]) + 1 - len(read_log(path).ticks)) / CONTROL_RATE_HZ


def record_until_killed(path: Path) -> None:
    """Record in real time, and print the number of each recorded tick."""
    ticks, sink = recorded(), FileSink()
    begin = read_log(_LOG).start
    sink.open(path, {})
    recorder = FlightRecorder(sink, lambda: begin)
    recorder.begun(0, TrialReport(TrialSetup(0, 0, (0.0, 0.0))))
    for number, (deadline_ns, snapshot, command, applied) in enumerate(ticks * 100):
        recorder.waited(number, deadline_ns)
        recorder.sent(Snapshot(number, snapshot.time_ns, snapshot.wrench, snapshot.joints), command, applied)
        print(number, flush=True)
        time.sleep(1.0 / CONTROL_RATE_HZ)


def main() -> None:
    """Measure the methods, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--child", type=Path)
    options = parser.parse_args()
    if options.child is not None:
        record_until_killed(options.child)
        return
    if options.kills:
        with tempfile.TemporaryDirectory() as folder:
            chance = random.Random(1)
            lost = [killed(Path(folder) / f"{k}.mcap", chance.uniform(0.3, 2.0)) for k in range(options.kills)]
        print(f"{options.kills} kills, all logs read; lost: {np.median(lost):.3f} s (median), {max(lost):.3f} s (most)")
        return
    trials = options.trials
    ticks, cold = recorded(), np.zeros(1 << 19)
    spent: dict[str, list[float]] = {name: [] for name in WAYS}
    after: dict[str, list[float]] = {name: [] for name in WAYS}
    # As a rig's [real_time] freeze_objects does.
    gc.collect()
    gc.freeze()
    with tempfile.TemporaryDirectory() as folder:
        for trial in range(trials):
            for number, (name, (way, _)) in enumerate(WAYS.items()):
                log = way(Path(folder) / f"{trial}-{number}.mcap")
                for parts in ticks:
                    cold += 1.0
                    began = time.thread_time_ns()
                    log.tick(*parts)
                    spent[name].append((time.thread_time_ns() - began) * 1e-3)
                began = time.process_time_ns()
                log.end()
                after[name].append((time.process_time_ns() - began) * 1e-3 / len(ticks))
    load = os.getloadavg()[0]
    print(
        f"{trials} trials of {len(ticks)} ticks, load {load:.1f}; us a tick of the loop (median, 99.9 %, its ratio to"
    )
    print("the floor's), after the trial; lost by kill -9")
    floor = np.quantile(spent[FLOOR], 0.999)
    for name, (_, lost) in WAYS.items():
        median, high = np.quantile(spent[name], (0.5, 0.999))
        print(f"{name:40} {median:6.1f} {high:6.1f} {high / floor:5.2f} {np.median(after[name]):6.1f}  {lost}")


if __name__ == "__main__":
    main()
