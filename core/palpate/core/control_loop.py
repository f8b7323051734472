"""The loop over the ports, and nothing else."""

from __future__ import annotations

from collections.abc import Generator

from palpate.core.insertion.expectation import Supervised
from palpate.core.insertion.task import InsertionTask
from palpate.core.insertion.trial import TrialReport, TrialSetup, TrialTiming
from palpate.core.ports.devices import Ports
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, JointCommand, Snapshot
from palpate.core.supervision.supervisor import Supervisor

_NS: int = 1_000_000_000
LATE_NS: int = 1_000_000
"""A tick that begins so much after its slot counts as late."""


def tick_time_ns(start_ns: int, slot: int) -> int:
    """When a slot of the control schedule begins: counted from the start, so that rounding never adds up."""
    return start_ns + slot * _NS // CONTROL_RATE_HZ


def next_slot(start_ns: int, slot: int, time_ns: int) -> int:
    """The slot for the tick after one that ran in ``slot`` and found the time to be ``time_ns``.

    A tick that comes late takes its turn; slots that went by meanwhile are left out and never made up for in a burst.
    """
    return max(slot + 1, (time_ns - start_ns) * CONTROL_RATE_HZ // _NS + 1)


def run_trial(
    task: InsertionTask, ports: Ports, setup: TrialSetup, supervisor: Supervisor | None = None
) -> TrialReport:
    """Run one trial from wherever the arm is.

    The first tick is at the clock's present time. Every way out leaves the arm stopped.

    Args:
        task: What is to be done.
        ports: What it is done over.
        setup: Which trial.
        supervisor: Stands between the task and the arm; None lets every command through.

    Raises:
        FaultLatchedError: The supervisor has tripped before, and nobody has acknowledged it.
    """
    ticks = trial_ticks(task, ports, setup, supervisor)
    try:
        snapshot = next(ticks, None)
        while snapshot is not None:
            snapshot = next_snapshot(ticks, task.step(snapshot))
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
    task: InsertionTask, ports: Ports, setup: TrialSetup, supervisor: Supervisor | None = None
) -> Generator[Snapshot, JointCommand, None]:
    """The same loop for whoever steps the task themselves: gives each tick's snapshot, and takes the task's command.

    A trip and the retreat after it are its own affair; while it retreats it asks for nothing. Closing it ends the
    trial wherever it is, and leaves the arm stopped.

    Args:
        task: Is begun here; its ``step``, or ``sense`` and ``act``, is the caller's.
        ports: What it is done over.
        setup: Which trial.
        supervisor: Stands between the task and the arm; None lets every command through.

    Raises:
        FaultLatchedError: The supervisor has tripped before, and nobody has acknowledged it.
    """
    clock, sensor, encoder, arm = ports.clock, ports.force_sensor, ports.joint_encoder, ports.arm
    applied: AppliedCommand | None = None
    tick = slot = 0
    seen = (-1, -1)
    try:
        if supervisor is not None:
            supervisor.begin()
        task.begin(setup)
        timing = task.report.timing
        start_ns = clock.now_ns()
        while not task.done or (supervisor is not None and supervisor.retracting):
            deadline_ns = tick_time_ns(start_ns, slot)
            clock.sleep_until(deadline_ns)
            time_ns = clock.now_ns()
            snapshot = Snapshot(tick, time_ns, sensor.read(), encoder.read(), applied)
            if supervisor is None:
                applied = arm.send((yield snapshot))
            else:
                if supervisor.retracting:
                    supervised = supervisor.retreat(snapshot)
                else:
                    supervised = _supervised(task, supervisor, snapshot, (yield snapshot))
                applied = supervised.applied(arm.send(supervised.command))
            news = (snapshot.wrench.sequence, snapshot.joints.sequence)
            if time_ns != deadline_ns or news[0] == seen[0] or news[1] == seen[1]:
                _note_irregular(timing, time_ns - deadline_ns, seen, news)
            seen, due = news, slot + 1
            tick, slot = tick + 1, next_slot(start_ns, slot, time_ns)
            timing.skipped_slots += slot - due
    finally:
        arm.stop()


def _supervised(task: InsertionTask, supervisor: Supervisor, snapshot: Snapshot, asked: JointCommand) -> Supervised:
    supervised = supervisor.check(snapshot, asked, task.expectation, task.tip_m)
    if supervisor.trip is not None:
        task.tripped(supervisor.trip)
    elif supervised.intervention is not None:
        task.clamped(supervised.intervention)
    return supervised


def _note_irregular(timing: TrialTiming, late_ns: int, seen: tuple[int, int], news: tuple[int, int]) -> None:
    timing.worst_late_ns = max(timing.worst_late_ns, late_ns)
    timing.late_ticks += late_ns > LATE_NS
    timing.repeated_samples += news[0] == seen[0] or news[1] == seen[1]
