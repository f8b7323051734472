"""What recording costs: wall time of training, and the tick, with the writer in the loop, in a thread, in a process.

    python -m benchmarks.recording             free-running and in real time (some minutes)
    python -m benchmarks.recording --quick

All ways run the same trials (equal to the bit) turn by turn in one process, so that a machine that slows down slows all
of them. The tick is what happens between two stretches of physics: ports, core, recorder.
"""

from __future__ import annotations

import argparse
import queue
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from palpate.adapters.config.run import RecordingConfig, RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import learning_policy
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.log.file import LogFile, NewFile, describe_channels
from palpate.adapters.log.trial_recorder import TrialRecorder
from palpate.adapters.log.writer_client import Opening, ProcessSink, Sink
from palpate.adapters.log.writer_process import messages_in
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.core.trial import ReadyPose, find_ready_pose

WAYS = ("none", "in the loop", "thread", "process")


class InLoop(Sink):
    """Writes at once, in the loop."""

    def open(self, opening: Opening) -> None:
        self._file = NewFile(opening.path)
        self._log = LogFile(self._file, describe_channels(), opening.metadata)

    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        for channel, time_ns, payload in messages_in(frames):
            self._log.add(channel, time_ns, payload)
        return True

    def close(self, frames: bytes) -> None:
        self.put(frames)
        self._log.finish()
        self._file.close()

    def trouble(self) -> str | None:
        return None

    def shut(self) -> str | None:
        return None


class InThread(Sink):
    """Hands over to a thread of this process, which does what ``InLoop`` does."""

    def __init__(self) -> None:
        self._inner = InLoop()
        self._queue: queue.SimpleQueue[Callable[[], object] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def _work(self) -> None:
        while (job := self._queue.get()) is not None:
            job()

    def open(self, opening: Opening) -> None:
        self._queue.put(lambda: self._inner.open(opening))

    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        self._queue.put(lambda: self._inner.put(frames))
        return True

    def close(self, frames: bytes) -> None:
        self._queue.put(lambda: self._inner.close(frames))

    def trouble(self) -> str | None:
        return None

    def shut(self) -> str | None:
        self._queue.put(None)
        self._thread.join()
        return None


def sink_of(way: str) -> Sink:
    if way == "in the loop":
        return InLoop()
    return InThread() if way == "thread" else ProcessSink(queue_bytes=4_096_000, patient=True)


class Bench:
    """One training course, run by one way of recording, timed trial by trial."""

    def __init__(self, way: str, config: RunConfig, ready: ReadyPose, folder: Path, *, paced: bool) -> None:
        self.seconds: list[float] = []
        self.ticks_s: list[float] = []
        self._config, self._paced = config, paced
        perception = build_perception(config)
        policy = learning_policy(config, perception)
        self._task = build_task(config, ready, perception, policy)
        self._rig = SimulatedRig(config, ready).__enter__()
        self._recorder: TrialRecorder | None = None
        if way != "none":
            self._recorder = TrialRecorder(lambda: sink_of(way), folder / way, RecordingConfig()).__enter__()
            self._recorder.of("bench", config, ready, self._task, perception, policy, frozen=False)
        self._marks: list[tuple[float, float]] = []
        self._advance = self._rig.cell.advance
        self._rig.cell.advance = self._timed_advance  # type: ignore[method-assign]
        self._due = 0.0

    def _timed_advance(self) -> None:
        begin = time.perf_counter()
        self._advance()
        if self._paced:
            self._due = max(self._due + 1.0 / CONTROL_RATE_HZ, begin)
            time.sleep(max(self._due - time.perf_counter(), 0.0))
        self._marks.append((begin, time.perf_counter()))

    def run(self, trial: int) -> int:
        self._marks.clear()
        begin = time.perf_counter()
        report = run_scored_trial(self._config, self._rig, self._task, trial, self._recorder).report
        self.seconds.append(time.perf_counter() - begin)
        self.ticks_s += [after[0] - before[1] for before, after in pairwise(self._marks)]
        return report.ticks

    def close(self) -> float:
        """Time that finishing the logs takes at the end."""
        begin = time.perf_counter()
        if self._recorder is not None:
            self._recorder.__exit__()
        self._rig.__exit__(None, None, None)
        return time.perf_counter() - begin


@dataclass(frozen=True)
class Measured:
    """What one way of recording took.

    Attributes:
        seconds: Wall time of each trial.
        end_s: What finishing the logs took at the end.
        tick_us: Each tick between two stretches of physics.
    """

    seconds: np.ndarray
    end_s: float
    tick_us: np.ndarray

    @property
    def whole_s(self) -> float:
        return float(self.seconds.sum()) + self.end_s


def measured(trials: int, ways: Sequence[str] = WAYS, *, paced: bool) -> tuple[int, dict[str, Measured]]:
    """Ticks of a course, and what each way took."""
    config = scenario("paper")
    ready = find_ready_pose(config.arm, config.task)
    with tempfile.TemporaryDirectory() as folder:
        benches = {way: Bench(way, config, ready, Path(folder), paced=paced) for way in ways}
        total = 0
        for trial in range(trials):
            # Back and forth, so that no way always comes after the same one.
            order = ways if trial % 2 == 0 else ways[::-1]
            ticks = {benches[way].run(trial) for way in order}
            if len(ticks) != 1:
                raise SystemExit(f"trial {trial} is not the same for all: {ticks}")
            total += ticks.pop()
        ends = {way: bench.close() for way, bench in benches.items()}
    found = {
        way: Measured(np.array(bench.seconds), ends[way] if way != "none" else 0.0, np.array(bench.ticks_s) * 1e6)
        for way, bench in benches.items()
    }
    return total, found


def compare(trials: int, *, paced: bool) -> None:
    total, found = measured(trials, paced=paced)
    print(f"{'real time' if paced else 'free-running'}: {trials} trials, {total} ticks each")
    floor = found["none"].whole_s
    for way, one in found.items():
        median, high = np.quantile(one.tick_us, [0.5, 0.999])
        share = "" if paced else f"wall time {100 * (one.whole_s / floor - 1):+5.1f} %, "
        print(
            f"  {way:12s} {share}tick median {median:5.1f} us, 99.9th percentile {high:6.0f} us,"
            f" worst {one.tick_us.max():7.0f} us"
        )
    if not paced:
        ratios = found["process"].seconds / found["none"].seconds
        low, high = np.quantile(
            [np.mean(np.random.default_rng(k).choice(ratios, len(ratios))) for k in range(1000)], [0.025, 0.975]
        )
        print(
            f"  process against none, trial by trial: mean ratio {ratios.mean():.3f}"
            f" [{low:.3f}, {high:.3f}] (at most 1.08)"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    compare(20 if quick else 120, paced=False)
    compare(1 if quick else 4, paced=True)


if __name__ == "__main__":
    main()
