"""Forces of single trials, from their logs."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.series import Series, series_of
from palpate.adapters.visualisation.report.canvas import COLOURS, GREY, drawn
from palpate.adapters.visualisation.report.page import Picture

_ROOM: Final = 0.035
"""Part of the time that a phase must last for its name to have room."""


def force_picture(name: str, log: TrialLog, title: str) -> Picture:
    """Force on the tool, and how deep the tip is, over the time of a trial.

    Args:
        name: The picture's file name.
        log: The trial.
        title: Of what it is.

    Raises:
        LogError: The log has nothing to draw.
    """
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
        phases = [*_phases(log, series), (last_s, "")]
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
    return Picture(name, alt, caption, canvas.png)


def _phases(log: TrialLog, series: Series) -> list[tuple[float, str]]:
    there = series.ticks >= 0
    return [
        (float(np.interp(event.tick, series.ticks[there], series.time_s[there])), event.detail)
        for event in log.events
        if event.name == "phase"
    ]
