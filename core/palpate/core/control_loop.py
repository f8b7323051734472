"""The loop over the ports, and who may watch it."""

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
from palpate.core.trial import Intervention, Supervised, TrialReport, TrialSetup, TrialTiming

if TYPE_CHECKING:
    # Kinematics and learning are loaded by whoever makes a task; an observer needs neither.
    from palpate.core.policy import Observation
    from palpate.core.supervision import Supervisor
    from palpate.core.trial import Task

_NS: int = 1_000_000_000
LATE_NS: int = 1_000_000
"""A tick that begins so much after its slot counts as late."""
FORCE_SENSOR: Final = "force_sensor"
JOINT_ENCODER: Final = "joint_encoder"
ARM: Final = "arm"


@dataclass(frozen=True, slots=True)
class UnfinishedTick:
    """What the loop held of its newest tick when the trial ended by an error or was closed.

    Attributes:
        calling: The port whose call failed: ``force_sensor``, ``joint_encoder`` or ``arm``; empty when it was none.
        time_ns: Run-clock time of the tick; None when the clock was not read.
        wrench: The force sample; None when there was none.
        joints: The joint sample; None when there was none.
        command: What was to be sent; None before it was known.
    """

    calling: str
    time_ns: int | None
    wrench: WrenchSample | None
    joints: JointSample | None
    command: JointCommand | None


class LoopObserver:
    """The base of recorders, stopwatches and live views: the loop calls what a subclass overrides, and nothing else.

    The events of a tick come in the order in which they stand here. While the supervisor draws the tool back nothing is
    sensed, chosen or acted. ``sensed`` and ``chosen`` come from :func:`run_trial` alone: whoever steps the task over
    :func:`trial_ticks` does without. An observer that raises ends the trial, with the arm stopped.
    """

    def begun(self, start_ns: int, report: TrialReport) -> None:
        """The task has begun; its schedule counts from this time, and this report grows as the trial goes on."""

    def waited(self, tick: int, deadline_ns: int) -> None:
        """The sleep until a tick's slot is over."""

    def clock_read(self, deadline_ns: int, time_ns: int) -> None:
        """The tick for this slot found this to be the time, run clock."""

    def force_read(self, sample: WrenchSample) -> None:
        """The force sensor was read."""

    def joints_read(self, sample: JointSample) -> None:
        """The joint encoders were read."""

    def sensed(self, observation: Observation | None) -> None:
        """The task has taken the snapshot in; what an action is to be chosen by, in the ticks in which one is due."""

    def chosen(self) -> None:
        """The policy has chosen an action; only in those ticks."""

    def acted(self, command: JointCommand) -> None:
        """This is what the task asks of the arm."""

    def supervised(self, supervised: Supervised) -> None:
        """This is what the arm is to be told, and why where it is not what the task asked; not without a supervisor."""

    def sent(self, snapshot: Snapshot, command: JointCommand, applied: AppliedCommand) -> None:
        """The arm was told this command, and answered with so much of it."""

    def ended(self) -> None:
        """The tick is over; the next thing is the sleep, or the end of the trial."""

    def failed(self, error: BaseException, tick: UnfinishedTick) -> None:
        """This error ended the trial, or its ticks were closed (GeneratorExit); the arm was told to stop before."""

    def stopped(self, error: BaseException | None) -> None:
        """The arm was told to stop, on every way out; it raised this error, or None."""


def tick_time_ns(start_ns: int, slot: int) -> int:
    """When a slot of the control schedule begins: counted from the start, so that rounding never adds up."""
    return start_ns + slot * _NS // CONTROL_RATE_HZ


def next_slot(start_ns: int, slot: int, time_ns: int) -> int:
    """The slot for the tick after one that ran in ``slot`` and found the time to be ``time_ns``.

    A tick that comes late takes its turn; slots that went by meanwhile are left out and never made up for in a burst.
    """
    return max(slot, (time_ns - start_ns) * CONTROL_RATE_HZ // _NS) + 1


def run_trial(
    task: Task,
    ports: Ports,
    setup: TrialSetup,
    supervisor: Supervisor | None = None,
    observers: Sequence[LoopObserver] = (),
) -> TrialReport:
    """Run one trial from wherever the arm is.

    The first tick is at the clock's present time. Every way out leaves the arm stopped.

    Args:
        observers: Are called in this order at each event.

    Raises:
        FaultLatchedError: The supervisor has tripped before, or a device has failed, and nobody has acknowledged it.
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
        # What the task itself refuses never comes by the ticks, which only wait for its command.
        if supervisor is not None:
            supervisor.latch.set(str(error))
        raise
    finally:
        ticks.close()
    return task.report


def next_snapshot(ticks: Generator[Snapshot, JointCommand, None], command: JointCommand) -> Snapshot | None:
    """Send the command of a tick of :func:`trial_ticks`; returns the next tick's snapshot, None when the trial is over.

    A function of its own, so that no StopIteration from anywhere else is taken for the end of a trial.
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
    """The same loop for whoever steps the task themselves: gives each tick's snapshot, and takes the task's command.

    A trip and the retreat after it are its own affair; while it retreats it asks for nothing. Closing it ends the
    trial wherever it is, and leaves the arm stopped.

    Args:
        task: Is begun here; its ``step``, or ``sense`` and ``act``, is the caller's.

    Raises:
        FaultLatchedError: The supervisor has tripped before, or a device has failed, and nobody has acknowledged it.
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
                    asked = yield snapshot
                    for call in on_acted:
                        call(asked)
                    supervised = supervisor.check(snapshot, asked, task.expectation, task.tip_m, task.turned_rad)
                    if supervised.intervention is not None:
                        _report(task, supervised.intervention)
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
    """While the tool is drawn back, which goes by position: a sensor that fails then does not leave it where it is."""
    try:
        return sensor.read()
    except DeviceError:
        if last is None:
            raise
        return replace(last, validity=Validity.INVALID)


def _listeners(observers: Sequence[LoopObserver], event: str) -> tuple[Callable[..., None], ...]:
    """The observers' methods for an event; an event that nobody overrides costs a tick nothing."""
    ignored = getattr(LoopObserver, event)
    return tuple(getattr(each, event) for each in observers if getattr(type(each), event) is not ignored)


def _stop(
    arm: ArmCommand,
    supervisor: Supervisor | None,
    observers: Sequence[LoopObserver],
    error: BaseException | None = None,
    tick: UnfinishedTick | None = None,
) -> None:
    """First of all the arm. What a device failed by, the stop included, is latched as a trip is."""
    trouble: BaseException | None = None
    try:
        arm.stop()
    except BaseException as raised:
        trouble = raised
        raise
    finally:
        for fault in (error, trouble):
            if supervisor is not None and isinstance(fault, DeviceError):
                supervisor.latch.set(str(fault))
        if error is not None:
            for call in _listeners(observers, "failed"):
                call(error, tick)
        for call in _listeners(observers, "stopped"):
            call(trouble)


def _report(task: Task, intervention: Intervention) -> None:
    if intervention.trip is not None:
        task.report.trip = intervention.trip
        task.tripped(intervention.trip)
    else:
        task.clamped(intervention)


def _note_irregular(
    timing: TrialTiming, late_ns: int, seen: tuple[int | None, int | None], news: tuple[int, int]
) -> None:
    timing.worst_late_ns = max(timing.worst_late_ns, late_ns)
    timing.late_ticks += late_ns > LATE_NS
    timing.repeated_samples += news[0] == seen[0] or news[1] == seen[1]
