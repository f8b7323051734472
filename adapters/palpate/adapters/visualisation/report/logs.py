"""The logs of a folder: which a report reads, and the forces and the timing that they show."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from mcap.writer import MCAP0_MAGIC

from palpate.adapters.experiments import Array
from palpate.adapters.log import LATE_S, LOG_FOLDER, NS, TrialLog, series_of
from palpate.adapters.visualisation.report.canvas import COLOURS, GREY, drawn
from palpate.adapters.visualisation.report.page import PageSection, PageTable, Picture, counted
from palpate.core.errors import LogError
from palpate.core.ports import CONTROL_RATE_HZ

_TORN: Final = "ends in the middle, so it is torn or still being written"
_REMEDY: Final = "palpate log recover writes a sound one (then move this one away), or leave logs out with --no-logs"


def logs_in(folder: Path) -> tuple[Path, ...]:
    """The logs below a run's folder ``logs``, each looked at from both ends."""
    found = tuple(sorted((folder / LOG_FOLDER).rglob("*.mcap")))
    for path in found:
        _require_whole(path)
    return found


def spread_over(paths: Sequence[Path], most: int) -> tuple[Path, ...]:
    """At most so many of them, evenly: the first and the last are there."""
    if len(paths) <= most:
        return tuple(paths)
    return tuple(paths[round(k * (len(paths) - 1) / (most - 1))] for k in range(most))


def _require_whole(path: Path) -> None:
    size = len(MCAP0_MAGIC)
    try:
        with path.open("rb") as stream:
            whole = stream.read(size) == MCAP0_MAGIC
            stream.seek(0, os.SEEK_END)
            whole = whole and stream.tell() > 2 * size
            if whole:
                stream.seek(-size, os.SEEK_END)
                whole = stream.read(size) == MCAP0_MAGIC
    except OSError as error:
        raise LogError(
            str(path), "", f"cannot be read ({error.strerror})", "or leave logs out with --no-logs"
        ) from error
    if not whole:
        raise LogError(str(path), "", _TORN, _REMEDY)


_ROOM: Final = 0.035
"""Part of the time that a phase must last for its name to have room."""


def force_picture(name: str, log: TrialLog, title: str) -> Picture:
    """Force on the tool, and how deep the tip is, over the time of a trial."""
    series = series_of(log)
    limit_N = series.config.task.max_force_N
    size = np.linalg.norm(series.wrench[:, :3], axis=1)
    peak = float(np.nanmax(size)) if np.isfinite(size).any() else 0.0
    with drawn(4.4) as canvas:
        upper, lower = canvas.figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
        for axis, label in enumerate(("Fx", "Fy", "Fz")):
            upper.plot(
                series.time_s, series.wrench[:, axis], color=COLOURS[axis], linewidth=1.0,
                label=label,
            )  # fmt: skip
        lower.plot(series.time_s, series.tip_mm[:, 2], color="black", linewidth=1.4)
        last_s = max(float(series.time_s[-1]), 1e-3)
        phases = [*((series.time_of(tick), phase) for tick, phase in log.phases), (last_s, "")]
        for (time_s, word), (end_s, _) in pairwise(phases):
            for axes in (upper, lower):
                axes.axvline(time_s, color=GREY, linewidth=0.9, linestyle=":")
            if end_s - time_s > _ROOM * last_s:
                lower.annotate(
                    word, (time_s, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -3),
                    textcoords="offset points", rotation=90, ha="left", va="top", fontsize=9, color="#374151",
                )  # fmt: skip
        upper.set_ylabel("force [N]")
        lower.set(xlabel="time [s]", ylabel="depth [mm]")
        # z points into the hole, and a deeper tip is shown deeper.
        lower.invert_yaxis()
        lower.set_xlim(0.0, last_s)
        canvas.figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=3, frameon=False)
    end = log.end
    came = "the log ends before the trial did" if end is None else str(end.error or end.outcome)
    alt = (
        f"Force on the tool and depth of the tip over {series.time_s[-1]:.1f} s, {title}: {came}. The largest force is"
        f" {peak:.1f} N."
    )
    caption = (
        f"{title}: {came}. Force on the tool in the sensor's frame, less the sensor's zero; largest {peak:.1f} N of"
        f" {limit_N:g} N allowed. Depth by the encoders. Dotted: where a phase begins."
    )
    return Picture(name, alt, caption, canvas.content)


_EXACT_S: Final = 1e-6
"""Intervals that differ by less are of a clock that does not run by itself."""
_TITLE: Final = "Cycle timing"


@dataclass(frozen=True)
class Timing:
    """How regular the ticks of some trials are.

    Attributes:
        interval_ms: Between successive ticks, (n,).
        late_ms: How late ticks began, (m,); empty where no tick had a time at which it was due.
    """

    interval_ms: Array
    late_ms: Array
    missing: int

    @classmethod
    def of(cls, logs: Sequence[TrialLog]) -> Timing:
        """Put several trials together."""
        intervals: list[float] = []
        late: list[float] = []
        missing = 0
        for log in logs:
            timed = [(r.tick, r.time_ns, r.deadline_ns) for r in log.records() if r.time_ns is not None]
            intervals += [(b[1] - a[1]) * NS for a, b in pairwise(timed) if b[0] == a[0] + 1]
            missing += sum(b[0] - a[0] - 1 for a, b in pairwise(timed))
            late += [(time - due) * NS for _, time, due in timed if due is not None]
        return cls(np.array(intervals) * 1e3, np.array(late) * 1e3, missing)

    @property
    def exact(self) -> bool:
        """Whether time waited for the loop, as in the simulator."""
        return bool(np.ptp(self.interval_ms) < _EXACT_S * 1e3)


def timing_section(logs: Sequence[TrialLog], of: str) -> PageSection | None:
    """Figures about the control cycle; None if they hold too few ticks."""
    timing = Timing.of(logs)
    if not len(timing.interval_ms):
        return None
    text = f"From {of}, {counted(len(timing.interval_ms), 'interval')} between ticks."
    if timing.exact:
        text += (
            f" Time waited for the loop, as it does in the simulator: every interval is"
            f" {timing.interval_ms[0]:.4f} ms to the microsecond, so there is no spread to draw."
        )
    pictures = () if timing.exact else (_histogram(timing),)
    return PageSection(_TITLE, (text,), (_table(timing),), pictures)


def _table(timing: Timing) -> PageTable:
    rows = [("interval [ms]", *_spread(timing.interval_ms))]
    if len(timing.late_ms):
        rows.append(("began late by [ms]", *_spread(timing.late_ms)))
    limit_ms = LATE_S * 1e3
    late = int((timing.late_ms > limit_ms).sum())
    caption = f"{counted(late, 'tick')} later than {limit_ms:g} ms, {timing.missing} missing in the logs"
    return PageTable(caption, ("", "median", "99 %", "99.9 %", "longest"), tuple(rows))


def _spread(values: Array) -> tuple[str, ...]:
    return tuple(f"{abs(value) if abs(value) < 5e-5 else value:.4f}" for value in (
        *np.quantile(values, (0.5, 0.99, 0.999)), values.max()
    ))  # fmt: skip


def _histogram(timing: Timing) -> Picture:
    period_ms = 1e3 / CONTROL_RATE_HZ
    shown = [(timing.interval_ms, "interval between ticks [ms]")]
    if len(timing.late_ms):
        shown.append((timing.late_ms, "began late by [ms]"))
    with drawn(2.3 * len(shown)) as canvas:
        for number, (values, label) in enumerate(shown):
            axes = canvas.figure.add_subplot(len(shown), 1, number + 1)
            axes.hist(values, bins=60, color=COLOURS[number], log=True)
            axes.set(xlabel=label, ylabel="ticks")
            axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
            if number == 0:
                axes.axvline(period_ms, color="black", linewidth=1.0, linestyle="--")
    low, high = np.quantile(timing.interval_ms, (0.001, 0.999))
    alt = (
        f"Histogram of {len(timing.interval_ms)} intervals between ticks: 99.8 % from {low:.3f} to {high:.3f} ms, the"
        f" longest {timing.interval_ms.max():.3f} ms; due every {period_ms:.3f} ms."
    )
    return Picture(
        "timing", alt, f"Counts on a logarithmic scale. Dashed: the period, {period_ms:.3f} ms.", canvas.content
    )
