"""Ticks of a trial as arrays over time, with the tip's position in the task frame."""

import re
import tomllib
from dataclasses import dataclass
from math import isfinite
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.log.info import NS
from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.records import TickRecord
from palpate.core.errors import ConfigurationError, LogError, PalpateError
from palpate.core.ports import Validity, WrenchSample

NO_NEWS: Final = (Validity.INVALID, Validity.STALE)
"""Validity of samples that contain no new measurement; they are drawn as a gap."""
_NUMBERS = re.compile(r"(\S+) (\S+) (\S+) N, (\S+) (\S+) (\S+) N m\b")


@dataclass(frozen=True)
class Tare:
    """A sensor's zero offset (Fx Fy Fz in N and Tx Ty Tz in N m, in the samples' frame) and its source."""

    bias: tuple[float, ...]
    origin: str

    def taken_from(self, sample: WrenchSample | None) -> tuple[float, ...] | None:
        """Return the force and torque, (6,), minus the zero offset, or None if there is no current measurement."""
        if sample is None or sample.validity in NO_NEWS:
            return None
        return tuple(a - b for a, b in zip((*sample.force_N, *sample.torque_Nm), self.bias, strict=True))


def tare_of(log: TrialLog) -> Tare:
    """Return the zero offset that the task determined, or zeros if there is none."""
    for event in log.events:
        found = _NUMBERS.match(event.detail) if event.name == "tare" else None
        if found is not None:
            bias = _floats(found.groups())
            if bias is not None:
                return Tare(bias, f"tare event at tick {event.tick}")
    return Tare((0.0,) * 6, "nothing: raw, because there is no tare event")


def _floats(texts: tuple[str, ...]) -> tuple[float, ...] | None:
    try:
        values = tuple(float(text) for text in texts)
    except ValueError:
        return None
    return values if all(isfinite(value) for value in values) else None


Array: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Series:
    """Arrays with one row per tick; NaN for missing values and missing ticks.

    Attributes:
        ticks: Tick numbers, (n,); -1 in a row for missing ticks.
        wrench: Force in N and torque in N m, tared, in the samples' own frame, (n, 6).
        tip_mm: Tip position according to the encoders, (n, 3), in the task frame.
        altered_mrad: Applied minus requested command, (n, joints).
    """

    config: RunConfig
    ticks: npt.NDArray[np.int64]
    time_s: Array
    wrench: Array
    tip_mm: Array
    joints_rad: Array
    command_rad: Array
    altered_mrad: Array
    tare: Tare

    def time_of(self, tick: int) -> float:
        """Return the time of a tick in seconds since the first tick, interpolated if the tick is not in the log."""
        there = self.ticks >= 0
        return float(np.interp(tick, self.ticks[there], self.time_s[there]))


def config_of(log: TrialLog) -> RunConfig:
    """Return a trial's configuration.

    Raises:
        LogError: The log has no configuration that this version can use.
    """
    try:
        return overlay(RunConfig(), tomllib.loads(log.start.config_toml))
    except (tomllib.TOMLDecodeError, ConfigurationError) as error:
        raise LogError(
            log.path,
            "start.config_toml",
            f"is not a configuration of this version ({error})",
            "use the version that wrote it",
        ) from error


def series_of(log: TrialLog) -> Series:
    """Return a log's ticks as arrays.

    Raises:
        LogError: The log has no ticks with a time, or a part of it is invalid.
    """
    config = config_of(log)
    records = [record for record in log.records() if _time_ns(record) is not None]
    if not records:
        raise LogError(log.path, "", "has no tick with a time", "there is nothing to draw")
    tare, tip = tare_of(log), _Tip(log, config)
    count = len(log.start.ready_rad)
    joints: tuple[float, ...] = (np.nan,) * count
    rows: list[tuple[float, ...]] = []
    first_ns, before = _time_ns(records[0]) or 0, records[0].tick
    for record in records:
        time_s = ((_time_ns(record) or 0) - first_ns) * NS
        if record.tick > before + 1 and rows:
            # A row without values interrupts the lines at missing ticks.
            rows.append((-1.0, (rows[-1][1] + time_s) / 2, *(np.nan,) * (9 + 3 * count)))
        before = record.tick
        wrench = tare.taken_from(record.wrench) or (np.nan,) * 6
        if record.joints is not None and record.joints.validity is not Validity.INVALID:
            joints = _sized(record.joints.position_rad, count)
        requested = _sized(record.requested_rad or (), count)
        applied = _sized(() if record.applied is None else record.applied.position_rad, count)
        altered = [(b - a) * 1e3 for a, b in zip(requested, applied, strict=True)]
        rows.append((float(record.tick), time_s, *wrench, *tip.at(record), *joints, *applied, *altered))
    table = np.array(rows)
    joint_table, command, altered_mrad = np.split(table[:, 11:], 3, axis=1)
    return Series(
        config=config,
        ticks=table[:, 0].astype(np.int64),
        time_s=table[:, 1],
        wrench=table[:, 2:8],
        tip_mm=table[:, 8:11],
        joints_rad=joint_table,
        command_rad=command,
        altered_mrad=altered_mrad,
        tare=tare,
    )


def _time_ns(record: TickRecord) -> int | None:
    """Return the clock reading at a tick, or its due time if the clock was not read."""
    return record.deadline_ns if record.time_ns is None else record.time_ns


def _sized(values: tuple[float, ...], count: int) -> tuple[float, ...]:
    """Return the values, or NaN if their number differs from the number of joints."""
    return values if len(values) == count else (np.nan,) * count


class _Tip:
    """Forward kinematics for the arm in the log."""

    def __init__(self, log: TrialLog, config: RunConfig) -> None:
        from palpate.core.motion import Kinematics, arm_named
        from palpate.core.trial import goal_in_base

        try:
            self._kinematics = Kinematics(arm_named(config.arm), config.tool.geometry)
        except PalpateError as error:
            raise LogError(
                log.path,
                "start.arm",
                f"its arm's model cannot be used ({error})",
                "fix it, or use the version that wrote it",
            ) from error
        self._base_in_task = goal_in_base(config.task.goal).inverse()

    def at(self, record: TickRecord) -> tuple[float, float, float]:
        joints = record.joints
        if joints is None or joints.validity in NO_NEWS or len(joints.position_rad) != self._kinematics.joints:
            return (np.nan,) * 3
        self._kinematics.update(joints.position_rad)
        x, y, z = self._base_in_task.act(self._kinematics.tip_position_m) * 1e3
        return float(x), float(y), float(z)
