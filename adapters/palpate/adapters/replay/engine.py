"""Replays one log: the unmodified core on the recorded inputs, every output held against the recorded one."""

import enum
import json
from contextlib import ExitStack
from dataclasses import dataclass, fields

from palpate.adapters.experiments import ScoredTrial
from palpate.adapters.log import DecisionEntry, EndRecord, TrialLog, core_sha256, json_in
from palpate.adapters.replay.causes import known_causes, other_processor
from palpate.adapters.replay.compare import (
    Beginning,
    compare_ends,
    compare_learners,
    compare_policy,
    compare_recorder,
    compare_reports,
    compare_start,
    decisions_of,
)
from palpate.adapters.replay.differences import Difference, Differences
from palpate.adapters.replay.ending import compare_calls, compare_ending, compare_latch, compare_observed, is_torn
from palpate.adapters.replay.handover import WhatIfRecording, continue_in_mujoco
from palpate.adapters.replay.ports import ReplayArm, ReplayClock, ReplaySensor
from palpate.adapters.replay.rebuild import Rebuilder, Rebuilt
from palpate.adapters.replay.tape import Tape, TapeEndError
from palpate.core.control_loop import run_trial
from palpate.core.errors import DeviceError, LogError
from palpate.core.ports import Ports, World
from palpate.core.trial import INTERRUPT


class Verdict(enum.Enum):
    """What a replay came to."""

    EQUAL = "equal"
    NOT_BIT_COMPARABLE = "not bit-comparable"
    DIVERGED = "DIVERGED"
    CUT_SHORT = "equal as far as it can be read"
    REFUSED = "NOT REPLAYABLE"


@dataclass(frozen=True)
class Replay:
    """One log, replayed.

    Attributes:
        replayed_outcome: How the core ends it now; empty while it would go on.
        decisions: The core's decisions now, for a what-if.
        counterfactual_from: Tick of the first command that is not the recorded one: from there on the recorded
            samples are no answer to what the core does. None when all commands are equal.
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
    other_code: bool = False
    only_told: tuple[str, ...] = ()
    recorded_decisions: str = ""


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
    if log.missing:
        raise LogError(log.path, "", log.missing, "a trial can only be replayed whole")
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
    beginning, what_if = Beginning(rebuilt), rebuilder.what_if
    differences = tape.differences
    if in_mujoco:
        note = _went_on(log, continue_in_mujoco(tape, rebuilt, recording))
        # From the first other command on, the recorded samples are no answer to what the core does.
        if differences.first_command_tick is None:
            _compare_core(tape, rebuilt, beginning, log.end, what_if=what_if)
            compare_recorder(differences, log)
    else:
        error = run_over(tape, rebuilt, recording, beginning)
        note = compare_ending(tape, rebuilt, error, beginning.calling)
        # What ends a trial from outside, such as a second Ctrl-C, may end it in the middle of a tick.
        ended = None if isinstance(error, TapeEndError) and is_torn(tape.last) else log.end
        _compare_core(tape, rebuilt, beginning, ended, what_if=what_if)
        compare_calls(tape, rebuilt.task.report, refused=isinstance(error, DeviceError))
        if ended is not None:
            compare_latch(tape, rebuilt.supervisor.latch.cause, error)
            compare_observed(tape, beginning, error)
        compare_recorder(differences, log)
    report = rebuilt.task.report
    return Replay(
        path=log.path,
        verdict=_verdict(differences, log),
        ticks=tape.tick + 1,
        recorded_outcome="" if log.end is None else log.end.outcome or log.end.error,
        replayed_outcome="" if report.outcome is None else report.outcome.value,
        first=differences.first,
        differences=differences.count,
        causes=known_causes(log, rebuilt) if differences.count else (),
        note="; ".join(filter(None, (log.damage, note))),
        decisions=tuple(decisions_of(report)),
        counterfactual_from=differences.first_command_tick,
        only_told=_only_told(log),
        recorded_decisions=rebuilt.recorded_decisions,
        other_code=bool(log.start.core_sha256) and log.start.core_sha256 != core_sha256(),
    )


def _compare_core(
    tape: Tape, rebuilt: Rebuilt, beginning: Beginning, ended: EndRecord | None, *, what_if: bool
) -> None:
    """Hold what the core put out against the log.

    Args:
        ended: How the recording ended; None where it did not, or in the middle of a tick.
    """
    log, differences, report = tape.log, tape.differences, rebuilt.task.report
    decisions = decisions_of(report)
    if not what_if:
        compare_start(differences, log, rebuilt, beginning)
    compare_reports(differences, log, report, decisions, whole=ended is not None)
    if ended is not None:
        compare_ends(differences, log, report, rebuilt.config)
        if not what_if:
            compare_policy(differences, log, decisions)
        if not what_if and not rebuilt.recorded_decisions:
            compare_learners(differences, ended, rebuilt)


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
            world = World("recording", json.loads(tape.log.start.world_json))
            with recording.of(tape, rebuilt, world) as observers:
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


def _verdict(differences: Differences, log: TrialLog) -> Verdict:
    if not differences.count:
        return Verdict.CUT_SHORT if log.damage else Verdict.EQUAL
    if differences.first_gross is None and other_processor(log):
        return Verdict.NOT_BIT_COMPARABLE
    return Verdict.DIVERGED
