"""The loop over the ports, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.core.insertion import InsertionTask
from palpate.core.ports import ArmCommand, Clock, ForceSensor, JointEncoder
from palpate.core.task_config import CONTROL_RATE_HZ
from palpate.core.trial import TrialReport, TrialSetup
from palpate.core.values import AppliedCommand, Snapshot

_NS: int = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Ports:
    """The four ports that a run uses; simulator, hardware or recorded trial, the core cannot tell."""

    clock: Clock
    force_sensor: ForceSensor
    joint_encoder: JointEncoder
    arm: ArmCommand


def tick_time_ns(start_ns: int, tick: int) -> int:
    """Time of a control tick: counted from the start, so that rounding never adds up."""
    return start_ns + tick * _NS // CONTROL_RATE_HZ


def run_trial(task: InsertionTask, ports: Ports, setup: TrialSetup) -> TrialReport:
    """Run one trial from wherever the arm is.

    The first tick is at the clock's present time. Every way out leaves the arm stopped.
    """
    clock, sensor, encoder, arm = ports.clock, ports.force_sensor, ports.joint_encoder, ports.arm
    applied: AppliedCommand | None = None
    tick = 0
    try:
        task.begin(setup)
        start_ns = clock.now_ns()
        while not task.done:
            clock.sleep_until(tick_time_ns(start_ns, tick))
            snapshot = Snapshot(tick, clock.now_ns(), sensor.read(), encoder.read(), applied)
            applied = arm.send(task.step(snapshot))
            tick += 1
    finally:
        arm.stop()
    return task.report
