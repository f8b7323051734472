"""Logs as a LeRobotDataset v3.0: one episode a log, frames of a fixed rate, no video."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from palpate.adapters.log.file import finite
from palpate.adapters.log.info import LogInfo, info_of
from palpate.adapters.log.lerobot_files import Episode, Feature, Table, require_pyarrow, write_dataset
from palpate.adapters.log.lerobot_frames import Frames, frames_of
from palpate.adapters.log.reader import TrialLog, read_log
from palpate.adapters.log.series import config_of, tare_of
from palpate.core.errors import LogError
from palpate.core.files import new_folder

FACTS_FILE: Final = "meta/palpate.json"
"""Facts about each episode that the format has no place for."""

_WRENCH_NAMES: Final = ("force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm")


def export_lerobot(paths: Sequence[Path], out: Path, fps: int) -> int:
    """Write logs as a dataset that LeRobot loads; returns the number of frames.

    Args:
        paths: The logs, all of one arm.
        out: The folder; it must not be there yet, or be empty.
        fps: Frames per second.

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
            joints = frames.joints_rad.shape[1]
            if not episodes:
                arm, features = log.start.arm, _features(joints)
            elif (log.start.arm, _features(joints)) != (arm, features):
                problem = f"is of the arm {log.start.arm}, others before it of {arm}"
                raise LogError(log.path, "", problem, "export the logs of each arm by themselves")
            episodes.append(Episode(_table(frames), _task(log)))
            facts.append(_facts(log, frames))
        write_dataset(passing, episodes, features, fps, arm, {"palpate": _summary(episodes, facts)})
        text = json.dumps(finite({"episodes": facts}), indent=2, ensure_ascii=False, allow_nan=False)
        (passing / FACTS_FILE).write_text(text + "\n", encoding="utf-8")
    return sum(len(episode) for episode in episodes)


def _features(joints: int) -> dict[str, Feature]:
    names = tuple(f"joint_{i}_rad" for i in range(1, joints + 1))
    return {
        "observation.state": Feature("float32", joints, names),
        "observation.wrench": Feature("float32", 6, _WRENCH_NAMES),
        "observation.state_age_s": Feature("float32"),
        "observation.wrench_age_s": Feature("float32"),
        "observation.valid": Feature("bool"),
        "action": Feature("float32", joints, names),
        "action.asked": Feature("float32", joints, names),
        "tick": Feature("int64"),
        "next.reward": Feature("float32"),
        "next.done": Feature("bool"),
        "next.success": Feature("bool"),
    }


def _table(frames: Frames) -> Table:
    last = np.arange(len(frames)) == len(frames) - 1
    return {
        "observation.state": frames.joints_rad,
        "observation.wrench": frames.wrench,
        "observation.state_age_s": frames.joints_age_s,
        "observation.wrench_age_s": frames.wrench_age_s,
        "observation.valid": frames.trusted,
        "action": frames.applied_rad,
        "action.asked": frames.asked_rad,
        "tick": frames.tick,
        "next.reward": frames.reward,
        "next.done": last & frames.ended,
        "next.success": last & frames.success,
    }


def _task(log: TrialLog) -> str:
    peg = config_of(log).cell.peg
    return f"insert the {peg.cross_section} peg of {peg.diameter_mm:g} mm into its hole by touch"


def _facts(log: TrialLog, frames: Frames) -> dict[str, Any]:
    info: LogInfo = info_of(log)
    tare = tare_of(log, list(log.records()))
    end = log.end
    return {
        "log": log.path,
        **info.what,
        "outcome": None if end is None else end.outcome or end.error,
        "success": frames.success,
        "success_by": "truth of the world" if end is not None and end.success is not None else "outcome of the core",
        "frames": len(frames),
        "frames_showing_an_older_tick": int(np.sum(np.diff(frames.tick) == 0)),
        "ticks": info.ticks.count,
        "ticks_missing": info.ticks.missing,
        "control_rate_Hz": info.ticks.rate_Hz,
        "wrench_rate_Hz": info.force_sensor.rate_Hz,
        "state_rate_Hz": info.joint_encoder.rate_Hz,
        "wrench_age_s": _spread(frames.wrench_age_s),
        "state_age_s": _spread(frames.joints_age_s),
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
        "valid": "observation.valid: the newest readings of both sensors were marked valid by their devices",
        "achieved_control_rate_Hz": over("control_rate_Hz"),
        "achieved_wrench_rate_Hz": over("wrench_rate_Hz"),
        "achieved_state_rate_Hz": over("state_rate_Hz"),
        "wrench_age_s": pooled("observation.wrench_age_s"),
        "state_age_s": pooled("observation.state_age_s"),
    }


def _spread(values: npt.NDArray[np.float64]) -> dict[str, float]:
    return {"min": float(np.min(values)), "median": float(np.median(values)), "max": float(np.max(values))}
