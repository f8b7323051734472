"""Logs as a LeRobotDataset v3.0: one episode a log, frames of a fixed rate, no video.

This is the only place where the times of a log are changed. Nothing is interpolated: a frame holds what was newest at
its time, and how old its samples are.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.adapters.log.file import finite
from palpate.adapters.log.info import LogInfo, info_of
from palpate.adapters.log.lerobot_decisions import decision_columns
from palpate.adapters.log.lerobot_files import Episode, Feature, Table, require_pyarrow, write_dataset
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.records import TickRecord
from palpate.adapters.log.series import config_of, tare_of
from palpate.core.errors import LogError
from palpate.core.ports import AppliedCommand, JointSample, JointVector, Validity, WrenchSample, new_folder
from palpate.core.trial import Outcome

Floats: TypeAlias = npt.NDArray[np.float64]
Whole: TypeAlias = npt.NDArray[np.int64]

_NS: Final = 1_000_000_000
_SAME_NS: Final = 1_000
"""A tick that comes so little after a frame's time counts as being at it: both are rounded to whole nanoseconds."""


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


def frames_of(log: TrialLog, fps: int) -> Table:
    """The dataset's columns for a trial, from the first tick at which everything was there to the last tick.

    A sample that its device marked invalid holds no measurement: the one before stays, and grows older. An age is the
    frame's time minus that of the measurement; ``tick`` is the control tick that the frame shows. Success is by the
    world's truth where it is known, else by the outcome.
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
    last = np.arange(count) == count - 1
    return {
        "observation.state": column([row.joints.position_rad for row in rows]),
        "observation.wrench": column([(*row.wrench.force_N, *row.wrench.torque_Nm) for row in rows]),
        "observation.state_age_s": (frame_ns - column([row.joints.source_time_ns for row in rows], np.int64)) / _NS,
        "observation.wrench_age_s": (frame_ns - column([row.wrench.source_time_ns for row in rows], np.int64)) / _NS,
        "observation.valid": column([row.trusted for row in rows], np.bool_),
        "action": column([row.applied.position_rad for row in rows]),
        "action.asked": column([row.asked for row in rows]),
        "tick": tick,
        "next.reward": _rewards(log, tick),
        "next.done": last & (log.end is not None and not log.end.error),
        "next.success": last & _success(log),
        **decision_columns(log, tick),
    }


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


FACTS_FILE: Final = "meta/palpate.json"
"""Facts about each episode that the format has no place for."""

_DTYPES: Final = {"f": "float32", "i": "int64", "b": "bool", "U": "string"}
"""Of a dataset's numbers, by numpy's kind."""
_WRENCH_NAMES: Final = ("force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm")


def export_lerobot(paths: Sequence[Path], out: Path, fps: int) -> int:
    """Write logs, all of one arm, as a dataset that LeRobot loads; returns the number of frames.

    Raises:
        ConfigurationError: What writes Parquet files is not installed.
        LogError: A log cannot be used; nothing is written then.
        OutputError: The folder cannot be written.
    """
    require_pyarrow()
    episodes: list[Episode] = []
    facts: list[dict[str, Any]] = []
    arm, features = "", dict[str, Feature]()
    with new_folder(out) as passing:
        for path in paths:
            log = read_log(path)
            frames = frames_of(log, fps)
            if not episodes:
                arm, features = log.start.arm, _features(frames)
            elif (log.start.arm, _features(frames)) != (arm, features):
                problem = f"is of the arm {log.start.arm}, others before it of {arm}"
                raise LogError(log.path, "", problem, "export the logs of each arm by themselves")
            episodes.append(Episode(frames, _task(log)))
            facts.append(_facts(log, frames))
        write_dataset(passing, episodes, features, fps, arm, {"palpate": _summary(episodes, facts)})
        text = json.dumps(finite({"episodes": facts}), indent=2, ensure_ascii=False, allow_nan=False)
        (passing / FACTS_FILE).write_text(text + "\n", encoding="utf-8")
    return sum(len(episode) for episode in episodes)


def _features(frames: Table) -> dict[str, Feature]:
    """The columns as a dataset describes them."""
    joints = tuple(f"joint_{i}_rad" for i in range(1, frames["observation.state"].shape[1] + 1))
    names = dict.fromkeys(("observation.state", "action", "action.asked"), joints)
    names["observation.wrench"] = _WRENCH_NAMES
    return {
        name: Feature(_DTYPES[values.dtype.kind], values[0].size, names.get(name, ()))
        for name, values in frames.items()
    }


def _task(log: TrialLog) -> str:
    peg = config_of(log).cell.peg
    return f"insert the {peg.cross_section} peg of {peg.diameter_mm:g} mm into its hole by touch"


def _facts(log: TrialLog, frames: Table) -> dict[str, Any]:
    info: LogInfo = info_of(log)
    tare = tare_of(log, list(log.records()))
    end = log.end
    return {
        "log": log.path,
        **info.what,
        "outcome": None if end is None else end.outcome or end.error,
        "success": _success(log),
        "success_by": "truth of the world" if end is not None and end.success is not None else "outcome of the core",
        "frames": len(frames["tick"]),
        "frames_showing_an_older_tick": int(np.sum(np.diff(frames["tick"]) == 0)),
        "ticks": info.ticks.count,
        "ticks_missing": info.ticks.missing,
        "control_rate_Hz": info.ticks.rate_Hz,
        "wrench_rate_Hz": info.force_sensor.rate_Hz,
        "state_rate_Hz": info.joint_encoder.rate_Hz,
        "wrench_age_s": _spread(frames["observation.wrench_age_s"]),
        "state_age_s": _spread(frames["observation.state_age_s"]),
        "wrench_tare": tare.bias,
        "wrench_tare_from": tare.origin,
    }


def _summary(episodes: Sequence[Episode], facts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    def over(name: str) -> dict[str, float] | None:
        values = [fact[name] for fact in facts if fact[name] is not None]
        return _spread(np.array(values)) if values else None

    def pooled(column: str) -> dict[str, float]:
        return _spread(np.concatenate([episode.columns[column] for episode in episodes]))

    return {
        "palpate": version("palpate"),
        "resampling": "each frame shows the newest control tick at its time and what was newest then; no interpolation",
        "wrench": "of the world on the tool, N and N m, as the sensor gave it: weight and offset are in it, the zero "
        f"of each episode is in {FACTS_FILE}",
        "state": "joint angles by the encoders, rad",
        "action": "joint command as applied, rad; action.asked is the command as asked",
        "reward": "next.reward is what a decision earned, at the last frame before it was earned",
        "decision": "decision.number is the newest decision's, -1 before the first; state and action are those of the"
        " example that it is, empty for none",
        "valid": "observation.valid: the newest readings of both sensors were marked valid by their devices",
        "achieved_control_rate_Hz": over("control_rate_Hz"),
        "achieved_wrench_rate_Hz": over("wrench_rate_Hz"),
        "achieved_state_rate_Hz": over("state_rate_Hz"),
        "wrench_age_s": pooled("observation.wrench_age_s"),
        "state_age_s": pooled("observation.state_age_s"),
    }


def _spread(values: npt.NDArray[np.float64]) -> dict[str, float]:
    return {"min": float(np.min(values)), "median": float(np.median(values)), "max": float(np.max(values))}
