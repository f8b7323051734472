"""A simulated trial over faulty ports: it ends as it should, and the arm is at rest."""

from dataclasses import replace

import pytest

from palpate.adapters.experiments import build_perception, build_task, comparator
from palpate.adapters.fault_injection import FaultDelivery, FaultPlan, faulty
from palpate.adapters.hardware.watchdogs import WatchedArm, WatchedForceSensor
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.errors import CommandError, DeviceError
from palpate.core.ports.values import CommandReason, JointCommand
from palpate.core.trial.report import Outcome, TrialReport, TrialSetup
from tests.unit.adapters.samples import QUICK, ready_pose

TICK_NS = 1_000_000_000 // 140


def trial(*plans: FaultPlan, watched: bool = False) -> tuple[TrialReport, list[FaultDelivery]]:
    delivered: list[FaultDelivery] = []
    task = build_task(QUICK, ready_pose(), build_perception(QUICK), comparator("torque", QUICK, lambda: (0.0, 0.0)))
    with SimulatedRig(QUICK, ready_pose()) as rig:
        rig.prepare(0)
        ports = faulty(rig.ports, plans, delivered.append)
        if watched:
            sensor = WatchedForceSensor(ports.force_sensor, rig.ports.clock, 5 * TICK_NS, dead_after_ns=50 * TICK_NS)
            ports = replace(ports, force_sensor=sensor, arm=WatchedArm(ports.arm, rig.ports.clock, 5 * TICK_NS))
        try:
            run_trial(task, ports, TrialSetup(0, 0, (0.001, 0.0)))
        finally:
            here = rig.ports.joint_encoder.read().position_rad
            assert rig.ports.arm.send(JointCommand(here)).reason is CommandReason.STOPPED
            if watched:
                ports.arm.close()
    return task.report, delivered


def test_without_a_fault_the_trial_is_the_same_to_the_bit() -> None:
    assert trial() == trial(watched=True)
    assert trial()[0] == trial(FaultPlan("freeze", "force_sensor", 10**6), FaultPlan("delay", "arm", 10**6))[0]


@pytest.mark.parametrize(
    ("plan", "outcome"),
    [
        (FaultPlan("drop", "force_sensor", 60), Outcome.SENSOR_FAULT),
        (FaultPlan("nan", "joint_encoder", 60), Outcome.SENSOR_FAULT),
        (FaultPlan("saturate", "force_sensor", 60, magnitude=400.0), Outcome.SENSOR_FAULT),
        (FaultPlan("unit", "force_sensor", 60, factor=1000.0), Outcome.FORCE_LIMIT),
    ],
)
def test_a_fault_ends_the_trial(plan: FaultPlan, outcome: Outcome) -> None:
    report, delivered = trial(plan)
    assert report.outcome is outcome
    assert (delivered[0].tick, delivered[0].kind) == (60, plan.kind)
    assert 60 <= report.ticks <= 70


@pytest.mark.parametrize(
    ("plan", "error"),
    [
        (FaultPlan("disconnect", "arm", 60), DeviceError),
        (FaultPlan("disconnect", "force_sensor", 60), DeviceError),
        (FaultPlan("nan", "arm", 60), CommandError),
    ],
)
def test_a_fault_raises_and_the_arm_is_at_rest(plan: FaultPlan, error: type[Exception]) -> None:
    with pytest.raises(error):
        trial(plan)


def test_the_watchdog_finds_a_tick_that_took_too_long() -> None:
    report, _ = trial(FaultPlan("overrun", "clock", 60, duration_ticks=1, time_s=0.2), watched=True)
    assert report.outcome is Outcome.STOPPED
    assert 60 <= report.ticks <= 63


def test_a_repeated_stretch_is_found_by_the_watchdog_only() -> None:
    again = FaultPlan("repeat", "force_sensor", 60, span_ticks=3)
    report, _ = trial(again, watched=True)
    assert report.outcome is Outcome.SENSOR_FAULT
    assert report.ticks < trial(again)[0].ticks
