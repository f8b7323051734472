"""Replays one log: the unmodified core on the recorded inputs, every output held against the recorded one."""

import enum
import hashlib
import json
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, fields
from typing import Any, Final

from palpate.adapters.experiments import ScoredTrial
from palpate.adapters.log import (
    BY_CORE,
    BY_POLICY,
    BY_PORT,
    DecisionEntry,
    TickRecord,
    TrialLog,
    arm_sha256,
    core_sha256,
    decisive,
    json_in,
    learner_of_json,
    made_with,
    processor,
    raised_by,
)
from palpate.adapters.replay.compare import (
    Beginning,
    compare_ends,
    compare_learners,
    compare_policy,
    compare_recorder,
    compare_reports,
    compare_start,
    decisions_of,
    of_this_code,
    scored_again,
)
from palpate.adapters.replay.differences import Difference, Differences
from palpate.adapters.replay.handover import WhatIfRecording, continue_in_mujoco
from palpate.adapters.replay.ports import ReplayArm, ReplayClock, ReplaySensor
from palpate.adapters.replay.rebuild import Rebuilder, Rebuilt
from palpate.adapters.replay.run_files import Determined, determined_by, learner_kept
from palpate.adapters.replay.tape import Tape, TapeEndError
from palpate.core.control_loop import run_trial
from palpate.core.errors import DeviceError, LogError
from palpate.core.policy import ForeignPolicy, PolicyDocument
from palpate.core.ports import SENSOR_FRAME, Ports, World, WrenchKind
from palpate.core.trial import INTERRUPT, TrialReport


class Verdict(enum.Enum):
    """What a replay came to."""

    EQUAL = "equal"
    NOT_BIT_COMPARABLE = "not bit-comparable"
    DIVERGED = "DIVERGED"
    REFUSED = "NOT REPLAYABLE"


@dataclass(frozen=True)
class Lesson:
    """What a trial taught, to be held against the trials before and after."""

    run: str
    trial: int
    before: str
    after: str
    perception: Any = None


@dataclass(frozen=True)
class Replay:
    """One log, replayed.

    Attributes:
        replayed_outcome: How the core ends it now; empty while it would go on.
        decisions: The core's decisions now, for a what-if.
        counterfactual_from: Tick of the first command that is not the recorded one: from there on the recorded
            samples are no answer to what the core does. None when all commands are equal.
        lesson: For a trial that taught something: its place in the course of learning.
        determined: What it determines of its run's files, if it is equal.
        other_code: Whether other code of the core recorded it; False where the log does not say.
        only_told: Fields of the end record that nothing of the core can be held against.
        recorded_decisions: Why the decisions were taken from the log, and not made anew; empty where they were made.
    """

    path: str
    verdict: Verdict
    ticks: int = 0
    recorded_outcome: str = ""
    replayed_outcome: str = ""
    first: Difference | None = None
    differences: int = 0
    causes: tuple[str, ...] = ()
    note: str = ""
    decisions: tuple[DecisionEntry, ...] = ()
    problem: str = ""
    counterfactual_from: int | None = None
    lesson: Lesson | None = None
    determined: Determined | None = None
    other_code: bool = False
    only_told: tuple[str, ...] = ()
    recorded_decisions: str = ""


_STILL_RUNNING: Final = "still running"


def replay(
    log: TrialLog, rebuilder: Rebuilder, *, in_mujoco: bool = False, recording: WhatIfRecording | None = None
) -> Replay:
    """Replay one log.

    Args:
        in_mujoco: Let the simulator go on from the first command that is not the recorded one.

    Raises:
        LogError: It cannot be replayed.
        ConfigurationError: A change does not fit.
    """
    for name, record in (("/start", log.start), ("/end", log.end)):
        for each in () if record is None else fields(record):
            if each.name.endswith("_json"):
                json_in(log, f"{name} {each.name}", getattr(record, each.name))
    tape, recording = Tape(log), recording or WhatIfRecording()
    rebuilt = rebuilder.rebuild(log)
    interrupts = {event.tick for event in log.events if event.name == INTERRUPT}

    def at_tick(tick: int) -> None:
        if tick in interrupts:
            rebuilt.task.interrupt()

    tape.at_tick = at_tick if interrupts else None
    beginning = Beginning(rebuilt)
    error: BaseException | None = None
    if in_mujoco:
        note = _went_on(log, continue_in_mujoco(tape, rebuilt, recording))
    else:
        error = run_over(tape, rebuilt, recording, beginning)
        note = _ending(tape, rebuilt, error, beginning.calling)
    report = rebuilt.task.report
    decisions = decisions_of(report)
    left = tape.differences.first_command_tick is not None
    if not (in_mujoco and left):
        if not rebuilder.what_if:
            compare_start(tape.differences, log, rebuilt, beginning)
        # What ends a trial from outside, such as a second Ctrl-C, may end it in the middle of a tick.
        torn = isinstance(error, TapeEndError) and _is_torn(tape.last)
        compare_reports(tape.differences, log, report, decisions, whole=log.end is not None and not torn)
        if log.end is not None and not torn:
            compare_ends(tape.differences, log, report, rebuilt.config)
            if not rebuilder.what_if:
                compare_policy(tape.differences, log, decisions)
            if not rebuilder.what_if and not rebuilt.recorded_decisions:
                compare_learners(tape.differences, log.end, rebuilt)
        if not in_mujoco:
            _compare_calls(tape, report, refused=isinstance(error, DeviceError))
            if log.end is not None and not torn:
                _compare_latch(tape, rebuilt.supervisor.latch.cause, error)
                _compare_observed(tape, beginning, error)
        compare_recorder(tape.differences, log)
    verdict, determined = _verdict(tape.differences, log), None
    kept = learner_kept(log, report, rebuilt.config)
    if verdict is Verdict.EQUAL and log.end is not None and not rebuilder.what_if:
        scored = scored_again(log, log.end, report, rebuilt.config)
        determined = determined_by(log, scored, rebuilt, kept)
    return Replay(
        path=log.path,
        verdict=verdict,
        ticks=tape.tick + 1,
        recorded_outcome="" if log.end is None else log.end.outcome or log.end.error,
        replayed_outcome="" if report.outcome is None else report.outcome.value,
        first=tape.differences.first,
        differences=tape.differences.count,
        causes=known_causes(log, rebuilt) if tape.differences.count else (),
        note=note,
        decisions=tuple(decisions),
        counterfactual_from=tape.differences.first_command_tick,
        lesson=_lesson(log, kept),
        determined=determined,
        only_told=_only_told(log),
        recorded_decisions=rebuilt.recorded_decisions,
        other_code=bool(log.start.core_sha256) and log.start.core_sha256 != core_sha256(),
    )


def _only_told(log: TrialLog) -> tuple[str, ...]:
    end, names = log.end, ("stopped_by", "timing_json")
    told = [] if end is None else [field.name for field in fields(end) if field.name.startswith("true_")]
    return tuple(name for name in (*told, *names) if end is not None and getattr(end, name))


def run_over(tape: Tape, rebuilt: Rebuilt, recording: WhatIfRecording, beginning: Beginning) -> BaseException | None:
    """Run the core over the tape; returns what ended it, if it did not end by itself."""
    sensor = ReplaySensor("recorded force sensor", tape.wrenches)
    encoder, arm = ReplaySensor("recorded encoders", tape.joints), ReplayArm(tape)
    with ExitStack() as opened:
        for device in (sensor, encoder, arm):
            opened.enter_context(device)
        ports = Ports(ReplayClock(tape), sensor, encoder, arm)
        try:
            with recording.of(tape, rebuilt, World("recording", {})) as observers:
                report = run_trial(rebuilt.task, ports, rebuilt.setup, rebuilt.supervisor, (beginning, *observers))
            if report is not rebuilt.task.report:
                tape.differences.add(tape.tick, "/end", "report", "the task's", "another")
        except LogError:
            raise
        except Exception as error:
            return error
    return None


def _went_on(log: TrialLog, scored: ScoredTrial) -> str:
    """What came of a trial that went on in the simulator, beside what was recorded."""
    report, end = scored.report, log.end
    now = "" if report.outcome is None else report.outcome.value
    text = f"in the simulator: {now} after {report.exploration_time_s:.2f} s of exploration"
    text += "" if scored.truth is None else f", true peak {scored.truth.peak_force_N:.1f} N"
    if end is not None:
        text += f" (recorded: {end.outcome} after {end.exploration_time_s:.2f} s"
        text += "" if end.true_peak_force_N is None else f", {end.true_peak_force_N:.1f} N"
        text += ")"
    return text


def _ending(tape: Tape, rebuilt: Rebuilt, error: BaseException | None, failed_port: str) -> str:
    """Hold the way in which the trial ended against the recorded one."""
    end = tape.log.end
    tick, differences = tape.tick, tape.differences
    if isinstance(error, TapeEndError):
        if end is None:
            return f"the log ends at tick {len(tape.log.ticks) - 1}, before the trial did"
        if end.error and end.raised_by == BY_CORE:
            differences.add(tick, "/end", "error", f"{end.error}: {end.text}", _STILL_RUNNING)
            return ""
        if end.raised_by == BY_PORT:
            # The call that failed would have failed again.
            differences.add(tick, "/end", "raised_by", end.raised_by, None)
            return ""
        if end.error and not end.outcome:
            return f"the recording was ended by {end.error} at tick {len(tape.log.ticks) - 1}"
        differences.add(tick, "/end", "outcome", end.outcome, _STILL_RUNNING)
    elif error is not None:
        told, now = "" if end is None else f"{end.error}: {end.text}", f"{type(error).__name__}: {error}"
        if told != now:
            differences.add(tick, "/end", "error", told or None, now)
        elif end is not None and (end.raised_by or of_this_code(tape.log)):
            now = raised_by(error, failed_port)
            if now != end.raised_by:
                differences.add(tick, "/end", "raised_by", end.raised_by or None, now)
    elif tape.sends.left:
        outcome = rebuilt.task.report.outcome
        now = "" if outcome is None else outcome.value
        recorded = _STILL_RUNNING if end is None else f"{end.ticks} ticks"
        differences.add(tick, "/end", "ticks", recorded, f"{tick + 1} ticks, {now}")
    elif end is not None and end.raised_by == BY_POLICY and rebuilt.recorded_decisions:
        return f"the policy ended the recording with {end.error}: {end.text}"
    elif end is not None and (end.error or end.text or end.raised_by):
        differences.add(tick, "/end", "error", f"{end.error}: {end.text}", None)
    return ""


def _is_torn(last: TickRecord | None) -> bool:
    """Whether the log's last tick was under way: then it is open how much of it was done."""
    return last is not None and last.joints is not None and last.asked_rad is None


def _compare_calls(tape: Tape, report: TrialReport, *, refused: bool) -> None:
    """Hold all port calls, in order, against the recorded ones, and each wrench against what the core takes it for."""
    differences = tape.differences
    if not differences.count:
        tape.load_rest()
    parted = tape.order.first_difference(whole=tape.log.end is not None and not differences.count)
    if parted is not None:
        tick, told, made = parted
        differences.add(max(tick, 0), "/call", "port call", told or None, made or None)
    if tape.claimed_tick is not None and not tape.log.start.derived_from:
        differences.add(tape.claimed_tick, "/tick", "counterfactual", True, False)
    odd = tape.odd_tick
    # A trial that ends with its first tick, by an error, has refused it.
    if (
        odd is not None
        and not (refused and odd == 0 == tape.tick)
        and not any(event.name in ("trip", "end") and event.tick <= odd + 1 for event in report.events)
    ):
        now = f"{WrenchKind.RAW.value}, frame {SENSOR_FRAME!r}, as the core takes it"
        differences.add(odd, "/tick", "wrench", "of another kind or frame", now)


def _compare_latch(tape: Tape, cause: str, error: BaseException | None) -> None:
    """Hold what keeps the rig still against the recorded trip, or the device's error that was raised as recorded."""
    trips = (event.detail.partition(": ")[2] for event in tape.log.events if event.name == "trip")
    told = next(trips, str(error) if isinstance(error, DeviceError) else "")
    if told != cause:
        # A trip's text holds rounded numbers, which another processor may round otherwise.
        gross = bool(told) is not bool(cause)
        tape.differences.add(tape.tick, "/end", "latch", told or None, cause or None, gross=gross)


def _compare_observed(tape: Tape, beginning: Beginning, error: BaseException | None) -> None:
    """Hold what observers of the loop are told against the log: that a trial begins, and which port's call failed."""
    if tape.tick >= 0 and not beginning.held:
        tape.differences.add(0, "/start", "begun", True, False)
    failed = (call.port for call in tape.log.calls if call.error and call.call in ("read", "send"))
    told = next(failed, "")
    if isinstance(error, DeviceError) and told != beginning.calling:
        tape.differences.add(tape.tick, "/call", "failed port", told, beginning.calling)


def known_causes(log: TrialLog, rebuilt: Rebuilt) -> tuple[str, ...]:
    """What is different from the time of the recording, as far as the log holds it."""
    start, causes = log.start, []
    recorded: dict[str, str] = json.loads(start.versions_json or "{}")
    for name, version in made_with().items():
        if recorded.get(name) != version:
            causes.append(f"{name} {version} (recorded with {recorded.get(name)})")
    if start.core_sha256 != core_sha256():
        causes.append("the core's code is not the one that recorded")
    if start.model_sha256 != arm_sha256(rebuilt.config.arm):
        causes.append(f"the model of the arm {rebuilt.config.arm} is not the one that recorded")
    if isinstance(rebuilt.policy, ForeignPolicy):
        told = PolicyDocument.from_json_text(start.policy_json).foreign if start.policy_json else None
        now = rebuilt.policy.entry
        if told is not None and told.code == now.code and told.source_sha256 != now.source_sha256:
            causes.append(f"the code of {now.code} is not the one that recorded")
        if told is not None and told.version != now.version:
            causes.append(f"{now.distribution} {now.version} (recorded with {told.version})")
    if _other_processor(log):
        causes.append("another processor")
    return tuple(causes)


def _other_processor(log: TrialLog) -> bool:
    return decisive(json.loads(log.start.processor_json or "{}")) != decisive(processor())


def _verdict(differences: Differences, log: TrialLog) -> Verdict:
    if not differences.count:
        return Verdict.EQUAL
    if differences.first_gross is None and _other_processor(log):
        return Verdict.NOT_BIT_COMPARABLE
    return Verdict.DIVERGED


def _lesson(log: TrialLog, kept: str) -> Lesson | None:
    start, end = learner_of_json(log.start.learner_json), log.end
    if start is None or log.start.frozen or log.start.derived_from or end is None or not end.learner_json:
        return None
    after = learner_of_json(kept)
    common = (log.start.config_toml, log.start.perception_json, log.start.policy_json)
    run = hashlib.sha256(repr(common).encode()).hexdigest()
    if after is None:
        return None
    perception = json.loads(log.start.perception_json)
    return Lesson(run, log.start.trial, values_digest(start), values_digest(after), perception)


def values_digest(learner: Mapping[str, Any]) -> str:
    """Digest of what a learner has learned, to the last bit.

    That is values and visits, of states and of symbols; the trials of a belief; or whatever a foreign learner has.
    """
    names: tuple[str, ...] = ("q", "visits", "symbol_q", "symbol_visits")
    for others in (("trials", "trials_learned"), ("state", "trials_learned")):
        names = others if others[0] in learner else names
    return hashlib.sha256(json.dumps([learner.get(name) for name in names]).encode()).hexdigest()
