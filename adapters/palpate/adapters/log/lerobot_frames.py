"""A trial as frames of a fixed rate. Nothing is interpolated: a frame holds what was newest at its time.

This is the only place where the times of a log are changed, and every frame says how old its samples are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.tick_layout import TickRecord
from palpate.core.errors import LogError
from palpate.core.insertion.trial import Outcome
from palpate.core.ports.values import AppliedCommand, JointSample, JointVector, Validity, WrenchSample

Floats: TypeAlias = npt.NDArray[np.float64]
Whole: TypeAlias = npt.NDArray[np.int64]

_NS: Final = 1_000_000_000
_SAME_NS: Final = 1_000
"""A tick that comes so little after a frame's time counts as being at it: both are rounded to whole nanoseconds."""


@dataclass(frozen=True)
class Frames:
    """Frames of one trial; arrays with one row a frame.

    Attributes:
        joints_rad: Joint angles, (n, joints).
        wrench: Force in N and torque in N m, as the sensor gave them, (n, 6).
        wrench_age_s: The frame's time minus the time at which the wrench was measured, (n,).
        joints_age_s: The same of the joint angles, (n,).
        trusted: Whether the newest readings of both were marked valid, (n,).
        applied_rad: The command as applied, (n, joints).
        asked_rad: The command as asked, (n, joints).
        tick: Number of the control tick that the frame shows, (n,).
        reward: What was earned after this frame and up to the next, (n,).
        success: Whether the trial came to success; by the world's truth where it is known, else by the outcome.
        ended: Whether the log goes to the trial's end.
    """

    joints_rad: Floats
    wrench: Floats
    wrench_age_s: Floats
    joints_age_s: Floats
    trusted: npt.NDArray[np.bool_]
    applied_rad: Floats
    asked_rad: Floats
    tick: Whole
    reward: Floats
    success: bool
    ended: bool

    def __len__(self) -> int:
        return len(self.tick)


@dataclass(frozen=True)
class _Row:
    """What was newest at one tick."""

    time_ns: int
    tick: int
    wrench: WrenchSample
    joints: JointSample
    asked: JointVector
    applied: AppliedCommand
    trusted: bool


def frames_of(log: TrialLog, fps: int) -> Frames:
    """Frames from the first tick at which everything was there to the last tick.

    A sample that its device marked invalid holds no measurement: the one before stays, and grows older.

    Args:
        log: The trial.
        fps: Frames per second, at least 1.

    Raises:
        LogError: At no tick was everything there, or the arm's number of joints changes.
    """
    rows = _rows(log)
    if not rows:
        raise LogError(log.path, "", "has no tick with samples and a command", "there is nothing to export")
    sizes = {len(v) for r in rows for v in (r.joints.position_rad, r.asked, r.applied.position_rad)}
    if len(sizes) > 1:
        raise LogError(log.path, "", f"has {sorted(sizes)} joints", "one arm has one number of joints")
    first_ns, last_ns = rows[0].time_ns, rows[-1].time_ns
    count = (last_ns - first_ns + _SAME_NS) * fps // _NS + 1
    frame_ns = first_ns + np.arange(count, dtype=np.int64) * _NS // fps
    row_ns = np.array([row.time_ns for row in rows], dtype=np.int64)
    shown = np.searchsorted(row_ns, frame_ns + _SAME_NS, side="right") - 1

    def column(values: list[Any], kind: Any = np.float64) -> npt.NDArray[Any]:
        return np.array(values, dtype=kind)[shown]

    tick = column([row.tick for row in rows], np.int64)
    return Frames(
        joints_rad=column([row.joints.position_rad for row in rows]),
        wrench=column([(*row.wrench.force_N, *row.wrench.torque_Nm) for row in rows]),
        wrench_age_s=(frame_ns - column([row.wrench.source_time_ns for row in rows], np.int64)) / _NS,
        joints_age_s=(frame_ns - column([row.joints.source_time_ns for row in rows], np.int64)) / _NS,
        trusted=column([row.trusted for row in rows], np.bool_),
        applied_rad=column([row.applied.position_rad for row in rows]),
        asked_rad=column([row.asked for row in rows]),
        tick=tick,
        reward=_rewards(log, tick),
        success=_success(log),
        ended=log.end is not None and not log.end.error,
    )


def _rows(log: TrialLog) -> list[_Row]:
    rows: list[_Row] = []
    wrench: WrenchSample | None = None
    joints: JointSample | None = None
    asked: JointVector | None = None
    applied: AppliedCommand | None = None
    # Of each port the newest reading's validity, also when its values were not kept.
    trust = {"wrench": False, "joints": False}
    for record in log.records():
        if record.wrench is not None:
            trust["wrench"] = record.wrench.validity is Validity.VALID
            wrench = wrench if record.wrench.validity is Validity.INVALID else record.wrench
        if record.joints is not None:
            trust["joints"] = record.joints.validity is Validity.VALID
            joints = joints if record.joints.validity is Validity.INVALID else record.joints
        if record.asked_rad is not None and record.applied is not None:
            asked, applied = record.asked_rad, record.applied
        time_ns = _time_of(record)
        if time_ns is None or wrench is None or joints is None or asked is None or applied is None:
            continue
        rows.append(_Row(time_ns, record.tick, wrench, joints, asked, applied, all(trust.values())))
    return rows


def _time_of(record: TickRecord) -> int | None:
    return record.deadline_ns if record.time_ns is None else record.time_ns


def _rewards(log: TrialLog, tick: Whole) -> Floats:
    """What each decision earned, at the last frame before it was earned: nothing is lost, nothing counted twice."""
    rewards = np.zeros(len(tick))
    for entry in log.reinforcements:
        before = int(np.searchsorted(tick, entry.tick, side="left")) - 1
        rewards[max(before, 0)] += entry.reinforcement
    return rewards


def _success(log: TrialLog) -> bool:
    if log.end is None:
        return False
    return log.end.outcome == Outcome.INSERTED.value if log.end.success is None else log.end.success
