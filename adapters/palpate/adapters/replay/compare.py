"""Compare a replayed trial's records with its log."""

import json
import tomllib
from collections.abc import Collection, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any, Final

from palpate.adapters.config import RunConfig, overlay
from palpate.adapters.experiments import ready_pose, score, truth_fields
from palpate.adapters.log import (
    BY_OUTSIDE,
    BY_POLICY,
    CallEntry,
    DecisionEntry,
    EndRecord,
    EventEntry,
    ReinforcementEntry,
    StartRecord,
    TrialLog,
    policy_digest,
    recorded_drawn,
    recorded_turn,
)
from palpate.adapters.replay.differences import Differences
from palpate.adapters.replay.tape import Tape, TapeEndError
from palpate.adapters.replay.trial import ReplayedTrial
from palpate.core.errors import DeviceError, UnreachableError
from palpate.core.ports import GroundTruth
from palpate.core.trial import TrialReport

_STILL_RUNNING: Final = "still running"
_OF_THE_RECORDING: Final = {
    "schema", "command", "config_toml", "model_sha256", "core_sha256", "world", "world_json", "versions_json",
    "processor_json", "derived_from", "stopped_by", "timing_json",
}  # fmt: skip
"""Fields in the start and end records that the core neither produces nor can contradict."""
_OF_THE_POLICY: Final = {"policy", "policy_json", "learner_json", "policy_sha256"}
_ROUNDED: Final = {"detail", "text"}
"""Strings with rounded numbers, which may be rounded differently on a different processor."""


def compare_records(trial: ReplayedTrial, *, whole: bool, what_if: bool) -> None:
    """Compare the log's records with those from the replay, except for ticks, which the ports compare.

    Args:
        whole: Whether the log extends to the end of the trial. If not, it may lack the reward for the last decision and
            the results from the last tick, which are written after the tick.
        what_if: Whether the settings or the policy are changed, which makes the start and the learner differ.
    """
    log, differences, made = trial.tape.log, trial.tape.differences, trial.made
    if not what_if:
        _compare_start(trial)
    if log.end is not None and whole:
        _compare_end(trial, log.end, what_if=what_if)
    surely = None if whole else len(log.ticks) - 1
    kinds: tuple[tuple[str, str, Sequence[Any], type], ...] = (
        ("/decision", "decisions", log.decisions, DecisionEntry),
        ("/reinforcement", "reinforcements", log.reinforcements, ReinforcementEntry),
        ("/event", "events", log.events, EventEntry),
        ("/call", "port calls", log.calls, CallEntry),
    )
    for channel, name, recorded, kind in kinds:
        replayed = made.of[kind]
        for before, now in zip(recorded, replayed, strict=False):
            _compare_fields(differences, min(before.tick, now.tick), channel, before, now, _flags(log))
        few = min(len(recorded), len(replayed))
        more = [entry.tick for entry in (*recorded[few:], *replayed[few:])]
        if more and (surely is None or len(replayed) == few or more[0] < surely):
            differences.add(max(more[0], 0), channel, f"number of {name}", len(recorded), len(replayed))


def _compare_start(trial: ReplayedTrial) -> None:
    differences, start, rebuilt, made = trial.tape.differences, trial.tape.log.start, trial.rebuilt, trial.made
    now: StartRecord = made.of[StartRecord][0]
    skipped = _OF_THE_RECORDING
    if rebuilt.recorded_decisions:
        skipped = skipped | _OF_THE_POLICY
    else:
        # An external agent chooses a seed for each trial.
        now = replace(now, seed=rebuilt.config.seed)
    _compare_fields(differences, 0, "/start", start, now, skipped)
    differences.compare(0, "/start", "ready pose", [*start.ready_rad, *start.tip_rotation], _ready(start.config_toml))


@lru_cache(maxsize=1)
def _ready(config_toml: str) -> list[float] | None:
    """Compute the joint angles and the tool orientation at the ready pose; return None if it cannot be reached."""
    try:
        ready = ready_pose(overlay(RunConfig(), tomllib.loads(config_toml)))
    except UnreachableError:
        return None
    return [*ready.q_rad.tolist(), *ready.tip_rotation.reshape(-1).tolist()]


def _compare_end(trial: ReplayedTrial, end: EndRecord, *, what_if: bool) -> None:
    tape, rebuilt, made = trial.tape, trial.rebuilt, trial.made
    now: EndRecord = made.of[EndRecord][0]
    skipped = _OF_THE_RECORDING | _flags(tape.log)
    if what_if or rebuilt.recorded_decisions:
        skipped = skipped | _OF_THE_POLICY
    by_policy = end.raised_by == BY_POLICY and bool(rebuilt.recorded_decisions)
    if by_policy or (end.raised_by == BY_OUTSIDE and now.error == TapeEndError.__name__):
        skipped = skipped | {"error", "text", "raised_by"}
    elif now.error == TapeEndError.__name__:
        now = replace(now, error=_STILL_RUNNING)
    if "error" not in skipped:
        # First, because everything else depends on it.
        tape.differences.compare(tape.tick, "/end", "error", end.error, now.error)
    _compare_fields(tape.differences, tape.tick, "/end", end, now, skipped | {"error"})
    if rebuilt.recorded_decisions and end.policy_sha256:
        # Without the policy's code, only this digest can contradict the log.
        digest = policy_digest(made.of[DecisionEntry], tape.log.start.learner_json, end.learner_json)
        tape.differences.compare(tape.tick, "/end", "policy_sha256", end.policy_sha256, digest)


def _flags(log: TrialLog) -> set[str]:
    """Return the field that marks a what-if, if the log is one. In other logs it must not be set."""
    return {"counterfactual"} if log.start.derived_from else set()


def _compare_fields(
    differences: Differences, tick: int, channel: str, recorded: Any, replayed: Any, skipped: Collection[str]
) -> None:
    for name in (field.name for field in fields(recorded) if field.name not in skipped):
        before, now = getattr(recorded, name), getattr(replayed, name)
        shown = name.removesuffix("_json")
        if shown != name and before != now:
            before, now = (json.loads(text) if text else None for text in (before, now))
        differences.compare(max(tick, 0), channel, shown, before, now, gross=name not in _ROUNDED)


def truth_in(log: TrialLog, report: TrialReport, config: RunConfig) -> dict[str, Any]:
    """Return the fields in the end record that depend on the ground truth, recomputed from the one in the log."""
    end = log.end
    if end is None or len(end.true_tip_in_task_m) != 3 or len(end.true_hole_in_task_m) != 3:
        return {}
    if end.true_depth_m is None or end.true_peak_force_N is None or not report.ticks:
        return {}
    drawn, turn = recorded_drawn(log.start.world_json), recorded_turn(log.start.world_json)
    truth = GroundTruth(
        end.true_hole_in_task_m, end.true_tip_in_task_m, end.true_depth_m, end.true_peak_force_N, drawn,
        hole_turn_rad=turn,
    )  # fmt: skip
    return truth_fields(score(config, report, truth))


def compare_latch(tape: Tape, cause: str, error: BaseException | None) -> None:
    """Compare the reason for latching with the recorded trip or the device's error."""
    trips = (event.detail for event in tape.log.events if event.name == "trip")
    recorded = next(trips, str(error) if isinstance(error, DeviceError) else "")
    # A trip's text contains rounded numbers.
    gross = bool(recorded) is not bool(cause)
    tape.differences.compare(tape.tick, "/end", "latch", recorded, cause, gross=gross)


def ending_note(tape: Tape) -> str:
    """Return a note if a trial is identical but would continue beyond the recorded samples."""
    end, last = tape.log.end, len(tape.log.ticks) - 1
    if end is None:
        return f"the log ends at tick {last}, before the trial did"
    by_others = end.raised_by in (BY_OUTSIDE, BY_POLICY)
    return f"the recording was ended by {end.error} at tick {last}" if by_others else ""
