"""Trials without a pause on an emulated rig, with random passing faults: does anything grow, leak or get lost?

    python -m benchmarks.soak --minutes 30                                      the Zebra's bus and the JR3 on CAN
    python -m benchmarks.soak --minutes 30 --arm cia402 --force jr3-uart

Seven trials in ten have a fault of a kind, at a tick and of a length drawn from the seed. The script is the person who
acknowledges each trip. Memory, threads and open files of all processes are noted after each trial; the slope of memory
over the last four fifths of the time comes with its 95 % confidence interval, as if samples were independent.
"""

from __future__ import annotations

import argparse
import csv
import os
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import stats

from benchmarks.emulated_rig import EmulatedRig, words_of
from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.rig import RigFile
from palpate.adapters.config.run import RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_supervisor, build_task
from palpate.adapters.experiments.policies import comparator
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.fault_injection.campaign.variants import variants
from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.ports import faulty
from palpate.adapters.fault_injection.schedule import FaultDelivery
from palpate.adapters.hardware.approach import find_approach
from palpate.adapters.hardware.real_time.session import RealTimeSession
from palpate.adapters.hardware.rig import HardwareRig
from palpate.adapters.log.reader import read_log
from palpate.adapters.log.trial_recorder import TrialRecorder, trial_name
from palpate.adapters.log.writer_client import ProcessSink
from palpate.core.control_loop import run_trial
from palpate.core.errors import LogError, PalpateError
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.rig import SensorFacts
from palpate.core.trial import Outcome, find_ready_pose

PAGE = os.sysconf("SC_PAGE_SIZE")
FAULTY_SHARE = 0.7


@dataclass(frozen=True)
class Use:
    """What the processes use: ourselves, the log's writer and the emulated devices."""

    own_kB: float
    writer_kB: float
    devices_kB: float
    threads: int
    files: int


def resident_kB(process: int) -> float:
    return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * PAGE / 1024


def use_of(writer: int, devices: int) -> Use:
    me = Path("/proc/self")
    return Use(
        resident_kB(os.getpid()),
        resident_kB(writer),
        resident_kB(devices),
        len(list((me / "task").iterdir())),
        len(list((me / "fd").iterdir())),
    )


def passing_fault(config: RunConfig, seed: int, trial: int) -> FaultPlan | None:
    """A fault that ends again by itself, or none; by seed and trial alone."""
    rng = np.random.default_rng([seed, trial])
    if rng.random() >= FAULTY_SHARE:
        return None
    every = variants(config.supervision)
    chosen, tick, own_seed = every[int(rng.integers(len(every)))], int(rng.integers(0, 450)), int(rng.integers(2**31))
    (plan,) = chosen.at(tick, own_seed, SensorFacts(0.0, 0.0))
    return plan if plan.duration_ticks else replace(plan, duration_ticks=int(rng.integers(1, 31)))


def soak(options: argparse.Namespace, folder: Path, note: Callable[[list[object]], object]) -> list[tuple[float, Use]]:
    """Trials until the time is over; what was used after each."""
    real_time = RealTimeConfig(scheduling=not options.no_rt, lock_memory=not options.no_rt)
    config = replace(scenario("paper"), seed=options.seed, real_time=real_time)
    ready = find_ready_pose(config.arm, config.task)
    perception, policy = build_perception(config), comparator("torque", config, lambda: (0.0, 0.0))
    uses: list[tuple[float, Use]] = []
    sink = ProcessSink(queue_bytes=config.recording.queue_kB * 1000, patient=False)
    with (
        EmulatedRig(folder, *words_of(options.arm, options.force, 0 if options.no_rt else 30)) as devices,
        HardwareRig(
            replace(RigFile.load(devices.path), approach_rad_s=0.8), config, find_approach(config, ready)
        ) as rig,
        TrialRecorder(lambda: sink, folder / "logs", config.recording) as recorder,
        RealTimeSession(real_time) as session,
    ):
        task = build_task(config, ready, perception, policy)
        supervisor = build_supervisor(config, ready, rig.sensor_facts)
        recorder.of("soak", config, ready, task, perception, policy, name="torque")
        begin_s, trial = time.monotonic(), 0
        while time.monotonic() - begin_s < options.minutes * 60.0:
            plan, deliveries, problem = passing_fault(config, options.seed, trial), list[FaultDelivery](), ""
            try:
                rig.prepare(trial)
                setup = trial_setup(config, trial)
                ports = faulty(rig.ports, [] if plan is None else [plan], deliveries.append)
                observer = recorder.begin(setup, rig.world(), trial_name(trial))
                try:
                    with session.loop():
                        report = run_trial(task, ports, setup, supervisor, (observer,))
                    recorder.end(report, {"stopped_by": rig.stopped_by()})
                    outcome = "" if report.outcome is None else report.outcome.value
                    problem = "" if supervisor.trip is None else supervisor.trip.text
                except PalpateError as error:
                    recorder.fail(task.report, error, {"stopped_by": rig.stopped_by()})
                    outcome, problem = type(error).__name__, str(error)
            except PalpateError as error:
                outcome, problem = "not begun", str(error)
            if outcome != Outcome.INSERTED.value:
                rig.return_to_ready()
            # The person who has looked at it.
            if supervisor.latch.cause:
                supervisor.latch.acknowledge("the soak", "what trips here is planned")
            if rig.ports.arm.life is Life.FAULTED:
                rig.ports.arm.acknowledge_fault()
            if rig.ports.force_sensor.life is Life.FAULTED:
                rig.ports.force_sensor.acknowledge_fault()
                rig.ports.force_sensor.activate()
            now_s, use = time.monotonic() - begin_s, use_of(sink.process_id, devices.process_id)
            uses.append((now_s, use))
            fault = "" if plan is None else f"{plan.port} {plan.kind} at {plan.first_tick} for {plan.duration_ticks}"
            note([trial, f"{now_s:.1f}", fault, len(deliveries) > 0, outcome, problem,
                             f"{use.own_kB:.0f}", f"{use.writer_kB:.0f}", f"{use.devices_kB:.0f}",
                             use.threads, use.files])  # fmt: skip
            trial += 1
    return uses


def slope(times_s: np.ndarray, values: np.ndarray) -> str:
    fit = stats.linregress(times_s / 60.0, values)
    half = float(stats.t.ppf(0.975, len(values) - 2)) * fit.stderr
    return (
        f"{fit.slope:+.2f} kB/min (95 % from {fit.slope - half:+.2f} to {fit.slope + half:+.2f}), {values[-1]:.0f} kB"
    )


def judge(folder: Path, uses: list[tuple[float, Use]]) -> None:
    with (folder / "trials.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    print(f"{len(rows)} trials, {sum(row['fault'] != '' for row in rows)} with a fault planned,"
          f" delivered in {sum(row['delivered'] == 'True' for row in rows)}")  # fmt: skip
    for name, count in Counter(row["outcome"] for row in rows).most_common():
        print(f"  {count:5d} {name}")
    sound, broken = 0, []
    for row in rows:
        path = folder / "logs" / f"{trial_name(int(row['trial']))}.mcap"
        try:
            log = read_log(path)
        except (LogError, OSError) as error:
            broken.append(f"{path.name}: {error}")
            continue
        ended = log.end is not None and (log.end.outcome == row["outcome"] or log.end.error == row["outcome"])
        stopped = any((call.port, call.call) == ("arm", "stop") for call in log.calls)
        sound += ended and stopped
        if not (ended and stopped):
            broken.append(f"{path.name}: ended {ended}, arm told to stop {stopped}")
    begun = sum(row["outcome"] != "not begun" for row in rows)
    print(f"logs: {sound} of {begun} trials that began are whole, end as their row says, and with the arm's stop")
    for line in broken[:10]:
        print(f"  {line}")
    late = uses[len(uses) // 5 :]
    times = np.array([at for at, _ in late])
    for name in ("own_kB", "writer_kB", "devices_kB"):
        print(f"{name[:-3]} memory: {slope(times, np.array([getattr(use, name) for _, use in late]))}")
    for name in ("threads", "files"):
        values = [getattr(use, name) for _, use in late]
        print(f"{name}: from {min(values)} to {max(values)}, at the end {values[-1]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--arm", default="zebra-nmc")
    parser.add_argument("--force", default="jr3-can")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="keep logs and the table of trials in this new folder")
    parser.add_argument("--no-rt", action="store_true", help="without real-time scheduling and locked memory")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        if options.out is not None:
            folder = options.out
            folder.mkdir(parents=True)
        with (folder / "trials.csv").open("w", newline="", buffering=1) as file:
            stream = csv.writer(file)
            stream.writerow(["trial", "time_s", "fault", "delivered", "outcome", "problem", "own_kB", "writer_kB",
                             "devices_kB", "threads", "files"])  # fmt: skip
            uses = soak(options, folder, stream.writerow)
        judge(folder, uses)


if __name__ == "__main__":
    main()
