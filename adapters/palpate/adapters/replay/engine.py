"""Replay a log: run the unmodified core on the recorded inputs and compare every output."""

import enum
import json
from contextlib import ExitStack
from dataclasses import dataclass, fields

from palpate.adapters.experiments import ScoredTrial, outcome_of
from palpate.adapters.log import (
    BY_OUTSIDE,
    BY_POLICY,
    IMPORTED,
    DecisionEntry,
    TrialLog,
    TrialRecorder,
    arm_sha256,
    core_sha256,
    decisive,
    json_in,
    made_with,
    processor,
)
from palpate.adapters.replay.compare import compare_latch, compare_records, ending_note, truth_in
from palpate.adapters.replay.differences import Difference, Differences
from palpate.adapters.replay.handover import continue_in_mujoco
from palpate.adapters.replay.ports import ReplayArm, ReplayClock, ReplaySensor
from palpate.adapters.replay.rebuild import Rebuilder, Rebuilt
from palpate.adapters.replay.tape import Tape, TapeEndError
from palpate.adapters.replay.trial import ReplayedTrial
from palpate.core.errors import LogError
from palpate.core.policy import PolicyDocument, ThirdPartyPolicy
from palpate.core.ports import Ports, WorldRecord


class Verdict(enum.Enum):
    """Result of a replay."""

    EQUAL = "equal"
    NOT_BIT_COMPARABLE = "not bit-comparable"
    DIVERGED = "DIVERGED"
    CUT_SHORT = "equal as far as it can be read"
    REFUSED = "NOT REPLAYABLE"


@dataclass(frozen=True)
class Replay:
    """Replay of one log.

    Attributes:
        counterfactual_from: Tick of the first command that differs from the recording, or None if all commands are
            identical. Later recorded samples do not result from the core's commands.
        other_code: Whether a different version of the core recorded the log; False if unknown.
        recorded_decisions: Reason why the decisions were taken from the log, or empty if the policy made them again.
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
    recorded_decisions: str = ""


def replay(
    log: TrialLog, rebuilder: Rebuilder, *, in_mujoco: bool = False, out: tuple[TrialRecorder, str] | None = None
) -> Replay:
    """Replay one log. ``out`` contains the recorder for the replay and the name of its log.

    With ``in_mujoco``, the simulator continues from the first command that differs from the recording.

    Raises:
        LogError: The log cannot be replayed.
        ConfigurationError: A change does not match the log.
    """
    if log.missing:
        raise LogError(log.path, "", log.missing, "a trial can only be replayed whole")
    for name, record in (("/start", log.start), ("/end", log.end)):
        for each in () if record is None else fields(record):
            if each.name.endswith("_json"):
                json_in(log, f"{name} {each.name}", getattr(record, each.name))
    rebuilt = rebuilder.rebuild(log)
    trial = ReplayedTrial(Tape(log), rebuilt, out)
    tape, differences = trial.tape, trial.tape.differences
    note, whole = "", log.end is not None
    error: Exception | None = None
    if in_mujoco:
        note = _continued(log, continue_in_mujoco(trial))
    else:
        error = run_over(trial)
        if isinstance(error, TapeEndError):
            note, whole = ending_note(tape), whole and not _torn(tape)
        elif tape.sends.left:
            differences.add(tape.tick, "/end", "ticks", f"{len(log.ticks)} ticks", f"{tape.tick + 1} ticks")
    # In the simulator, the records after the first different command do not result from the core's commands.
    if not in_mujoco or differences.first_command_tick is None:
        compare_records(trial, whole=whole, what_if=rebuilder.what_if)
    if whole and not in_mujoco:
        compare_latch(tape, rebuilt.supervisor.latch.cause, error)
        if tape.stops.left:
            differences.add(tape.tick, "/call", "port call", "arm.stop", None)
    outcome = outcome_of(rebuilt.task.report)
    return Replay(
        path=log.path,
        verdict=_verdict(differences, log),
        ticks=tape.tick + 1,
        recorded_outcome=log.outcome or ("" if log.end is None else log.end.error),
        replayed_outcome="" if outcome is None else outcome.value,
        first=differences.first,
        differences=differences.count,
        causes=_known_causes(log, rebuilt) if differences.count else (),
        note="; ".join(filter(None, (log.damage, note))),
        decisions=tuple(trial.made.of[DecisionEntry]),
        counterfactual_from=differences.first_command_tick,
        recorded_decisions=rebuilt.recorded_decisions,
        other_code=bool(log.start.core_sha256) and log.start.core_sha256 != core_sha256(),
    )


def _torn(tape: Tape) -> bool:
    """Return True if an external cause, such as a second Ctrl-C, ended the trial partway through a tick."""
    last, end = tape.last, tape.log.end
    by_others = end is not None and end.raised_by in (BY_OUTSIDE, BY_POLICY)
    return by_others and last is not None and last.joints is not None and last.requested_rad is None


def run_over(trial: ReplayedTrial) -> Exception | None:
    """Run the core on the tape and return the error that ended it, or None if the trial ended normally."""
    tape = trial.tape
    sensor = ReplaySensor("recorded force sensor", tape.wrenches)
    encoder, arm = ReplaySensor("recorded encoders", tape.joints), ReplayArm(tape)
    with ExitStack() as opened:
        for device in (sensor, encoder, arm):
            opened.enter_context(device)
        ports = Ports(ReplayClock(tape), sensor, encoder, arm)
        world = WorldRecord("recording", json.loads(tape.log.start.world_json))
        try:
            trial.run(ports, world, lambda report: truth_in(tape.log, report, trial.rebuilt.config))
        except LogError:
            raise
        except Exception as error:
            return error
    return None


def _continued(log: TrialLog, scored: ScoredTrial) -> str:
    """Return the outcome of a trial that was continued in the simulator, and the recorded outcome."""
    report, end = scored.report, log.end
    text = f"in the simulator: {scored.outcome} after {report.exploration_time_s:.2f} s of exploration"
    text += "" if scored.truth is None else f", true peak {scored.truth.peak_force_N:.1f} N"
    if end is not None:
        text += f" (recorded: {log.outcome} after {end.exploration_time_s:.2f} s"
        text += "" if end.true_peak_force_N is None else f", {end.true_peak_force_N:.1f} N"
        text += ")"
    return text


def _verdict(differences: Differences, log: TrialLog) -> Verdict:
    if not differences.count:
        return Verdict.CUT_SHORT if log.damage else Verdict.EQUAL
    if differences.first_gross is None and _other_processor(log):
        return Verdict.NOT_BIT_COMPARABLE
    return Verdict.DIVERGED


def _known_causes(log: TrialLog, rebuilt: Rebuilt) -> tuple[str, ...]:
    """Return known changes since the recording that may cause differences."""
    start, causes = log.start, []
    if log.end is not None and log.end.outcome == IMPORTED:
        causes.append("the motion, which comes from a bag")
    recorded: dict[str, str] = json.loads(start.versions_json or "{}")
    for name, version in made_with().items():
        if recorded.get(name) != version:
            causes.append(f"{name} {version} (recorded with {recorded.get(name)})")
    if start.core_sha256 != core_sha256():
        causes.append("the core's code differs from the recording's")
    if start.model_sha256 != arm_sha256(rebuilt.config.arm, rebuilt.config.tool.geometry):
        causes.append(f"the model of the arm {rebuilt.config.arm} differs from the recording's")
    if isinstance(rebuilt.policy, ThirdPartyPolicy):
        stored = PolicyDocument.from_json_text(start.policy_json).third_party if start.policy_json else None
        now = rebuilt.policy.entry
        if stored is not None and stored.code == now.code and stored.source_sha256 != now.source_sha256:
            causes.append(f"the code of {now.code} differs from the recording's")
        if stored is not None and stored.version != now.version:
            causes.append(f"{now.distribution} {now.version} (recorded with {stored.version})")
    if _other_processor(log):
        causes.append("another processor")
    return tuple(causes)


def _other_processor(log: TrialLog) -> bool:
    """Return True if the least significant bits may differ between this processor and the recording one."""
    return decisive(json.loads(log.start.processor_json or "{}")) != decisive(processor())
