"""A recorded trial as moments for images, with the latest values at each tick. OpenGL is not needed."""

from bisect import bisect_right
from dataclasses import dataclass
from math import floor
from typing import Final

import numpy as np

from palpate.adapters.log import Array, DecisionEntry, TrialLog, series_of
from palpate.adapters.mujoco import Moment
from palpate.core.errors import ConfigurationError, LogError, require_in
from palpate.core.trial import Phase

FORCE_TICKS: Final = 5
"""Number of ticks (36 ms) averaged for a drawn force, because arrows would otherwise flicker with the sample noise."""
_SAME_S: Final = 1e-6
"""Time after an image within which a tick counts as simultaneous, because both times are rounded."""


@dataclass(frozen=True)
class Trajectory:
    """All moments in a trial in order, and whether their forces are tared."""

    moments: tuple[Moment, ...]
    tared: bool

    @property
    def duration_s(self) -> float:
        """Return the time of the last moment."""
        return self.moments[-1].time_s

    def stretch(self, begin_s: float | None, end_s: float | None) -> tuple[float, float]:
        """Return the beginning and end of the part to show, limited to the trial's duration."""
        last = self.duration_s
        begin, end = 0.0 if begin_s is None else begin_s, last if end_s is None else end_s
        require_in("begin_s", begin, 0.0, round(last, 3))
        if not begin <= end:
            raise ConfigurationError("end_s", end, f"a time after the beginning, {begin:g} s")
        return min(begin, last), min(end, last)

    def film(self, begin_s: float, end_s: float, fps: float, speed: float, most: int) -> list[Moment]:
        """Return a moment for each frame of a video, including the last. ``speed`` is trial time over video time."""
        step_s = speed / fps
        count = floor((end_s - begin_s) / step_s + _SAME_S) + 1
        if count > most:
            accepted = f"lower, or the speed higher: {count} frames are more than {most}"
            raise ConfigurationError("fps", fps, accepted)
        times = [begin_s + k * step_s for k in range(count)]
        if end_s - times[-1] > _SAME_S:
            times.append(end_s)
        known = np.array([moment.time_s for moment in self.moments])
        rows = np.searchsorted(known, np.array(times) + _SAME_S, side="right") - 1
        return [self.moments[max(int(row), 0)] for row in rows]


def trajectory_of(log: TrialLog) -> Trajectory:
    """Return the moments in a trial, from the first tick with a time and joint angles.

    Raises:
        LogError: There is no such tick, or a message is invalid.
    """
    series = series_of(log)
    phase_ticks, phases = zip((-1, Phase.LIFT.value), *log.phases, strict=True)
    decision_ticks, decisions = _decisions(log)
    wrenches: list[Array] = []
    begin_s: float | None = None
    moments: list[Moment] = []
    for row in np.flatnonzero(series.ticks >= 0):
        tick, wrench = int(series.ticks[row]), series.wrench[row]
        wrenches = [] if np.isnan(wrench[0]) else [*wrenches, wrench][-FORCE_TICKS:]
        if np.isnan(series.joints_rad[row, 0]):
            continue
        time_s = float(series.time_s[row])
        begin_s = time_s if begin_s is None else begin_s
        fx, fy, fz, tx, ty, tz = np.mean(wrenches, axis=0).tolist() if wrenches else (np.nan,) * 6
        moments.append(
            Moment(
                tick,
                time_s - begin_s,
                tuple(series.joints_rad[row].tolist()),
                (fx, fy, fz) if wrenches else None,
                (tx, ty, tz) if wrenches else None,
                phases[bisect_right(phase_ticks, tick) - 1],
                decisions[bisect_right(decision_ticks, tick) - 1],
            )
        )
    if not moments:
        raise LogError(log.path, "", "has no tick with a time and joint angles", "there is nothing to draw")
    return Trajectory(tuple(moments), any(series.tare.bias))


def _decisions(log: TrialLog) -> tuple[list[int], list[DecisionEntry | None]]:
    """Return the decisions with their first ticks; each lasts until the next one or until its phase ends."""
    changes: list[tuple[int, DecisionEntry | None]] = [(d.tick, d) for d in log.decisions]
    changes += [(tick, None) for tick, _ in log.phases]
    changes.sort(key=lambda change: change[0])
    return [-1, *(tick for tick, _ in changes)], [None, *(decision for _, decision in changes)]
