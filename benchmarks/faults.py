"""Simulated trials with device failures or faulty sensor readings in every phase, on two arms.

    python -m benchmarks.faults --seeds 10 --jobs 2 --out FAULTS.md
    python -m benchmarks.faults --group sensors --task insertion-6dof --policy corner-first --seeds 2
    python -m benchmarks.faults --group sensors --parts 10 --first 1
    python -m benchmarks.faults --group devices --no-supervisor

With --parts, trials run on random jobs from `benchmarks.parts`, with the task and policy that `palpate plan` selects. A
learner gets one training trial.

Requirements: no trial reports a false success, every failure of a device is tolerable or stops the trial in time, every
sensor fault is latched or tolerable (the true force never exceeds the task's limit), and no true force exceeds the
hardware limit. Faults without a physical mechanism are listed, but these requirements do not apply to them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from benchmarks.common import table
from benchmarks.parts import drawn, planned, settings
from palpate.adapters.config import RunConfig, overlay, task_kind
from palpate.adapters.experiments import Run
from palpate.adapters.files import write_whole
from tests.support import pegs_6dof
from tests.support.fault_trials import Case, FaultRun, Verdict, cases, run_cases, sensor_faults

HEAD: Final = (
    "fault", "runs", "struck", "latched", "tolerable", "detected", "neither", "failed", "false success",
    "slowest stop, ticks", "highest, N",
)  # fmt: skip
ARMS: Final = ("zebra-zero", "ur5")
TASKS: Final = ("insertion", "insertion-6dof")
POLICIES: Final = {"insertion": "torque", "insertion-6dof": "corner-first"}


def config_of(task: str, arm: str, policy: str) -> RunConfig:
    """Return the settings. In six degrees of freedom, corner-first gets a square peg, other policies a round one."""
    if task == "insertion-6dof":
        return pegs_6dof.config_of("square" if policy == POLICIES[task] else "round", "asked", arm, {})
    return overlay(overlay(RunConfig(), task_kind(task).preset), {"arm": arm, "task": {"name": task}})


def loose(run: FaultRun) -> bool:
    """Return True if a sensor fault was neither latched nor tolerable."""
    return run.fault.plausible and run.delivered and not run.latched and run.verdict is not Verdict.TOLERABLE


def bad(run: FaultRun) -> bool:
    """Return True if a run misses a requirement."""
    if not run.delivered or run.fault.adversarial:
        return False
    too_high = run.fault.plausible and run.peak_force_N > run.damage_N
    return loose(run) or too_high or run.verdict in (Verdict.FALSE_SUCCESS, Verdict.FAILED)


def by_fault(runs: Sequence[FaultRun]) -> str:
    """Return a Markdown table with one line per fault."""
    rows = []
    for name in dict.fromkeys(run.fault.name for run in runs):
        own = [run for run in runs if run.fault.name == name and run.delivered]
        stops = [run.ticks_to_stop for run in own if run.ticks_to_stop is not None]
        counts = [sum(run.verdict is one for run in own) for one in (Verdict.TOLERABLE, Verdict.DETECTED)]
        wrong = [sum(run.verdict is one for run in own) for one in (Verdict.FAILED, Verdict.FALSE_SUCCESS)]
        peak_N = f"{max((run.peak_force_N for run in own), default=0.0):.1f}"
        all_runs, latched = sum(run.fault.name == name for run in runs), sum(run.latched for run in own)
        unclear = sum(map(loose, own))
        rows.append((name, all_runs, len(own), latched, *counts, unclear, *wrong, max(stops, default="-"), peak_N))
    return table(HEAD, rows)


def verdict(runs: Sequence[FaultRun]) -> str:
    """Return the totals, and each run that misses a requirement."""
    struck = [run for run in runs if run.delivered]
    too_high = sum(run.peak_force_N > run.damage_N for run in struck)
    text = (
        f"{len(runs)} runs, struck in {len(struck)}; false success"
        f" {sum(run.verdict is Verdict.FALSE_SUCCESS for run in struck)}, neither latched nor tolerable"
        f" {sum(map(loose, struck))}, failed {sum(run.verdict is Verdict.FAILED for run in struck)}, above twice the"
        f" limit {too_high}, highest true force {max((run.peak_force_N for run in struck), default=0.0):.1f} N,"
        f" {max((2.0 * run.peak_force_N / run.damage_N for run in struck), default=0.0):.2f} times the limit\n"
    )
    return text + "".join(
        f"- {run.fault.name}, {run.phase}, seed {run.seed}: {run.outcome}, {run.cause or 'not stopped'},"
        f" {run.peak_force_N:.1f} N, {run.verdict.value}\n"
        for run in filter(bad, runs)
    )


def worlds_of(options: argparse.Namespace, folder: Path) -> Iterator[tuple[str, RunConfig, str]]:
    """Yield the name, settings and policy of each cell in which faults are injected."""
    if not options.parts:
        for arm in options.arms:
            policy = options.policy or POLICIES[options.task]
            yield f"{options.task}, {arm}", config_of(options.task, arm, policy), policy
        return
    for part in drawn(options.first, options.parts, options.shapes)[0]:
        part, verdict = planned(part, options.shapes)
        config, policy = settings(part, verdict.choice.task, verdict.choice.learner), verdict.choice.policy
        if not policy:
            policy = str(folder / f"{part['id']}" / "policy.json")
            Run(config).train(1, folder / f"{part['id']}")
        yield f"part {part['id']}, {verdict.choice.task}, {part['arm']}", config, policy


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="insertion", choices=TASKS)
    parser.add_argument("--policy", default="", help="corner-first in six degrees of freedom, torque in insertions")
    parser.add_argument("--group", default="all", choices=("all", "devices", "sensors"))
    parser.add_argument("--phase", default="", help="only in this phase")
    parser.add_argument("--fault", default="", help="only faults with this in their name")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--arms", nargs="+", default=ARMS, choices=ARMS)
    parser.add_argument("--parts", type=int, default=0, help="on this many random jobs, drawn with --first as the seed")
    parser.add_argument("--shapes", action="store_true", help="jobs in six degrees of freedom")
    parser.add_argument("--no-supervisor", action="store_true", help="let every command through: runs must then fail")
    parser.add_argument("--out", type=Path, help="new Markdown file for the tables")
    options = parser.parse_args()

    of_sensors = {fault.name for fault in sensor_faults()}

    def kept(case: Case) -> bool:
        group = "sensors" if case.fault.name in of_sensors else "devices"
        return (
            options.group in ("all", group) and options.phase in ("", case.phase) and options.fault in case.fault.name
        )

    text, good = "", True
    with tempfile.TemporaryDirectory() as folder:
        for name, config, policy in worlds_of(options, Path(folder)):
            begin_s = time.monotonic()
            chosen = cases(config, range(options.first, options.first + options.seeds), kept)
            parts = run_cases(config, chosen, policy, jobs=options.jobs, supervised=not options.no_supervisor)
            runs = [run for part in parts for run in part]
            minutes = (time.monotonic() - begin_s) / 60.0
            good = good and not any(map(bad, runs))
            seeds = f"{options.seeds} seeds from {options.first} on"
            found = f"{name}, {seeds}, {minutes:.1f} min\n\n{by_fault(runs)}\n\n{verdict(runs)}\n"
            text += found
            sys.stdout.write(found)
            sys.stdout.flush()
    if options.out is not None:
        write_whole(options.out, text)
    raise SystemExit(0 if good else "a requirement is not met")


if __name__ == "__main__":
    main()
