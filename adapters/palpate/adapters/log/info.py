"""Facts about a log: its trial, rates, completeness and outcome."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, median, stdev
from typing import Any, Final

from palpate.adapters.log.json_text import json_in
from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.records import TickRecord
from palpate.adapters.log.schema import CHANNELS
from palpate.core.errors import LogError
from palpate.core.ports import CommandReason, JointSample, Validity, WrenchSample

NS: Final = 1e-9
LATE_S: Final = 0.001
"""A tick whose clock was read so much after the time it was due counts as late."""


@dataclass(frozen=True)
class TimeSpread:
    """Statistics of a time, in seconds. ``None`` where there are too few values."""

    median_s: float | None
    mean_s: float | None
    min_s: float | None
    max_s: float | None
    stdev_s: float | None

    @classmethod
    def of(cls, values: Sequence[float]) -> TimeSpread:
        """Statistics of these."""
        if not values:
            return cls(None, None, None, None, None)
        deviation = stdev(values) if len(values) > 1 else None
        return cls(median(values), fmean(values), min(values), max(values), deviation)


@dataclass(frozen=True)
class PortInfo:
    """What one sensor port gave at the control ticks.

    Attributes:
        unread: Samples of the device between those read, by its sequence numbers.
        rate_Hz: New samples in the log per second of the device's own time.
        device_rate_Hz: The device's samples in that time, by its sequence numbers, whether read or not.
        age: Clock reading of the tick minus the sample's source time.
        not_valid: Numbers of samples that were not valid, by validity.
    """

    samples: int
    new: int
    repeats: int
    unread: int
    rate_Hz: float | None
    device_rate_Hz: float | None
    age: TimeSpread
    delivery: TimeSpread
    not_valid: dict[str, int]


@dataclass(frozen=True)
class TickInfo:
    """How regularly the control loop ran, and what the log lacks of it.

    Attributes:
        rate_Hz: Tick numbers per second of the clock, so that ticks missing in the log do not lower it.
        late: Ticks later than ``LATE_S``.
    """

    count: int
    incomplete: int
    duration_s: float
    rate_Hz: float | None
    interval: TimeSpread
    lateness: TimeSpread
    late: int
    missing: int
    gaps: tuple[tuple[int, int], ...]
    counterfactual: int


@dataclass(frozen=True)
class LogInfo:
    """All that ``palpate log info`` shows of a log.

    Attributes:
        what: What the log is of: command, arm, scenario, seed, trial, policy and so on.
        losses: The recorder's entries about that, in words.
        damage: What is wrong with the file, or missing in it; empty for a sound and whole log.
        trip: Tick, name of the reason and text of the trip that ended it; None without a trip.
        acknowledged: Who had let trials go on before on this rig, why, and after what, in words.
    """

    path: str
    damage: str
    what: dict[str, Any]
    versions: dict[str, str]
    size_bytes: int
    raw_bytes: int
    bytes_per_minute: float | None
    messages: dict[str, int]
    ticks: TickInfo
    force_sensor: PortInfo
    joint_encoder: PortInfo
    altered_commands: dict[str, int]
    dropped_messages: int
    losses: tuple[str, ...]
    errors: tuple[str, ...]
    stops: int
    acknowledged: tuple[str, ...]
    trip: dict[str, Any] | None
    end: dict[str, Any] | None


def info_of(log: TrialLog) -> LogInfo:
    """Look through a log.

    Raises:
        LogError: A part of it is not what it should be.
    """
    records = list(log.records())
    ticks = _ticks(log, records)
    calls = Counter((call.port, call.call) for call in log.calls)
    reasons = [record.applied.reason for record in records if record.applied is not None]
    return LogInfo(
        path=log.path,
        damage="; ".join(filter(None, (log.damage, log.missing))),
        what=_what(log),
        versions={str(k): str(v) for k, v in json_in(log, "start.versions_json", log.start.versions_json).items()},
        size_bytes=log.size_bytes,
        raw_bytes=log.raw_bytes,
        bytes_per_minute=log.size_bytes / ticks.duration_s * 60.0 if ticks.duration_s > 0.0 else None,
        messages={kind.topic: log.counts[kind.id] for kind in CHANNELS},
        ticks=ticks,
        force_sensor=_port([(r.time_ns, r.wrench) for r in records if r.wrench is not None]),
        joint_encoder=_port([(r.time_ns, r.joints) for r in records if r.joints is not None]),
        altered_commands=_counted(reason.value for reason in reasons if reason is not CommandReason.AS_ASKED),
        dropped_messages=sum(loss.dropped_messages for loss in log.losses),
        losses=tuple(f"tick {loss.tick}: {loss.problem}: {loss.text}" for loss in log.losses),
        errors=tuple(f"tick {c.tick}: {c.port}.{c.call}: {c.error}: {c.text}" for c in log.calls if c.error),
        stops=calls["arm", "stop"],
        acknowledged=_acknowledged(log),
        trip=_trip(log),
        end=_end(log),
    )


def _what(log: TrialLog) -> dict[str, Any]:
    start = log.start
    try:
        scenario = tomllib.loads(start.config_toml).get("scenario", "")
    except tomllib.TOMLDecodeError as error:
        problem = f"is no TOML ({error})"
        raise LogError(log.path, "start.config_toml", problem, "it was not written by palpate") from error
    return {
        "command": start.command,
        "arm": start.arm,
        "scenario": scenario,
        "seed": start.seed,
        "trial": start.number,
        "policy": start.policy,
        "frozen": start.frozen,
        "temperature": start.temperature,
        "world": start.world,
        "schema": start.schema,
        "derived_from": start.derived_from,
        "what_if": bool(log.end is not None and log.end.counterfactual) or bool(start.derived_from),
        "drawn": json_in(log, "start.world_json", start.world_json).get("drawn", {}),
    }


def _acknowledged(log: TrialLog) -> tuple[str, ...]:
    found = json_in(log, "start.world_json", log.start.world_json).get("acknowledged", [])
    try:
        return tuple(f"{one['by']}: {one['reason']} (after: {one['cause']})" for one in found)
    except (TypeError, KeyError) as error:
        problem = "says in no known way who acknowledged what"
        raise LogError(log.path, "start.world_json", problem, "it was altered") from error


def _ticks(log: TrialLog, records: Sequence[TickRecord]) -> TickInfo:
    timed = [(r.tick, r.time_ns) for r in records if r.time_ns is not None]
    duration_s = (timed[-1][1] - timed[0][1]) * NS if timed else 0.0
    steps = timed[-1][0] - timed[0][0] if timed else 0
    lateness = [
        (r.time_ns - r.deadline_ns) * NS for r in records if r.time_ns is not None and r.deadline_ns is not None
    ]
    numbers = sorted({-1, *(r.tick for r in records), *([log.end.ticks] if log.end is not None else [])})
    gaps = tuple((a + 1, b - 1) for a, b in pairwise(numbers) if b - a > 1)
    return TickInfo(
        count=len(records),
        incomplete=sum(None in (r.time_ns, r.wrench, r.joints, r.asked_rad, r.applied) for r in records),
        duration_s=duration_s,
        rate_Hz=steps / duration_s if duration_s > 0.0 else None,
        interval=TimeSpread.of([(t1 - t0) * NS for (k0, t0), (k1, t1) in pairwise(timed) if k1 == k0 + 1]),
        lateness=TimeSpread.of(lateness),
        late=sum(late > LATE_S for late in lateness),
        missing=sum(last - first + 1 for first, last in gaps),
        gaps=gaps,
        counterfactual=sum(r.counterfactual for r in records),
    )


def _port(at_ticks: Sequence[tuple[int | None, WrenchSample | JointSample]]) -> PortInfo:
    samples = [sample for _, sample in at_ticks]
    steps = [b.sequence - a.sequence for a, b in pairwise(samples)]
    repeats = sum(step == 0 for step in steps)
    new = len(samples) - repeats
    span_s = (samples[-1].source_time_ns - samples[0].source_time_ns) * NS if samples else 0.0
    return PortInfo(
        samples=len(samples),
        new=new,
        repeats=repeats,
        unread=sum(step - 1 for step in steps if step > 1),
        rate_Hz=(new - 1) / span_s if span_s > 0.0 else None,
        device_rate_Hz=sum(steps) / span_s if span_s > 0.0 and min(steps) >= 0 else None,
        age=TimeSpread.of([(time_ns - s.source_time_ns) * NS for time_ns, s in at_ticks if time_ns is not None]),
        delivery=TimeSpread.of([(s.receive_time_ns - s.source_time_ns) * NS for s in samples]),
        not_valid=_counted(s.validity.value for s in samples if s.validity is not Validity.VALID),
    )


def _trip(log: TrialLog) -> dict[str, Any] | None:
    if (event := log.trip) is None:
        return None
    reason, _, text = event.detail.partition(": ")
    return {"tick": event.tick, "reason": reason, "text": text}


def _end(log: TrialLog) -> dict[str, Any] | None:
    end = log.end
    if end is None:
        return None
    names = (
        "outcome", "success", "exploration_time_s", "actions", "ticks", "clamped_ticks", "peak_force_N", "depth_m",
        "true_peak_force_N", "true_depth_m", "true_tip_in_task_m", "true_hole_in_task_m", "error", "text",
        "stopped_by",
    )  # fmt: skip
    timing = json_in(log, "end.timing_json", end.timing_json) if end.timing_json else None
    return {name: getattr(end, name) for name in names} | {"timing": timing}


def _counted(names: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(names).items()))
