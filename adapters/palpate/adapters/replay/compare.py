"""Holds what the core reports of a replayed trial against what it reported when the trial was recorded."""

import json
from collections.abc import Sequence
from dataclasses import fields
from typing import Any, TypeAlias

from typing_extensions import override

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import ScoredTrial, ready_pose, score
from palpate.adapters.log import (
    DecisionEntry,
    EndRecord,
    EventEntry,
    ReinforcementEntry,
    TrialLog,
    dump_json,
    end_of,
    learner_of_json,
    policy_digest,
    recorded_drawn,
    recorded_turn,
)
from palpate.adapters.replay.differences import Differences
from palpate.adapters.replay.rebuild import Rebuilt
from palpate.core.control_loop import LoopObserver, UnfinishedTick
from palpate.core.errors import UnreachableError
from palpate.core.policy import document_of, learner_of
from palpate.core.ports import Truth
from palpate.core.trial import Purpose, TrialReport, generator

_Told: TypeAlias = DecisionEntry | ReinforcementEntry | EventEntry


class Beginning(LoopObserver):
    """What the core holds as a trial begins, and which port it was calling when an error ended it.

    Attributes:
        held: Field of the start record and its value; empty while the trial has not begun.
        calling: The port whose call failed; empty for none.
    """

    def __init__(self, rebuilt: Rebuilt) -> None:
        self._rebuilt = rebuilt
        self.held: dict[str, Any] = {}
        self.calling = ""

    @override
    def failed(self, error: BaseException, tick: UnfinishedTick) -> None:
        self.calling = tick.calling

    @override
    def begun(self, start_ns: int, report: TrialReport) -> None:
        rebuilt = self._rebuilt
        learner = learner_of(rebuilt.policy)
        self.held = {
            "temperature": report.temperature,
            "filter_state": tuple(rebuilt.task.filter_state),
            "perception_state": tuple(rebuilt.perception.get_state()),
            "learner": None if learner is None else json.loads(dump_json(learner.get_state())),
        }
        if rebuilt.recorded_decisions:
            del self.held["learner"]


def compare_start(differences: Differences, log: TrialLog, rebuilt: Rebuilt, beginning: Beginning) -> None:
    """What the core derives by itself as a trial begins, and what its start says twice."""
    start, setup = log.start, rebuilt.setup
    # An agent outside names a seed for each of its trials.
    if start.seed != rebuilt.config.seed and not rebuilt.recorded_decisions:
        differences.add(0, "/start", "seed", start.seed, rebuilt.config.seed)
    if start.policy_json and not rebuilt.recorded_decisions:
        document = document_of(rebuilt.policy, created_with={}, perception={}).unlearned()
        written, now = json.loads(start.policy_json), json.loads(document.to_json_text())
        differences.compare(0, "/start", "policy", written, now)
    state = dump_json(generator(setup.seed, Purpose.POLICY, setup.index).bit_generator.state)
    if state != start.generator_json:
        differences.add(0, "/start", "generator", start.generator_json, state)
    if start.arm != str(rebuilt.config.arm):
        differences.add(0, "/start", "arm", start.arm, str(rebuilt.config.arm))
    told = {
        "temperature": start.temperature,
        "filter_state": start.filter_state,
        "perception_state": start.perception_state,
        "learner": learner_of_json(start.learner_json),
    }
    for name, now in beginning.held.items():
        differences.compare(0, "/start", name, told[name], now)
    recorded = [*start.ready_rad, *start.tip_rotation]
    differences.compare(0, "/start", "ready pose", recorded, _ready_pose(rebuilt.config))


def _ready_pose(config: RunConfig) -> list[float] | None:
    """Joint angles and orientation of the tool above the goal, as they are found now; None where they are not."""
    try:
        ready = ready_pose(config)
    except UnreachableError:
        return None
    return [*ready.q_rad.tolist(), *ready.tip_rotation.reshape(-1).tolist()]


def decisions_of(report: TrialReport) -> list[DecisionEntry]:
    """The decisions of a report as a log has them."""
    return [DecisionEntry.of(number, decision, report.temperature) for number, decision in enumerate(report.decisions)]


def compare_reports(
    differences: Differences, log: TrialLog, report: TrialReport, decisions: list[DecisionEntry], *, whole: bool
) -> None:
    """Decisions, what they earned, events, and the outcome of the trial.

    Args:
        whole: The log goes to the trial's end. Else it may lack what came of its last tick, for that is written after
            the tick, and what the last decision earned.
    """
    surely = None if whole else len(log.ticks) - 1
    for recorded, now in zip(log.decisions, decisions, strict=False):
        _compare_fields(differences, "/decision", recorded.tick, recorded, now)
    _compare_counts(differences, "/decision", "decisions", log.decisions, decisions, surely)
    _compare_reinforcements(differences, log, report, surely)
    events = [EventEntry(tick=e.tick, name=e.name, detail=e.detail) for e in report.events]
    for told, made in zip(log.events, events, strict=False):
        if (told.tick, told.name, told.detail) != (made.tick, made.name, made.detail):
            # Details hold rounded numbers, which another processor may round otherwise.
            gross = (told.tick, told.name) != (made.tick, made.name)
            shown = (f"{e.tick}: {e.name} {e.detail}".strip() for e in (told, made))
            differences.add(min(told.tick, made.tick), "/event", "event", *shown, gross=gross)
    _compare_counts(differences, "/event", "events", log.events, events, surely)


def _compare_counts(
    differences: Differences,
    channel: str,
    what: str,
    recorded: Sequence[_Told],
    replayed: Sequence[_Told],
    surely: int | None,
) -> None:
    few = min(len(recorded), len(replayed))
    more = [entry.tick for entry in (*recorded[few:], *replayed[few:])]
    if not more or (surely is not None and len(recorded) == few and more[0] >= surely):
        return
    differences.add(more[0], channel, f"number of {what}", len(recorded), len(replayed))


def compare_recorder(differences: Differences, log: TrialLog) -> None:
    """What the recorder says of its own work, where all that it could have lost was there to be compared."""
    if differences.count or log.end is None:
        return
    for loss in log.losses:
        if loss.dropped_messages:
            told, now = f"{loss.dropped_messages} ({loss.text})", "0, the log is whole"
            differences.add(loss.tick, "/recorder", "missing messages", told, now)


def _compare_reinforcements(differences: Differences, log: TrialLog, report: TrialReport, surely: int | None) -> None:
    # The last one is told when all is over, the way back after a trip included.
    ticks = [*(d.tick for d in report.decisions[1:]), len(log.ticks) - 1]
    known = [
        ReinforcementEntry(tick=ticks[number], number=number, reinforcement=decision.reinforcement)
        for number, decision in enumerate(report.decisions)
        if decision.reinforcement is not None
    ]
    for recorded, now in zip(log.reinforcements, known, strict=False):
        _compare_fields(differences, "/reinforcement", recorded.tick, recorded, now)
    _compare_counts(differences, "/reinforcement", "reinforcements", log.reinforcements, known, surely)


def compare_ends(differences: Differences, log: TrialLog, report: TrialReport, config: RunConfig) -> None:
    """What the trial came to by the core's own account, and whether the score follows from the recorded truth."""
    end, replayed = log.end, end_of(report)
    if end is None:
        return
    for name in (
        "outcome", "exploration_time_s", "actions", "peak_force_N", "depth_m", "ticks", "clamped_ticks", "tick",
        "worst_late_ns", "late_ticks", "skipped_slots", "repeated_samples",
    ):  # fmt: skip
        differences.compare(end.tick, "/end", name, getattr(end, name), getattr(replayed, name))
    scored = end.success is not None or end.true_depth_m is not None
    if differences.count == 0 and scored:
        now = scored_again(log, end, report, config)
        differences.compare(end.tick, "/end", "success", end.success, now.success if now.truth else None)
    if not log.start.derived_from and _claims_what_if(log):
        differences.add(end.tick, "/end", "counterfactual", True, False)


def scored_again(log: TrialLog, end: EndRecord, report: TrialReport, config: RunConfig) -> ScoredTrial:
    """The trial with its score, by the truth that the log holds."""
    tip, hole = end.true_tip_in_task_m, end.true_hole_in_task_m
    if len(tip) != 3 or len(hole) != 3 or end.true_depth_m is None or end.true_peak_force_N is None:
        return score(config, report, None)
    drawn, turn = recorded_drawn(log.start.world_json), recorded_turn(log.start.world_json)
    truth = Truth(hole, tip, end.true_depth_m, end.true_peak_force_N, drawn, hole_turn_rad=turn)
    return score(config, report, truth)


def _claims_what_if(log: TrialLog) -> bool:
    told = (log.end, *log.decisions, *log.events, *log.reinforcements)
    return any(entry is not None and entry.counterfactual for entry in told)


def compare_policy(differences: Differences, log: TrialLog, decisions: Sequence[DecisionEntry]) -> None:
    """Hold the decisions, and what the log says of the learner, against the digest of a foreign policy's."""
    end = log.end
    if end is not None and end.policy_sha256:
        now = policy_digest(decisions, log.start.learner_json, end.learner_json)
        differences.compare(end.tick, "/end", "policy_sha256", end.policy_sha256, now)


def compare_learners(differences: Differences, end: EndRecord, rebuilt: Rebuilt) -> None:
    """Hold the learner after the trial against the recorded one, number by number."""
    learner = learner_of(rebuilt.policy)
    now: Any = None if learner is None else learner.get_state()
    if now is not None and dump_json(now) == end.learner_json:
        return
    told: Any = json.loads(end.learner_json) if end.learner_json else None
    differences.compare(end.tick, "/end", "learner", told, now)


def _compare_fields(differences: Differences, channel: str, tick: int, recorded: Any, replayed: Any) -> None:
    for field in fields(recorded):
        if field.name == "counterfactual":
            # How the log came about, not what the core said: held against the log itself.
            continue
        told, now = getattr(recorded, field.name), getattr(replayed, field.name)
        differences.compare(tick, channel, field.name, told, now)
