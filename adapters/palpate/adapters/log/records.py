"""Log messages as plain values. ``log.proto`` defines their field numbers."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence
from typing import Final

from palpate.core.ports import AppliedCommand, JointCommand, JointSample, JointVector, Snapshot, WrenchSample
from palpate.core.trial import TRIALS_OF_A_SERIES, DecisionRecord


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class StartRecord:
    """Complete initial state of a trial, which allows the trial to be replayed on its own.

    Attributes:
        start_m: Starting position above the plate, (2,), in the task frame.
        ready_rad: The ready pose, (n,).
        tip_rotation: Initial tool orientation as a row-major rotation matrix, (9,), in the base frame.
        perception_json: Perception stages, including fitted values.
        policy: ``document``, the name of a baseline, or the code of a third-party policy, ``package.module:Name``.
        policy_json: The policy document, even of a third-party policy.
        temperature: Exploration temperature, or None for a policy without one.
        world: ``simulator``, or the name of a rig.
        world_json: Values that reproduce the world, with its ground truth if there is one.
        processor_json: Processor properties that may affect the least significant bits of the results.
        derived_from: The log on which this what-if is based; empty for a recording.
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
        """Return the trial's number in its run, as used in file names and tables."""
        return self.trial % TRIALS_OF_A_SERIES


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class DecisionEntry:
    """Chosen action, with the values on which the choice was based."""

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
    controller: str = ""
    spatial: tuple[float, ...] = ()

    @classmethod
    def of(cls, number: int, decision: DecisionRecord, temperature: float | None) -> DecisionEntry:
        """Create an entry from a decision in a trial's report."""
        shared = {name: getattr(decision, name) for name in _OF_DECISION}
        return cls(number=number, temperature=temperature, **shared)


_OF_DECISION = [each.name for each in dataclasses.fields(DecisionRecord) if each.name != "reinforcement"]


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class ReinforcementEntry:
    """Reinforcement for the decision with this number."""

    tick: int
    number: int
    reinforcement: float
    counterfactual: bool = False


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class EventEntry:
    """Event during a trial."""

    tick: int
    name: str
    detail: str = ""
    counterfactual: bool = False


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class LossEntry:
    """Data that the recorder lost, and the reason."""

    tick: int
    problem: str
    text: str = ""
    dropped_messages: int = 0


IMPORTED: Final = "imported"
"""Outcome given in a log that was converted from a bag."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class EndRecord:
    """Result of a trial, and the learner after it. ``true_...`` is the simulator's ground truth, or None on a real arm.

    ``stopped_by`` names what stopped the arm, unless core or supervisor did. ``timing_json``, on rigs, contains the
    durations of each section of a tick from the run's start to this trial's end. Four fields count irregular ticks and
    samples. ``raised_by`` is the origin of ``error``: core, port, policy (a third-party one) or outside (observers, the
    clock, signals); empty without an error. ``policy_sha256`` is :func:`policy_digest` for a third-party policy.
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
    """Return a digest of a third-party policy's own results, and of its learner before and after a trial (JSON)."""
    rows = [dataclasses.astuple(each) for each in decisions]
    return hashlib.sha256(repr((rows, before, after)).encode()).hexdigest()


@dataclasses.dataclass(frozen=True, slots=True)
class TickRecord:
    """Port data from one control tick.

    Attributes:
        time_ns: Clock reading, or None if the clock was not read.
        wrench: The force sample, or None if none was read.
        requested_rad: The requested command, (n,), or None if none was sent.
        counterfactual: True if this command or an earlier one differs from the recording: a what-if, not an
            observation.
    """

    tick: int
    time_ns: int | None = None
    deadline_ns: int | None = None
    wrench: WrenchSample | None = None
    joints: JointSample | None = None
    requested_rad: JointVector | None = None
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
        """Create the record of a complete tick."""
        wrench, joints, requested_rad = snapshot.wrench, snapshot.joints, command.position_rad
        return cls(snapshot.tick, snapshot.time_ns, deadline_ns, wrench, joints, requested_rad, applied, counterfactual)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class CallEntry:
    """A failed port call, or a call other than the four in a tick: the clock at the start, and the stop."""

    tick: int
    port: str
    call: str
    time_ns: int | None = None
    requested_rad: JointVector | None = None
    error: str = ""
    text: str = ""
