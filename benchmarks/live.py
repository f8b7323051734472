"""What a live view costs the loop: trials in pairs, with and without it, in turns in one process.

    python -m benchmarks.live --minutes 10                           devices behind wires, in another process
    python -m benchmarks.live --minutes 10 --rig mujoco --viewer rerun
    python -m benchmarks.live --minutes 1 --alone                    nobody connects to the view

Both sides record; a pair is the same trial of the same random walk, and which side comes first changes from pair to
pair. Somebody watches Foxglove's server all the while, in a process that takes every message. Of each trial the median
of the whole tick is taken; stated are the median of the pairs' ratios with its 95 % interval, and missed slots and late
ticks of each side, the latter by cause.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from statistics import median

from scipy.stats import binom

from benchmarks.emulated_rig import emulated_rig
from benchmarks.paced_clock import PacedClock
from palpate.adapters.config.run import RecordingConfig, RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task, task_actions
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.hardware.approach import find_approach
from palpate.adapters.hardware.real_time import Limits, Stopwatch, ThreadAccount
from palpate.adapters.hardware.rig import HardwareRig
from palpate.adapters.log import TrialRecorder, world_of
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.adapters.visualisation.live import LiveView
from palpate.core.control_loop import LoopObserver, run_trial
from palpate.core.errors import PalpateError
from palpate.core.policy import RandomWalkPolicy
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.rig import Rig
from palpate.core.trial import find_ready_pose

CLIENT = """
import json, sys
from websockets.sync.client import connect
with connect(sys.argv[1], subprotocols=["foxglove.sdk.v1"], max_size=None) as server:
    for message in server:
        if isinstance(message, str) and (told := json.loads(message))["op"] == "advertise":
            asked = [{"id": each["id"], "channelId": each["id"]} for each in told["channels"]]
            server.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
"""
SIDES = ("without", "with")


class TickTimes(LoopObserver):
    """How long each tick takes, to the microsecond; a stopwatch's bins are coarser than what is looked for."""

    def __init__(self) -> None:
        self.times_ns: list[int] = []
        self._woken_ns = 0

    def waited(self, tick: int, deadline_ns: int) -> None:
        self._woken_ns = time.perf_counter_ns()

    def ended(self) -> None:
        self.times_ns.append(time.perf_counter_ns() - self._woken_ns)


class Side:
    """One half of the pairs."""

    def __init__(self, recorder: TrialRecorder) -> None:
        self.recorder = recorder
        self.medians_us: list[float] = []
        self.causes: Counter[str] = Counter()
        self.skipped = self.ticks = 0

    def run(self, config: RunConfig, rig: Rig, trial: int, name: str, works: bool) -> None:
        times = TickTimes()
        watch = Stopwatch(
            Limits(warn_late_ns=1_000_000, warm_up_ticks=100), account=ThreadAccount.if_kept(), clock_works=works
        )
        ready, walk = find_ready_pose(config.arm, config.task), RandomWalkPolicy(task_actions(config))
        perception = build_perception(config)
        task = build_task(config, ready, perception, walk)
        self.recorder.of("benchmark", config, ready, task, perception, walk, name="random")
        rig.prepare(trial)
        setup = trial_setup(config, trial)
        observer = self.recorder.begin(setup, world_of(rig), name)
        try:
            report = run_trial(task, rig.ports, setup, None, (times, watch, observer, watch.recording))
        except PalpateError as error:
            self.recorder.fail(task.report, error)
            raise
        self.recorder.end(report, {})
        self.medians_us.append(median(times.times_ns) * 1e-3)
        self.ticks += watch.ticks
        self.skipped += watch.skipped_slots
        self.causes.update({cause.value: count for cause, count in watch.late_ticks.items() if count})


@contextmanager
def opened_rig(name: str, config: RunConfig) -> Iterator[Rig]:
    ready = find_ready_pose(config.arm, config.task)
    if name == "mujoco":
        with SimulatedRig(config, ready) as simulated:
            simulated.ports = replace(simulated.ports, clock=PacedClock(simulated.cell))
            yield simulated
        return
    with (
        emulated_rig("zebra-nmc", "jr3-can", 0) as file,
        HardwareRig(file, config, find_approach(config, ready)) as hardware,
    ):
        yield hardware


def watched(view: LiveView, viewer: str, port: int, opened: ExitStack) -> None:
    if viewer == "foxglove":
        client = subprocess.Popen([sys.executable, "-c", CLIENT, f"ws://127.0.0.1:{port}"])
        opened.callback(client.wait)
        opened.callback(client.terminate)


def interval(values: list[float]) -> tuple[float, float]:
    """Order statistics between which the median lies, 95 %."""
    ordered, count = sorted(values), len(values)
    low = int(binom.ppf(0.025, count, 0.5))
    return ordered[max(low - 1, 0)], ordered[min(count - low, count - 1)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rig", choices=("emulated", "mujoco"), default="emulated")
    parser.add_argument("--viewer", choices=("foxglove", "rerun"), default="foxglove")
    parser.add_argument("--port", type=int, default=8795)
    parser.add_argument("--alone", action="store_true", help="nobody connects")
    options = parser.parse_args()
    config = scenario("paper")
    config = replace(config, task=replace(config.task, time_limit_s=8.0))
    recording = RecordingConfig(when_full="drop")
    with ExitStack() as opened:
        folder = Path(opened.enter_context(tempfile.TemporaryDirectory()))
        view = opened.enter_context(LiveView.serving(options.viewer, options.port))
        if not options.alone:
            watched(view, options.viewer, options.port, opened)
        sides: dict[str, Side] = {}
        for name in SIDES:
            made = TrialRecorder.into(folder / name, recording, view if name == "with" else None)
            assert made is not None
            sides[name] = Side(opened.enter_context(made))
        rig = opened.enter_context(opened_rig(options.rig, config))
        end, pair, failed = time.monotonic() + 60.0 * options.minutes, 0, 0
        while time.monotonic() < end:
            done: dict[str, int] = {name: len(side.medians_us) for name, side in sides.items()}
            try:
                for name in SIDES if pair % 2 else SIDES[::-1]:
                    sides[name].run(config, rig, pair, f"trial-{pair:05d}", options.rig == "mujoco")
            except PalpateError as error:
                # The script is the person who has looked at it. Half a pair is none.
                failed += 1
                print(f"pair {pair}: {error}")
                for name, count in done.items():
                    del sides[name].medians_us[count:]
                rig.return_to_ready()
                if rig.ports.arm.life is Life.FAULTED:
                    rig.ports.arm.acknowledge_fault()
            pair += 1
    off, on = (sides[name] for name in SIDES)
    ratios = [b / a for a, b in zip(off.medians_us, on.medians_us, strict=True)]
    print(f"{options.rig}, {options.viewer}: {len(ratios)} pairs, {failed} failed; {view.account()}")
    if ratios:
        low, high = interval(ratios)
        print(
            f"median of a tick: {median(off.medians_us):.1f} us without, {median(on.medians_us):.1f} us with;"
            f" ratio {median(ratios):.4f} ({low:.4f} to {high:.4f})"
        )
    for name, side in sides.items():
        rate = 1e3 * side.skipped / max(side.ticks + side.skipped, 1)
        print(
            f"{name:>7}: {side.ticks} ticks, {side.skipped} slots missed ({rate:.3f} in 1000), late {dict(side.causes)}"
        )


if __name__ == "__main__":
    main()
