"""The ``palpate plan`` command, which checks whether a job is feasible before anything moves."""

from __future__ import annotations

import os
import shlex
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, get_args

from palpate.adapters.cli.options import PlanOptions
from palpate.adapters.config import INSERTION, RunConfig, compose, read_job, task_kind, verdict_on
from palpate.adapters.files import write_whole
from palpate.adapters.log import figure_kind
from palpate.core.errors import ConfigurationError, UnreachableError
from palpate.core.job import Choice, Derived, Regime, Verdict
from palpate.core.ports import kinds_of
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell import validity_lines

if TYPE_CHECKING:
    from palpate.adapters.experiments import ScoredTrial

_UNITS: Final = (
    ("_N_s_per_m", 1.0, "N s/m"), ("_m_per_N_s", 1e3, "mm/(N s)"), ("_Nm", 1e3, "mN m"), ("_m", 1e3, "mm"),
    ("_N", 1.0, "N"), ("_m_s", 1e3, "mm/s"), ("_N_s", 1.0, "N/s"), ("_s", 1.0, "s"), ("_Hz", 1.0, "Hz"), ("", 1.0, ""),
)  # fmt: skip
"""Name suffix, factor from SI units to the displayed unit, and displayed unit; the first match applies."""


def plan(options: PlanOptions) -> int:
    """Print the derived settings, regime, verdict and results from simulated trials; return the exit code."""
    picture = Path(options.out or f"{Path(options.job).stem}-plan.png")
    figure_kind(picture, "out")
    if options.trials and picture.exists():
        raise ConfigurationError("out", str(picture), "a file that does not exist yet")
    job = read_job(options.job)
    if options.arm:
        job = {**job, "arm": {"name": options.arm}}
    begun = compose("job", job=job)
    verdict = verdict_on(begun, options.task)
    config = compose("job", verdict.choice.learner, {"seed": options.seed}, task=verdict.choice.task, job=job)
    if config.part.depth_tolerance_mm != begun.part.depth_tolerance_mm:
        # A task may have a default tolerance for jobs that specify none.
        verdict = verdict_on(config, verdict.choice.task)
    reasons = list(verdict.reasons)
    # Loading a task kind also loads its phases, which the ready pose of a plain insertion does not need.
    ready = find_ready_pose if config.task.name == INSERTION else task_kind(config.task.name).ready
    try:
        ready(config.arm, config.tool.geometry, config.task)
    except UnreachableError as error:
        reasons.append(f"{error}: move the hole nearer to the arm, or use another arm or posture")
    sys.stdout.write(_account(config, verdict, reasons, options))
    if options.trials and not reasons:
        sys.stdout.flush()
        return _simulated(config, verdict.choice, options, picture, job.get("cell", {}))
    return 1 if reasons else 0


def _account(config: RunConfig, verdict: Verdict, reasons: list[str], options: PlanOptions) -> str:
    lines = [config.part.describe(), f"arm {config.arm}, depth tolerance {config.part.depth_tolerance_mm:g} mm"]
    lines += ["", "derived settings", *_rows(verdict.derived)]
    lines += ["", "regime", *_rows(verdict.regime)]
    valid = validity_lines(config.cell)
    if reasons:
        lines += ["", "verdict: not feasible", *(f"  {reason}" for reason in reasons)]
    else:
        named = ["--job", options.job, *(["--arm", options.arm] if options.arm else [])]
        lines += ["", f"verdict: feasible, {verdict.choice.reason}", f"  {verdict.choice.command} {shlex.join(named)}"]
        lines += [f"  {verdict.caution}"] if verdict.caution else []
    return "\n".join((*lines, *(f"  {line}" for line in valid), ""))


def _rows(found: Derived | Regime) -> Iterator[str]:
    for name, kind in kinds_of(type(found)).items():
        factor, unit = next((factor, unit) for end, factor, unit in _UNITS if name.endswith(end))
        yield f"  {getattr(found, name) * factor:>9.3g} {unit:<8} {get_args(kind)[1]}"


def _simulated(
    config: RunConfig, choice: Choice, options: PlanOptions, picture: Path, stated: dict[str, object]
) -> int:
    from palpate.adapters.cli.progress import progress
    from palpate.adapters.experiments import ScoredTrial, TrialRow, simulate, trials_picture

    done = list[ScoredTrial]()
    with progress(options.trials, "trial", choice.policy or choice.learner) as bar:
        for series, ran in simulate(config, choice.policy, options.trials, options.jobs or os.cpu_count() or 1, stated):
            done += series
            bar.update(ran)
    sys.stdout.write(_rates(config, choice, done))
    rows, kind = [TrialRow.of(each) for each in done], figure_kind(picture, "out")
    write_whole(picture, trials_picture(rows, f"{options.job}, simulated", config.task.max_force_N, kind))
    sys.stdout.write(f"  picture in {picture}\n")
    return 0


def _rates(config: RunConfig, choice: Choice, done: list[ScoredTrial]) -> str:
    from palpate.adapters.experiments import TrialRow, exact_interval, summary_of, untrue

    def rate(name: str, count: int) -> str:
        low, high = exact_interval(count, len(done))
        return f"  {name:<16} {count} of {len(done)} (95 % interval {low:.1%} to {high:.1%})"

    figures = summary_of([TrialRow.of(each) for each in done])
    trips = Counter(each.trip.partition(":")[0] for each in done if each.trip)
    lines = [
        "", f"simulated: {choice.task}, {choice.policy or choice.learner}, seed {config.seed}",
        rate("inserted", sum(each.success for each in done)),
        rate('false "inserted"', sum(untrue(config, each) for each in done)),
        rate("trips", sum(trips.values())) + "".join(f", {reason} {count}" for reason, count in trips.items()),
        f"  time             median {figures['median_s']:.2f} s, 95th percentile {figures['p95_s']:.2f} s",
        f"  highest force    {figures['peak_force_N']:.1f} N (limit {config.limits.force_N:g} N)",
    ]  # fmt: skip
    return "\n".join((*lines, ""))
