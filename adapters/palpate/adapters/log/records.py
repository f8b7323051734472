"""The messages of a log as plain values; ``log.proto`` numbers their fields."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence

from palpate.core.ports import AppliedCommand, JointCommand, JointSample, JointVector, Snapshot, WrenchSample
from palpate.core.trial import TRIALS_OF_A_SERIES, DecisionRecord


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class StartRecord:
    """All that a trial starts with, so that it can be replayed alone.

    Attributes:
        schema: Version of the log's schema.
        trial: Index of the trial; with the seed it gives every random stream.
        start_m: Where the trial starts above the plate, (2,), task frame.
        ready_rad: The ready pose, (n,).
        tip_rotation: Orientation that the tool keeps, (9,) row by row, base frame.
        perception_json: Stages of perception, fitted ones with what was fitted.
        policy: ``document``, the name of a baseline, or what made a foreign policy, ``package.module:Name``.
        policy_json: The policy document, if it is one, or that of a foreign policy.
        learner_json: The learner's state as the trial began; empty where nothing learns.
        filter_state: Tare and memory of the wrench filter.
        generator_json: State of the policy's random generator.
        temperature: Temperature of the exploration; None for a policy without one.
        world: ``simulator``, or what else the ports led to.
        world_json: What it takes to set up that world again, and its truth where there is one.
        versions_json: Versions of palpate and of what the numbers depend on.
        processor_json: What of the processor the last bits may depend on.
        derived_from: The log that a what-if came from; empty for a recording.
    """

    schema: str
    command: str
    config_toml: str
    arm: str
    model_sha256: str
    core_sha256: str
    seed: int
    trial: int
    start_m: tuple[float, ...]
    ready_rad: tuple[float, ...]
    tip_rotation: tuple[float, ...]
    perception_json: str
    policy: str
    policy_json: str = ""
    frozen: bool = False
    learner_json: str = ""
    perception_state: tuple[float, ...] = ()
    filter_state: tuple[float, ...] = ()
    generator_json: str = ""
    temperature: float | None = None
    world: str = ""
    world_json: str = ""
    versions_json: str = ""
    processor_json: str = ""
    derived_from: str = ""

    @property
    def number(self) -> int:
        """Number of the trial in its run, as the log's file and the run's tables have it."""
        return self.trial % TRIALS_OF_A_SERIES


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class DecisionEntry:
    """One choice of an action, and the numbers that it was chosen by."""

    tick: int
    number: int
    symbol: str
    state: str
    action: str
    source: str
    temperature: float | None = None
    counterfactual: bool = False
    displacement_m: tuple[float, ...] = ()
    index: int | None = None
    grounds: tuple[float, ...] = ()
    law: str = ""
    spatial: tuple[float, ...] = ()

    @classmethod
    def of(cls, number: int, decision: DecisionRecord, temperature: float | None) -> DecisionEntry:
        """The decision of that number in a trial, as its report has it."""
        return cls(
            tick=decision.tick,
            number=number,
            symbol=decision.symbol,
            state=decision.state,
            action=decision.action,
            source=decision.source,
            temperature=temperature,
            displacement_m=decision.displacement_m,
            index=decision.index,
            grounds=decision.grounds,
            law=decision.law,
            spatial=decision.spatial,
        )


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ReinforcementEntry:
    """What the decision of that number earned."""

    tick: int
    number: int
    reinforcement: float
    counterfactual: bool = False


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class EventEntry:
    """Something that happened."""

    tick: int
    name: str
    detail: str = ""
    counterfactual: bool = False


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class LossEntry:
    """What the recorder could not keep, and why."""

    tick: int
    problem: str
    text: str = ""
    dropped_messages: int = 0
    first_dropped_tick: int | None = None
    last_dropped_tick: int | None = None


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class EndRecord:
    """What a trial came to, and the learner after it. ``true_...`` is the simulator's truth; None on an arm.

    ``stopped_by`` is what stopped the arm besides core and supervisor; ``timing_json`` tells, on rigs, what each
    section of a tick took, from the run's start to this trial's end. Four are the core's own count of how regular its
    ticks and samples were. ``raised_by`` is who raised ``error``: core, port, policy (a foreign one) or outside
    (observers, the clock, signals); empty without an error. ``policy_sha256`` is
    :func:`policy_digest` where the policy is a foreign one.
    """

    tick: int
    outcome: str = ""
    exploration_time_s: float = 0.0
    actions: int = 0
    peak_force_N: float = 0.0
    depth_m: float = 0.0
    ticks: int = 0
    clamped_ticks: int = 0
    learner_json: str = ""
    success: bool | None = None
    true_peak_force_N: float | None = None
    true_depth_m: float | None = None
    true_tip_in_task_m: tuple[float, ...] = ()
    true_hole_in_task_m: tuple[float, ...] = ()
    error: str = ""
    text: str = ""
    counterfactual: bool = False
    stopped_by: str = ""
    timing_json: str = ""
    worst_late_ns: int = 0
    late_ticks: int = 0
    skipped_slots: int = 0
    repeated_samples: int = 0
    raised_by: str = ""
    policy_sha256: str = ""


def policy_digest(decisions: Sequence[DecisionEntry], before: str, after: str) -> str:
    """Digest of what only a foreign policy can make: without its code nothing else could be held against that.

    Args:
        before: The learner's state as the trial began, JSON.
    """
    rows = [dataclasses.astuple(each) for each in decisions]
    return hashlib.sha256(repr((rows, before, after)).encode()).hexdigest()


@dataclasses.dataclass(frozen=True, slots=True)
class TickRecord:
    """What the ports gave and took in one control tick.

    Attributes:
        tick: Counts the ticks of the trial from 0.
        time_ns: What the clock read; None when it was not asked.
        wrench: The force sample read; None when none was.
        asked_rad: The command as asked, (n,); None when none was sent.
        counterfactual: The command before, or this one, is not what was recorded: a what-if, not an observation.
    """

    tick: int
    time_ns: int | None = None
    deadline_ns: int | None = None
    wrench: WrenchSample | None = None
    joints: JointSample | None = None
    asked_rad: JointVector | None = None
    applied: AppliedCommand | None = None
    counterfactual: bool = False

    @classmethod
    def of(
        cls,
        deadline_ns: int | None,
        snapshot: Snapshot,
        command: JointCommand,
        applied: AppliedCommand,
        counterfactual: bool = False,
    ) -> TickRecord:
        """A whole tick."""
        wrench, joints, asked_rad = snapshot.wrench, snapshot.joints, command.position_rad
        return cls(snapshot.tick, snapshot.time_ns, deadline_ns, wrench, joints, asked_rad, applied, counterfactual)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CallEntry:
    """A port call that failed, or that is none of a tick's four: the clock at the start, and the stop."""

    tick: int
    port: str
    call: str
    time_ns: int | None = None
    asked_rad: JointVector | None = None
    error: str = ""
    text: str = ""
