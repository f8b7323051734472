"""The control loop over the four ports, and its observers."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from palpate.core.errors import DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    ArmCommand,
    ForceSensor,
    JointCommand,
    JointSample,
    Ports,
    Snapshot,
    Validity,
    WrenchSample,
)
from palpate.core.trial import CommandOverride, Supervised, TrialReport, TrialSetup, TrialTiming

if TYPE_CHECKING:
    # Creating a task loads kinematics and learning; an observer needs neither.
    from palpate.core.policy import Observation
    from palpate.core.supervision import Supervisor
    from palpate.core.trial import Task

_NS: int = 1_000_000_000
LATE_NS: int = 1_000_000
"""Delay past the start of its slot beyond which a tick counts as late."""
FORCE_SENSOR: Final = "force_sensor"
JOINT_ENCODER: Final = "joint_encoder"
ARM: Final = "arm"


@dataclass(frozen=True, slots=True)
class UnfinishedTick:
    """State of the last tick when an error ended the trial or the trial was closed.

    Attributes:
        calling: Port whose call failed: ``force_sensor``, ``joint_encoder`` or ``arm``; empty if no port call failed.
        time_ns: Run-clock time at the tick; None if the clock was not read.
        wrench: The force sample; None if none was read.
        joints: The joint sample; None if none was read.
        command: The command to be sent; None until it is known.
    """

    calling: str
    time_ns: int | None
    wrench: WrenchSample | None
    joints: JointSample | None
    command: JointCommand | None


class LoopObserver:
    """Base class for observers; the loop calls only the methods that a subclass overrides.

    The events in a tick occur in the order of the methods below. ``sensed``, ``chosen`` and ``acted`` are not called
    during a retraction. Only :func:`run_trial` calls ``sensed`` and ``chosen``; a caller of :func:`trial_ticks` does
    not receive them. If an observer raises, the trial ends and the arm is stopped.
    """

    def begun(self, start_ns: int, report: TrialReport) -> None:
        """Called once the task has begun, with its schedule's start time; the report is updated during the trial."""

    def waited(self, tick: int, deadline_ns: int) -> None:
        """Called after sleeping until a tick's slot."""

    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        """Called after the run clock has been read for the tick in a slot."""

    def force_read(self, sample: WrenchSample) -> None:
        """Called after the force sensor has been read."""

    def joints_read(self, sample: JointSample) -> None:
        """Called after the joint encoders have been read."""

    def sensed(self, observation: Observation | None) -> None:
        """Called after the task has processed the snapshot; the observation is set only at decision ticks."""

    def chosen(self) -> None:
        """Called at decision ticks, after the policy has chosen an action."""

    def acted(self, command: JointCommand) -> None:
        """Called after the task has returned a command."""

    def supervised(self, supervised: Supervised) -> None:
        """Called after the supervisor has passed on or changed the command; not called without a supervisor."""

    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        """Called after the command has been sent to the arm and the arm has reported the applied command."""

    def ended(self) -> None:
        """Called at the end of a tick, before the loop sleeps or the trial ends."""

    def failed(self, error: BaseException, tick: UnfinishedTick) -> None:
        """Called after an error or generator closing (GeneratorExit) ended the trial; the arm has been stopped."""

    def stopped(self, error: BaseException | None) -> None:
        """Called after the stop command at the end of the trial; ``error`` is the exception that it raised, or None."""


def tick_time_ns(start_ns: int, slot: int) -> int:
    """Return the start of a slot, computed from the first tick so that rounding errors do not accumulate."""
    return start_ns + slot * _NS // CONTROL_RATE_HZ


def next_slot(start_ns: int, slot: int, time_ns: int) -> int:
    """Return the slot for the tick after the one that ran in ``slot`` at ``time_ns``.

    A late tick still runs. Slots that have passed are skipped, so ticks never run in a burst.
    """
    return max(slot, (time_ns - start_ns) * CONTROL_RATE_HZ // _NS) + 1


def run_trial(
    task: Task,
    ports: Ports,
    setup: TrialSetup,
    supervisor: Supervisor | None = None,
    observers: Sequence[LoopObserver] = (),
) -> TrialReport:
    """Run one trial from the arm's current pose.

    The first tick runs immediately. The arm is stopped however the trial ends.

    Args:
        observers: Observers, called in this order at each event.

    Raises:
        FaultLatchedError: A supervisor trip or a device fault has not been acknowledged.
    """
    ticks = trial_ticks(task, ports, setup, supervisor, observers)
    on_sensed, on_chosen = _listeners(observers, "sensed"), _listeners(observers, "chosen")
    try:
        snapshot = next(ticks, None)
        while snapshot is not None:
            observation = task.sense(snapshot)
            for call in on_sensed:
                call(observation)
            if observation is not None:
                task.choose()
                for call in on_chosen:
                    call()
            snapshot = next_snapshot(ticks, task.act())
    except DeviceError as error:
        # An error of the task itself does not pass through the generator, which only waits for the command.
        if supervisor is not None:
            supervisor.latch.set(str(error))
        raise
    finally:
        ticks.close()
    return task.report


def next_snapshot(ticks: Generator[Snapshot, JointCommand, None], command: JointCommand) -> Snapshot | None:
    """Send the command to :func:`trial_ticks`; return the next tick's snapshot, or None at the end of the trial.

    It is a separate function so that only the generator's own StopIteration ends the trial.
    """
    try:
        return ticks.send(command)
    except StopIteration:
        return None


def trial_ticks(
    task: Task,
    ports: Ports,
    setup: TrialSetup,
    supervisor: Supervisor | None = None,
    observers: Sequence[LoopObserver] = (),
) -> Generator[Snapshot, JointCommand, None]:
    """Run the control loop as a generator that yields each tick's snapshot and receives the task's command.

    It handles trips and retractions itself and requests no commands during them. Closing the generator ends the trial
    and stops the arm.

    Args:
        task: Task to run. The generator calls ``begin``; the caller calls ``step``, or ``sense`` and ``act``.

    Raises:
        FaultLatchedError: A supervisor trip or a device fault has not been acknowledged.
    """
    clock, sensor, encoder, arm = ports.clock, ports.force_sensor, ports.joint_encoder, ports.arm
    on_waited, on_clock, on_force, on_joints, on_acted, on_supervised, on_sent, on_ended = (
        _listeners(observers, event)
        for event in (
            "waited", "clock_read", "force_read", "joints_read", "acted", "supervised", "sent", "ended",
        )
    )  # fmt: skip
    calling, time_ns, wrench, joints = "", None, None, None
    applied: AppliedCommand | None = None
    command: JointCommand | None = None
    tick = slot = 0
    seen: tuple[int | None, int | None] = (None, None)
    retreating = False
    try:
        if supervisor is not None:
            supervisor.begin()
        task.begin(setup)
        report, timing = task.report, task.report.timing
        deadline_ns = start_ns = clock.now_ns()
        for call in _listeners(observers, "begun"):
            call(start_ns, report)
        while report.outcome is None or retreating:
            last: WrenchSample | None = wrench
            time_ns = wrench = joints = command = None
            clock.sleep_until(deadline_ns)
            for call in on_waited:
                call(tick, deadline_ns)
            time_ns = clock.now_ns()
            for call in on_clock:
                call(deadline_ns, time_ns)
            calling = FORCE_SENSOR
            wrench = _read_on(sensor, last) if retreating else sensor.read()
            calling = ""
            for call in on_force:
                call(wrench)
            calling = JOINT_ENCODER
            joints = encoder.read()
            calling = ""
            for call in on_joints:
                call(joints)
            snapshot = Snapshot(tick, time_ns, wrench, joints, applied)
            if supervisor is None:
                command, changed = (yield snapshot), None
                for call in on_acted:
                    call(command)
            else:
                if retreating:
                    supervised = supervisor.retreat(snapshot)
                else:
                    requested = yield snapshot
                    for call in on_acted:
                        call(requested)
                    supervised = supervisor.check(snapshot, requested, task.constraints, task.tip_m, task.turned_rad)
                    if supervised.command_override is not None:
                        _report(task, supervised.command_override)
                command, changed = supervised
                retreating = changed is not None and supervisor.retracting
                for call in on_supervised:
                    call(supervised)
            calling = ARM
            answer = arm.send(command)
            calling = ""
            for call in on_sent:
                call(snapshot, command, answer)
            applied = answer if changed is None else changed.applied(answer)
            news = (wrench.sequence, joints.sequence)
            late_ns = time_ns - deadline_ns
            if late_ns > timing.worst_late_ns or late_ns > LATE_NS or news[0] == seen[0] or news[1] == seen[1]:
                _note_irregular(timing, late_ns, seen, news)
                slot, due = next_slot(start_ns, slot, time_ns), slot + 1
                timing.skipped_slots += slot - due
            else:
                slot += 1
            seen, tick, deadline_ns = news, tick + 1, tick_time_ns(start_ns, slot)
            for call in on_ended:
                call()
    except BaseException as error:
        _stop(arm, supervisor, observers, error, UnfinishedTick(calling, time_ns, wrench, joints, command))
        raise
    else:
        _stop(arm, supervisor, observers)
        task.conclude()


def _read_on(sensor: ForceSensor, last: WrenchSample | None) -> WrenchSample:
    """Keep reading the sensor during a retraction, which continues even if the sensor fails."""
    try:
        return sensor.read()
    except DeviceError:
        if last is None:
            raise
        return replace(last, validity=Validity.INVALID)


def _listeners(observers: Sequence[LoopObserver], event: str) -> tuple[Callable[..., None], ...]:
    """Return the observers' methods for an event, omitting those that are not overridden."""
    ignored = getattr(LoopObserver, event)
    return tuple(getattr(each, event) for each in observers if getattr(type(each), event) is not ignored)


def _stop(
    arm: ArmCommand,
    supervisor: Supervisor | None,
    observers: Sequence[LoopObserver],
    error: BaseException | None = None,
    tick: UnfinishedTick | None = None,
) -> None:
    """Stop the arm first, then latch device errors, including those from stopping, and notify the observers."""
    problem: BaseException | None = None
    try:
        arm.stop()
    except BaseException as raised:
        problem = raised
        raise
    finally:
        for fault in (error, problem):
            if supervisor is not None and isinstance(fault, DeviceError):
                supervisor.latch.set(str(fault))
        if error is not None:
            for call in _listeners(observers, "failed"):
                call(error, tick)
        for call in _listeners(observers, "stopped"):
            call(problem)


def _report(task: Task, command_override: CommandOverride) -> None:
    if command_override.trip is not None:
        task.report.trip = command_override.trip
        task.tripped(command_override.trip)
    else:
        task.clamped(command_override)


def _note_irregular(
    timing: TrialTiming, late_ns: int, seen: tuple[int | None, int | None], news: tuple[int, int]
) -> None:
    timing.worst_late_ns = max(timing.worst_late_ns, late_ns)
    timing.late_ticks += late_ns > LATE_NS
    timing.repeated_samples += news[0] == seen[0] or news[1] == seen[1]
