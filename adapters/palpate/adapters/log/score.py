"""Score a trial with the score sheet from the AI for Industry Challenge.

Source: intrinsic-dev/aic, docs/scoring.md, March 2026.

The sheet was designed for cable plugs; here the port is the hole and the plug is the peg. The penalty for off-limit
contacts is omitted, because no log contains such contacts.
"""

from dataclasses import astuple, dataclass, fields
from typing import Final

import numpy as np

from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.records import IMPORTED
from palpate.adapters.log.series import Series, series_of
from palpate.core.trial import Outcome

_INSERTED: Final = 75.0
_PARTIAL: Final = (38.0, 50.0)
"""Points for a peg in the mouth of the hole, and for a peg almost at full depth."""
_NEAR: Final = 25.0
"""Points for a peg at the mouth of the hole. There are none beyond half the initial distance."""
_ASIDE_M: Final = 5e-3
_SMOOTH: Final = 6.0
_MOST_JERK_M_S3: Final = 50.0
_WINDOW: Final = 15
"""Number of samples in the quadratic fit to the velocity: 30 ms in the challenge, 107 ms at 140 Hz."""
_MOVING_M_S: Final = 0.01
_DURATION: Final = 12.0
_FAST_S, _SLOW_S = 5.0, 60.0
_EFFICIENT: Final = 6.0
_DETOUR_M: Final = 1.0
_FORCE: Final = -12.0
_FORCE_N, _FORCE_S = 20.0, 1.0


@dataclass(frozen=True)
class Score:
    """Points for a trial, at most 100."""

    valid: float
    """Points for a valid trial: 1 if the trial ran."""
    success: float
    """Points for the result: 75 if inserted, 38 to 50 for a partial insertion, up to 25 near the hole."""
    smoothness: float
    """Points for smoothness: 6 without jerk."""
    duration: float
    """Points for the duration: 12 within 5 s."""
    efficiency: float
    """Points for the path: 6 for the shortest path."""
    force: float
    """Penalty for force: -12 after more than 1 s above 20 N."""

    @property
    def total(self) -> float:
        """Return the total score."""
        return float(sum(astuple(self)))


@dataclass(frozen=True)
class ScoredTrial:
    """A trial's score from the simulator's ``truth``, the ``outcome`` on a rig, or the ``encoders`` in a bag."""

    path: str
    basis: str
    score: Score


def score_of(log: TrialLog) -> ScoredTrial:
    """Score a trial.

    Raises:
        LogError: The log has no ticks.
    """
    series, end = series_of(log), log.end
    known = np.isfinite(series.tip_mm).all(axis=1)
    tip_m, time_s = series.tip_mm[known] * 1e-3, series.time_s[known]
    is_true = end is not None and end.true_depth_m is not None
    hole_m = np.array(end.true_hole_in_task_m if end is not None and is_true else (0.0, 0.0, 0.0))
    began_m = float(np.linalg.norm(tip_m[0] - hole_m)) if len(tip_m) else 0.0
    success = _success(log, series, tip_m, hole_m, began_m) if len(tip_m) else 0.0
    jerk_m_s3 = mean_jerk_m_s3(tip_m, time_s)
    duration_s = float(series.time_s[-1] - series.time_s[0])
    path_m = float(np.linalg.norm(np.diff(tip_m, axis=0), axis=1).sum())
    above = np.linalg.norm(series.wrench[:, :3], axis=1) > _FORCE_N
    above_s = float((np.diff(series.time_s, append=series.time_s[-1]) * above).sum())
    near = success > 0.0
    score = Score(
        valid=float(end is not None),
        success=success,
        smoothness=near * _falling(_SMOOTH, jerk_m_s3, 0.0, _MOST_JERK_M_S3),
        duration=near * _falling(_DURATION, duration_s, _FAST_S, _SLOW_S),
        efficiency=near * _falling(_EFFICIENT, path_m, began_m, began_m + _DETOUR_M),
        force=_FORCE if above_s > _FORCE_S else 0.0,
    )
    basis = "encoders" if end is not None and end.outcome == IMPORTED else "outcome"
    return ScoredTrial(log.path, "truth" if is_true else basis, score)


def score_table(trials: list[ScoredTrial]) -> str:
    """Format the scores as text, with one line per trial and one for the mean."""
    names = [field.name for field in fields(Score)]
    width = max((len(trial.path) for trial in trials), default=0)
    heads = "".join(f"{name:>12}" for name in (*names, "total"))
    lines = [f"{'log':<{width}}{heads}  basis"]
    rows = [(trial.path, (*astuple(trial.score), trial.score.total), trial.basis) for trial in trials]
    if len(rows) > 1:
        means = tuple(np.mean([points for _, points, _ in rows], axis=0))
        rows.append(("mean", means, ""))
    for name, points, basis in rows:
        lines.append(f"{name:<{width}}" + "".join(f"{value:12.1f}" for value in points) + f"  {basis}".rstrip())
    return "\n".join(lines) + "\n"


def _success(log: TrialLog, series: Series, tip_m: np.ndarray, hole_m: np.ndarray, began_m: float) -> float:
    """Return the points for the insertion, from the ground truth if the log has it."""
    end, task = log.end, series.config.task
    if end is None:
        return 0.0
    tolerance_m = task.depth_tolerance_mm * 1e-3
    full_m = task.insertion_depth_mm * 1e-3
    reported_m = float(tip_m[-1, 2]) if end.outcome == IMPORTED else end.depth_m
    depth_m = reported_m if end.true_depth_m is None else end.true_depth_m
    verified = end.true_depth_m is not None or end.outcome == Outcome.INSERTED.value
    if verified and depth_m >= full_m - tolerance_m:
        return _INSERTED
    last_m = np.array(end.true_tip_in_task_m) if end.true_tip_in_task_m else tip_m[-1]
    away_m = last_m - hole_m
    # A pressing peg bends the plate by micrometres.
    if depth_m > tolerance_m and float(np.hypot(*away_m[:2])) < _ASIDE_M:
        return float(np.interp(depth_m / full_m, (0.0, 1.0), _PARTIAL))
    return _falling(_NEAR, float(np.linalg.norm(away_m)), 0.0, 0.5 * began_m)


def _falling(most: float, value: float, best: float, worst: float) -> float:
    """Return points that decrease linearly from the best value to zero at the worst."""
    return float(np.interp(value, (best, worst), (most, 0.0))) if worst > best else most


def mean_jerk_m_s3(tip_m: np.ndarray, time_s: np.ndarray) -> float:
    """Return a moving tip's mean jerk magnitude from positions (n, 3) m at times (n,), skipping repeated positions."""
    fresh = np.r_[True, np.any(np.diff(tip_m, axis=0) != 0.0, axis=1)] if len(tip_m) else np.zeros(0, bool)
    tip_m, time_s = tip_m[fresh], time_s[fresh]
    if len(tip_m) < _WINDOW:
        return 0.0
    velocity_m_s = np.gradient(tip_m, time_s, axis=0)
    step_s = float(np.median(np.diff(time_s)))
    # Twice the curvature of a parabola through each window; at both ends that of the outermost window.
    curvature = np.linalg.pinv(np.vander(np.arange(_WINDOW) * step_s, 3))[0]
    windows = np.lib.stride_tricks.sliding_window_view(velocity_m_s, _WINDOW, axis=0)
    jerk_m_s3 = np.pad(2.0 * windows @ curvature, ((_WINDOW // 2, _WINDOW // 2), (0, 0)), mode="edge")
    moving = np.linalg.norm(velocity_m_s, axis=1) > _MOVING_M_S
    return float(np.linalg.norm(jerk_m_s3[moving], axis=1).mean()) if moving.any() else 0.0
