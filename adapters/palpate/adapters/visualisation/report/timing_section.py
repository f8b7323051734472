"""How regular the control cycle was, from logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from palpate.adapters.experiments.statistics import Array
from palpate.adapters.log.file import json_in
from palpate.adapters.log.info import LATE_S, NS
from palpate.adapters.log.reader import TrialLog
from palpate.adapters.visualisation.report.canvas import COLOURS, drawn
from palpate.adapters.visualisation.report.page import PageSection, PageTable, Picture, counted
from palpate.core.ports.values import CONTROL_RATE_HZ

_EXACT_S: Final = 1e-6
"""Intervals that differ by less are of a clock that does not run by itself."""
_TITLE: Final = "Cycle timing"


@dataclass(frozen=True)
class Timing:
    """The beat of some trials.

    Attributes:
        interval_ms: Between successive ticks, (n,).
        late_ms: How late ticks began, (m,); empty where no tick had a time at which it was due.
        missing: Ticks that the logs lack.
        sections: Where the time of a tick went, in ns, as the last log with a stopwatch tells it; empty without.
    """

    interval_ms: Array
    late_ms: Array
    missing: int
    sections: dict[str, dict[str, float]]

    @classmethod
    def of(cls, logs: Sequence[TrialLog]) -> Timing:
        """Put several trials together.

        Raises:
            LogError: A part of one is not what it should be.
        """
        intervals: list[float] = []
        late: list[float] = []
        missing = 0
        sections: dict[str, dict[str, float]] = {}
        for log in logs:
            timed = [(r.tick, r.time_ns, r.deadline_ns) for r in log.records() if r.time_ns is not None]
            intervals += [(b[1] - a[1]) * NS for a, b in pairwise(timed) if b[0] == a[0] + 1]
            missing += sum(b[0] - a[0] - 1 for a, b in pairwise(timed))
            late += [(time - due) * NS for _, time, due in timed if due is not None]
            if log.end is not None and log.end.timing_json:
                told: Any = json_in(log, "end.timing_json", log.end.timing_json)
                sections = {name: times for name, times in told.get("sections", {}).items() if times["count"]}
        return cls(np.array(intervals) * 1e3, np.array(late) * 1e3, missing, sections)

    @property
    def exact(self) -> bool:
        """Whether time waited for the loop, as in the simulator."""
        return bool(np.ptp(self.interval_ms) < _EXACT_S * 1e3)


def timing_section(logs: Sequence[TrialLog], of: str) -> PageSection | None:
    """What the logs tell of the control cycle; None if they hold too few ticks.

    Args:
        logs: Some trials.
        of: Which of how many they are, in words.
    """
    timing = Timing.of(logs)
    if not len(timing.interval_ms):
        return None
    text = f"From {of}, {counted(len(timing.interval_ms), 'interval')} between ticks."
    if timing.exact:
        text += (
            f" Time waited for the loop, as it does in the simulator: every interval is"
            f" {timing.interval_ms[0]:.4f} ms to the microsecond, so there is no spread to draw."
        )
    tables = [_table(timing)] + ([_sections(timing)] if timing.sections else [])
    pictures = () if timing.exact else (_histogram(timing),)
    return PageSection(_TITLE, (text,), tuple(tables), pictures)


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


def _sections(timing: Timing) -> PageTable:
    names = ("median_ns", "p99_ns", "p999_ns", "max_ns")
    rows = tuple((name, *(f"{times[key] * 1e-3:.1f}" for key in names)) for name, times in timing.sections.items())
    return PageTable(
        "Where the time of a tick goes [µs], from the run's start, as the last of these logs tells it",
        ("", "median", "99 %", "99.9 %", "longest"),
        rows,
    )


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
    return Picture("timing", alt, f"Counts on a logarithmic scale. Dashed: the period, {period_ms:.3f} ms.", canvas.png)
