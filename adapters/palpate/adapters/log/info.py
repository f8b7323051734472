"""Log summary: trial, rates, completeness and outcome."""

import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from itertools import pairwise
from statistics import median
from typing import Any, Final

from palpate.adapters.log.json_text import json_in
from palpate.adapters.log.reader import TrialLog
from palpate.adapters.log.records import TickRecord
from palpate.adapters.log.schema import CHANNELS
from palpate.core.errors import LogError
from palpate.core.ports import CommandReason, JointSample, Validity, WrenchSample

NS: Final = 1e-9
LATE_S: Final = 0.001
"""Delay after a tick's due time, according to the clock reading, above which the tick counts as late."""


def info_of(log: TrialLog) -> dict[str, Any]:
    """Return the contents of ``palpate log info`` as JSON values. Values that the log does not contain are None.

    The tick rate is based on tick numbers and the run's clock, so missing ticks do not lower it. Sample rates are based
    on new samples and the device's clock. A sample's age is the clock reading at its tick minus its source time.

    Raises:
        LogError: A part of the log is invalid.
    """
    records = list(log.records())
    ticks = _ticks(log, records)
    reasons = [record.applied.reason for record in records if record.applied is not None]
    return {
        "path": log.path,
        "damage": "; ".join(filter(None, (log.damage, log.missing))),
        **_origin(log),
        "size_bytes": log.size_bytes,
        "raw_bytes": log.raw_bytes,
        "bytes_per_minute": log.size_bytes / ticks["duration_s"] * 60.0 if ticks["duration_s"] > 0.0 else None,
        "messages": {kind.topic: log.counts[kind.id] for kind in CHANNELS},
        "ticks": ticks,
        "force_sensor": _port([(r.time_ns, r.wrench) for r in records if r.wrench is not None]),
        "joint_encoder": _port([(r.time_ns, r.joints) for r in records if r.joints is not None]),
        "altered_commands": tally(reason.value for reason in reasons if reason is not CommandReason.AS_REQUESTED),
        "dropped_messages": sum(loss.dropped_messages for loss in log.losses),
        "losses": [f"tick {loss.tick}: {loss.problem}: {loss.text}" for loss in log.losses],
        "errors": [f"tick {c.tick}: {c.port}.{c.call}: {c.error}: {c.text}" for c in log.calls if c.error],
        "stops": sum((call.port, call.call) == ("arm", "stop") for call in log.calls),
        "trip": _trip(log),
        "end": _end(log),
    }


def _origin(log: TrialLog) -> dict[str, Any]:
    start = log.start
    try:
        scenario = tomllib.loads(start.config_toml).get("scenario", "")
    except tomllib.TOMLDecodeError as error:
        problem = f"is not TOML ({error})"
        raise LogError(log.path, "start.config_toml", problem, "it was not written by palpate") from error
    names = ("command", "arm", "seed", "policy", "frozen", "temperature", "world", "schema", "derived_from")
    world = json_in(log, "start.world_json", start.world_json)
    try:
        acknowledged = [
            f"{one['by']}: {one['reason']} (after: {one['cause']})" for one in world.get("acknowledged", [])
        ]
    except (TypeError, KeyError) as error:
        problem = "has an acknowledgement in an unknown form"
        raise LogError(log.path, "start.world_json", problem, "it was altered") from error
    return {
        **{name: getattr(start, name) for name in names},
        "scenario": scenario,
        "trial": start.number,
        "drawn": world.get("drawn", {}),
        "acknowledged": acknowledged,
        "versions": json_in(log, "start.versions_json", start.versions_json),
    }


def _ticks(log: TrialLog, records: Sequence[TickRecord]) -> dict[str, Any]:
    timed = [(r.tick, r.time_ns) for r in records if r.time_ns is not None]
    duration_s = (timed[-1][1] - timed[0][1]) * NS if timed else 0.0
    late_s = [(r.time_ns - r.deadline_ns) * NS for r in records if r.time_ns is not None and r.deadline_ns is not None]
    numbers = sorted({-1, *(r.tick for r in records), *([log.end.ticks] if log.end is not None else [])})
    gaps = [(a + 1, b - 1) for a, b in pairwise(numbers) if b - a > 1]
    return {
        "count": len(records),
        "incomplete": sum(None in (r.time_ns, r.wrench, r.joints, r.requested_rad, r.applied) for r in records),
        "counterfactual": sum(r.counterfactual for r in records),
        "duration_s": duration_s,
        "rate_Hz": (timed[-1][0] - timed[0][0]) / duration_s if duration_s > 0.0 else None,
        "interval_s": _spread([(t1 - t0) * NS for (k0, t0), (k1, t1) in pairwise(timed) if k1 == k0 + 1]),
        "lateness_s": _spread(late_s),
        "late": sum(each > LATE_S for each in late_s),
        "missing": sum(last - first + 1 for first, last in gaps),
        "gaps": gaps,
    }


def _port(at_ticks: Sequence[tuple[int | None, WrenchSample | JointSample]]) -> dict[str, Any]:
    samples = [sample for _, sample in at_ticks]
    repeats = sum(a.sequence == b.sequence for a, b in pairwise(samples))
    span_s = (samples[-1].source_time_ns - samples[0].source_time_ns) * NS if samples else 0.0
    return {
        "samples": len(samples),
        "repeats": repeats,
        "rate_Hz": (len(samples) - repeats - 1) / span_s if span_s > 0.0 else None,
        "age_s": _spread([(time_ns - s.source_time_ns) * NS for time_ns, s in at_ticks if time_ns is not None]),
        "not_valid": tally(s.validity.value for s in samples if s.validity is not Validity.VALID),
    }


def _trip(log: TrialLog) -> dict[str, Any] | None:
    if (event := log.trip) is None:
        return None
    reason, _, text = event.detail.partition(": ")
    return {"tick": event.tick, "reason": reason, "text": text}


def _end(log: TrialLog) -> dict[str, Any] | None:
    end = log.end
    if end is None:
        return None
    timing = json_in(log, "end.timing_json", end.timing_json) if end.timing_json else None
    facts = {name: value for name, value in asdict(end).items() if not name.endswith("_json")}
    return facts | {"outcome": log.outcome, "timing": timing}


def tally(names: Iterable[str]) -> dict[str, int]:
    """Return the number of occurrences of each name, sorted by name."""
    return dict(sorted(Counter(names).items()))


def _spread(values: Sequence[float]) -> dict[str, float] | None:
    return {"median": median(values), "min": min(values), "max": max(values)} if values else None
