"""What a campaign came to, as a table for people and as CSV."""

import dataclasses
from collections.abc import Sequence
from typing import Final

from palpate.adapters.fault_injection.campaign.runs import Class, FaultRun
from palpate.adapters.log import aligned, csv_text

_SHOWN: Final = (Class.TOLERABLE, Class.DETECTED, Class.UNOBSERVABLE, Class.FAILED, Class.FALSE_SUCCESS)


def table(runs: Sequence[FaultRun], *, by_phase: bool = False) -> str:
    """One line a fault, over all phases and seeds; or one for each phase of it."""
    head = ("fault", "phase", "runs", "struck", *(verdict.value for verdict in _SHOWN), "latched", "safe stop",
            "worst ticks", "peak N", "damage", "log intact")  # fmt: skip
    lines: list[tuple[str, ...]] = [head if by_phase else (head[0], *head[2:])]
    for name, phase in dict.fromkeys((run.variant, run.phase if by_phase else "") for run in runs):
        own = [run for run in runs if run.variant == name and phase in ("", run.phase)]
        stops = [run.ticks_to_stop for run in own if run.ticks_to_stop is not None]
        cells = (
            str(len(own)),
            str(sum(run.delivered for run in own)),
            *(str(sum(run.verdict is verdict for run in own)) for verdict in _SHOWN),
            str(sum(run.latched for run in own)),
            str(sum(run.safe_stop for run in own)),
            str(max(stops)) if stops else "-",
            f"{max(run.peak_force_N for run in own):.1f}",
            str(sum(run.damage for run in own)),
            str(sum(run.log_intact for run in own)),
        )
        lines.append((name, phase, *cells) if by_phase else (name, *cells))
    return aligned(lines, left=2 if by_phase else 1)


def summary(runs: Sequence[FaultRun]) -> str:
    """What counts, in a few lines."""
    untrue = [run for run in runs if run.verdict is Class.FALSE_SUCCESS]
    failed = [*untrue, *(run for run in runs if run.verdict is Class.FAILED)]
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
    text += f"runs in which the arm was told to stop at the end: {sum(run.safe_stop for run in runs)}\n"
    text += f"failed: {len(failed)}\n"
    if untrue:
        text += f"of these said what was not so: {len(untrue)}\n"
    for run in failed[:10]:
        text += (
            f"  {run.variant}, {run.phase}, seed {run.seed}: {run.cause or run.outcome},"
            f" stop after {run.ticks_to_stop} ticks, peak {run.peak_force_N:.1f} N{', damage' if run.damage else ''}"
            f"{'' if run.log_intact else ', log not intact'}\n"
        )
    return text


def as_csv(runs: Sequence[FaultRun]) -> str:
    """One line a run."""
    header = [field.name for field in dataclasses.fields(FaultRun)]
    return csv_text([header, *([*dataclasses.astuple(run)[:-1], run.verdict.value] for run in runs)])
