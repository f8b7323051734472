"""Ways to write a log: processor time of the loop's thread in each tick, and what is left to do after the trial.

    python -m benchmarks.recording [--trials 20] [--kills 20]

Each way gets the ticks of the same recorded trial. Between two ticks the caches are cooled, as by physics or a sleep.
The ways take turns, trial by trial. Times are of the calling thread alone (CLOCK_THREAD_CPUTIME_ID). With --kills the
shipped way runs in real time in a process that is killed, and its log is read.
"""

import argparse
import mmap
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer

from palpate.adapters.log import FileSink, RawMessage, message_record, read_log
from palpate.adapters.log.file import LogFile
from palpate.adapters.log.messages import encode_tick
from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.schema import TICK, descriptor_set
from palpate.core.ports import CONTROL_RATE_HZ, JointCommand, Snapshot
from palpate.core.trial import TrialReport, TrialSetup

_LOG = Path(__file__).parents[1] / "tests" / "golden" / "no-contact.mcap"
_BATCH = 35
_JOURNAL_BYTES = 1 << 22


def recorded() -> list[tuple[Any, ...]]:
    """Deadline, snapshot, command and answer of each whole tick of a golden log."""
    ticks = []
    for r in read_log(_LOG).records():
        if r.time_ns is not None and r.wrench and r.joints and r.asked_rad and r.applied:
            snapshot = Snapshot(r.tick, r.time_ns, r.wrench, r.joints)
            ticks.append((r.deadline_ns, snapshot, JointCommand(r.asked_rad), r.applied))
    return ticks


class InTheLoop:
    """The library's writer, a chunk every 35 ticks."""

    def __init__(self, path: Path) -> None:
        self.file, self.count = path.open("wb"), 0
        self.writer: Any = Writer(self.file)
        self.writer.start()
        schema = self.writer.register_schema("Tick", "protobuf", descriptor_set("Tick"))
        self.channel = self.writer.register_channel("/tick", "protobuf", schema)

    def tick(self, *parts: Any) -> None:
        now = parts[1].time_ns
        self.writer.add_message(self.channel, now, encode_tick(*parts), now, self.count)
        self.count += 1
        if self.count % _BATCH == 0:
            self.writer.flush()

    def end(self) -> None:
        self.writer.finish()
        self.file.close()


class Kept:
    """Tuples, written after the trial."""

    def __init__(self, path: Path) -> None:
        self.path, self.kept = path, list[tuple[Any, ...]]()

    def tick(self, *parts: Any) -> None:
        self.kept.append(parts)

    def end(self) -> None:
        with self.path.open("wb") as file:
            log = LogFile(file, {})
            for first in range(0, len(self.kept), _BATCH):
                log.add(_packed(self.kept[first : first + _BATCH]))
            log.finish()


class Journal:
    """Packed messages in a mapped file, which is drained after the trial."""

    def __init__(self, path: Path) -> None:
        self.path, self.at = path, 0
        with path.with_suffix(".journal").open("wb+") as file:
            file.truncate(_JOURNAL_BYTES)
            self.map = mmap.mmap(file.fileno(), _JOURNAL_BYTES)
        self.ends: list[int] = []

    def tick(self, *parts: Any) -> None:
        record = _record(*parts)
        end = self.at + len(record)
        self.map[self.at : end] = record
        self.at = end
        self.ends.append(end)

    def end(self) -> None:
        with self.path.open("wb") as file:
            log, begin = LogFile(file, {}), 0
            for end in [*self.ends[_BATCH - 1 :: _BATCH], self.at]:
                if end > begin:
                    log.add(self.map[begin:end])
                begin = end
            log.finish()
        self.map.close()


class InAThread:
    """As shipped: tuples, 35 at a time, which a thread packs and writes."""

    def __init__(self, path: Path) -> None:
        self.sink, self.batch = FileSink(), list[tuple[Any, ...]]()
        self.sink.open(path, {})

    def tick(self, *parts: Any) -> None:
        self.batch.append(parts)
        if len(self.batch) == _BATCH:
            self.sink.put(partial(_packed, self.batch))
            self.batch = []

    def end(self) -> None:
        self.sink.put(partial(_packed, self.batch))
        self.sink.close()
        self.sink.shut()


WAYS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "in the loop, by the library's writer": (InTheLoop, "0.25 s"),
    "tuples, written after the trial": (Kept, "the trial"),
    "journal in a mapped file, drained after the trial": (Journal, "nothing"),
    "tuples, packed and written by a thread": (InAThread, "0.25 s"),
}
"""The ways, and what a kill -9 costs with each."""


def _record(deadline_ns: int, snapshot: Snapshot, *rest: Any) -> bytes:
    payload = encode_tick(deadline_ns, snapshot, *rest)
    return message_record(RawMessage(TICK.id, snapshot.time_ns, payload, snapshot.tick))


def _packed(ticks: list[tuple[Any, ...]]) -> bytes:
    return b"".join(_record(*parts) for parts in ticks)


def killed(path: Path, after_s: float) -> float:
    """Record in real time in a child, kill it, and return how much of the recording its log lacks, in s."""
    command = [sys.executable, "-m", "benchmarks.recording", "--child", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        if child.stdout is None or not child.stdout.readline():
            raise RuntimeError("the child does not start")
        time.sleep(after_s)
        child.kill()
        sent = child.stdout.read().split()
    return (int(sent[-1]) + 1 - len(read_log(path).ticks)) / CONTROL_RATE_HZ


def record_until_killed(path: Path) -> None:
    """Record in real time, and print the number of each tick that was recorded."""
    ticks, recorder = recorded(), FlightRecorder(FileSink())
    begin = read_log(_LOG).start
    recorder.begin(path, {}, lambda: begin)
    recorder.begun(0, TrialReport(TrialSetup(0, 0, (0.0, 0.0))))
    for number, (deadline_ns, snapshot, command, applied) in enumerate(ticks * 100):
        recorder.waited(number, deadline_ns)
        recorder.sent(Snapshot(number, snapshot.time_ns, snapshot.wrench, snapshot.joints), command, applied)
        print(number, flush=True)
        time.sleep(1.0 / CONTROL_RATE_HZ)


def main() -> None:
    """Measure and print."""
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
    print(f"{trials} trials of {len(ticks)} ticks; us a tick: of the loop, after the trial; lost by kill -9")
    for name, (_, lost) in WAYS.items():
        median, high = np.quantile(spent[name], (0.5, 0.999))
        print(f"{name:50} {median:6.1f} {high:6.1f} {np.median(after[name]):6.1f}  {lost}")


if __name__ == "__main__":
    main()
