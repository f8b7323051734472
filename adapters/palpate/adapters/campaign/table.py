"""What a campaign came to, as a table for people and as CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Sequence

from palpate.adapters.campaign.runs import Class, FaultRun


def table(runs: Sequence[FaultRun]) -> str:
    """One line a fault, over all phases and seeds."""
    head = (
        "fault",
        "runs",
        "struck",
        "tolerable",
        "detected",
        "unobservable",
        "FAILED",
        "damage",
        "worst ticks",
        "peak N",
    )
    lines: list[tuple[str, ...]] = [head]
    for name in dict.fromkeys(run.variant for run in runs):
        own = [run for run in runs if run.variant == name]
        counts = [str(sum(run.verdict is verdict for run in own)) for verdict in Class]
        stops = [run.ticks_to_stop for run in own if run.ticks_to_stop is not None]
        worst = str(max(stops)) if stops else "-"
        peak = f"{max(run.peak_force_N for run in own):.1f}"
        struck = str(sum(run.delivered for run in own))
        damage = str(sum(run.damage for run in own))
        lines.append((name, str(len(own)), struck, *counts, damage, worst, peak))
    widths = [max(len(line[column]) for line in lines) for column in range(len(head))]
    return "".join(
        line[0].ljust(widths[0])
        + "  "
        + "  ".join(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True))
        + "\n"
        for line in lines
    )


def summary(runs: Sequence[FaultRun]) -> str:
    """What counts, in a few lines."""
    failed = [run for run in runs if run.verdict is Class.FAILED]
    stops = [run.ticks_to_stop for run in runs if run.verdict is Class.DETECTED and run.ticks_to_stop is not None]
    hidden = [run for run in runs if run.verdict is Class.UNOBSERVABLE]
    detected = [run for run in runs if run.verdict is Class.DETECTED]
    text = f"{len(runs)} runs, the fault struck in {sum(run.delivered for run in runs)}\n"
    text += f"unreadable logs, or logs that do not tell of their fault: {sum(not run.log_intact for run in runs)}\n"
    if stops:
        peak = max(run.peak_force_N for run in detected)
        hurt = [run for run in detected if run.damage]
        text += f"detected: {len(stops)}; longest way to the stop {max(stops)} ticks; highest peak force {peak:.1f} N\n"
        text += f"stopped in time, and yet with damage: {len(hurt)}"
        text += f" ({', '.join(dict.fromkeys(run.variant for run in hurt))})\n" if hurt else "\n"
    if hidden:
        peak = max(run.peak_force_N for run in hidden)
        text += f"residual risk, which no port shows: {len(hidden)} runs, highest true peak force {peak:.1f} N\n"
    text += f"failed: {len(failed)}\n"
    for run in failed[:10]:
        text += (
            f"  {run.variant}, {run.phase}, seed {run.seed}: {run.outcome}, stop after {run.ticks_to_stop} ticks,"
            f" peak {run.peak_force_N:.1f} N{', damage' if run.damage else ''}"
            f"{'' if run.log_intact else ', log not intact'}\n"
        )
    return text


def as_csv(runs: Sequence[FaultRun]) -> str:
    """One line a run."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(field.name for field in dataclasses.fields(FaultRun))
    for run in runs:
        writer.writerow([*dataclasses.astuple(run)[:-1], run.verdict.value])
    return text.getvalue()
