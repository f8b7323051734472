"""Sensors that lie plausibly, in every phase, on both arms: does one of them pass for alive?

    python -m benchmarks.liars --seeds 10 --jobs 2 --out LIARS.md
    python -m benchmarks.liars --task insertion-6dof --policy corner-first --seeds 2
    python -m benchmarks.liars --task insertion-6dof --policy hypotheses --seeds 1

Asked for: no trial that says of itself what is not so, such as a peg called inserted that is not; every liar latched,
or tolerable, which is a true force that never exceeded the task's limit and an end that was told truly; no true force
above the hardware's limit.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from benchmarks import insertion_6dof
from palpate.adapters.config import RunConfig, overlay, task_kind
from palpate.adapters.fault_injection.campaign.campaign import Choice, cases, run_cases
from palpate.adapters.fault_injection.campaign.runs import HARDWARE_LIMIT_N, Class, FaultRun
from palpate.core.ports import write_whole

ARMS: Final = ("zebra-zero", "ur5")
TASKS: Final = ("insertion", "insertion-6dof")
POLICIES: Final = {"insertion": "torque", "insertion-6dof": "corner-first"}


def config_of(task: str, arm: str, policy: str) -> RunConfig:
    """The world in which a task is lied to.

    In six degrees of freedom a square peg for the policy that needs corners, a round one for any other.
    """
    if task == "insertion-6dof":
        return insertion_6dof.config_of("square" if policy == POLICIES[task] else "round", "asked", arm, {})
    return overlay(overlay(RunConfig(), task_kind(task).preset), {"arm": arm, "task": {"name": task}})


def loose(run: FaultRun) -> bool:
    """Whether a lie was neither latched nor tolerable."""
    return run.delivered and not run.latched and run.verdict is not Class.TOLERABLE


def table(runs: Sequence[FaultRun]) -> str:
    """One line a liar."""
    lines = [
        "| liar | runs | struck | latched | tolerable | neither | false success | slowest stop, ticks | highest, N |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(run.variant for run in runs):
        own = [run for run in runs if run.variant == name and run.delivered]
        stops = [run.ticks_to_stop for run in own if run.ticks_to_stop is not None]
        cells = (
            name.removeprefix("liar: "),
            sum(run.variant == name for run in runs),
            len(own),
            sum(run.latched for run in own),
            sum(run.verdict is Class.TOLERABLE for run in own),
            sum(map(loose, own)),
            sum(run.verdict is Class.FALSE_SUCCESS for run in own),
            max(stops, default="-"),
            f"{max((run.peak_force_N for run in own), default=0.0):.1f}",
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def verdict(runs: Sequence[FaultRun]) -> str:
    """What was asked for, and each run that did not give it."""
    struck = [run for run in runs if run.delivered]
    bad = [
        run
        for run in struck
        if loose(run) or run.verdict in (Class.FALSE_SUCCESS, Class.FAILED) or run.peak_force_N > HARDWARE_LIMIT_N
    ]
    untrue = sum(run.verdict is Class.FALSE_SUCCESS for run in struck)
    peaks_N = [run.peak_force_N for run in struck]
    text = (
        f"{len(runs)} runs, struck in {len(struck)}; false success {untrue}, neither latched nor tolerable"
        f" {sum(map(loose, struck))}, above {HARDWARE_LIMIT_N:g} N {sum(peak > HARDWARE_LIMIT_N for peak in peaks_N)},"
        f" highest true force {max(peaks_N):.1f} N\n"
    )
    return text + "".join(
        f"- {run.variant}, {run.phase}, seed {run.seed}: {run.outcome}, {run.cause or 'not stopped'},"
        f" {run.peak_force_N:.1f} N, {run.verdict.value}\n"
        for run in bad
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="insertion", choices=TASKS)
    parser.add_argument("--policy", default="", help="corner-first in six degrees of freedom, torque in insertions")
    parser.add_argument("--phase", default="", help="only in this phase")
    parser.add_argument("--fault", default="", help="only liars with this in their name")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="the first of them")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--arms", nargs="+", default=ARMS, choices=ARMS)
    parser.add_argument("--out", type=Path, help="Markdown file for the tables, which must not be there yet")
    options = parser.parse_args()
    text, good = "", True
    for arm in options.arms:
        policy = options.policy or POLICIES.get(options.task, "")
        config, begin_s = config_of(options.task, arm, policy), time.monotonic()
        choice = Choice(group="liars", phase=options.phase, fault=options.fault)
        chosen = [replace(case, seed=case.seed + options.first) for case in cases(config, options.seeds, choice)]
        parts = run_cases(config, chosen, policy=policy, rig_file="", supervised=True, jobs=options.jobs)
        runs = [run for part in parts for run in part]
        minutes = (time.monotonic() - begin_s) / 60.0
        found = verdict(runs)
        good = good and "\n- " not in found
        seeds = f"{options.seeds} seeds from {options.first} on"
        text += f"{options.task}, {arm}, {seeds}, {minutes:.1f} min\n\n{table(runs)}\n\n{found}\n"
    sys.stdout.write(text)
    if options.out is not None:
        write_whole(options.out, text, remedy="name another file with --out")
    raise SystemExit(0 if good else "a requirement is not met")


if __name__ == "__main__":
    main()
