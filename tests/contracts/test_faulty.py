"""Without a fault, decorated ports keep the contracts; with one, each kind breaks a clause or shows in what is read."""

from dataclasses import replace
from typing import Any

import pytest

from palpate.adapters.fault_injection import (
    KINDS,
    FaultPlan,
    FaultyArm,
    FaultyClock,
    FaultyForceSensor,
    FaultyJointEncoder,
)
from palpate.core.ports.contracts import (
    ArmCommandContract,
    ArmCommandRig,
    ClauseOutcome,
    ClockContract,
    ClockRig,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
    run_clauses,
)

# As modules: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake

LATER = 10**6
"""No clause goes on for so many ticks: a fault that has not come yet changes nothing, whatever goes past it."""


class TestFaultyFakeClock(ClockContract):
    plans: tuple[FaultPlan, ...] = (
        FaultPlan("clock-jump", "clock", LATER, time_s=1.0),
        FaultPlan("overrun", "clock", LATER, time_s=1.0),
    )

    def make(self) -> ClockRig:
        rig = fake.TestFakeClock().make()
        return replace(rig, clock=FaultyClock(rig.clock, self.plans))


class TestFaultyFakeForceSensor(ForceSensorContract):
    plans: tuple[FaultPlan, ...] = (
        FaultPlan("repeat", "force_sensor", LATER),
        FaultPlan("freeze", "force_sensor", LATER),
    )

    def make(self) -> ForceSensorRig:
        rig = fake.TestFakeForceSensor().make()
        return replace(rig, device=FaultyForceSensor(rig.device, rig.clock, self.plans))


class TestFaultyFakeJointEncoder(JointEncoderContract):
    plans: tuple[FaultPlan, ...] = (
        FaultPlan("drop", "joint_encoder", LATER),
        FaultPlan("delay", "joint_encoder", LATER),
    )

    def make(self) -> JointEncoderRig:
        rig = fake.TestFakeJointEncoder().make()
        assert rig.arm is not None
        arm = FaultyArm(rig.arm, rig.clock, [])
        return replace(rig, device=FaultyJointEncoder(rig.device, rig.clock, self.plans), arm=arm)


class TestFaultyFakeArm(ArmCommandContract):
    plans: tuple[FaultPlan, ...] = (FaultPlan("delay", "arm", LATER), FaultPlan("stuck", "arm", LATER))

    def make(self) -> ArmCommandRig:
        rig = fake.TestFakeArm().make()
        return replace(rig, device=FaultyArm(rig.device, rig.clock, self.plans))


SETTINGS: dict[str, dict[str, Any]] = {
    "bias-drift": {"magnitude": 50.0},
    "spike": {"magnitude": 50.0},
    "noise": {"magnitude": 50.0},
    "offset": {"magnitude": 50.0},
    "swap": {"channels": (0, 2)},
    "lag": {"time_s": 0.5},
    "saturate": {"magnitude": 50.0},
    "unit": {"factor": 1000.0},
    "clock-jump": {"time_s": 0.5},
    "overrun": {"time_s": 0.01},
}
SUITES: dict[str, Any] = {
    "force_sensor": TestFaultyFakeForceSensor,
    "joint_encoder": TestFaultyFakeJointEncoder,
    "arm": TestFaultyFakeArm,
    "clock": TestFaultyFakeClock,
}
# The clause by which a suite that knows nothing of faults finds it; None for the liars that no clause finds, which
# tests/unit/adapters/faults shows tick by tick.
BROKEN = {
    ("drop", "force_sensor"): "test_every_sample_is_sound",
    ("drop", "joint_encoder"): "test_every_sample_is_sound",
    ("drop", "arm"): "test_each_command_counts",
    ("delay", "force_sensor"): "test_pressing_on_the_tip_gives_negative_fz",
    ("delay", "joint_encoder"): "test_every_sample_is_sound",
    ("delay", "arm"): "test_each_command_counts",
    ("duplicate", "force_sensor"): "test_every_sample_is_sound",
    ("duplicate", "joint_encoder"): "test_every_sample_is_sound",
    ("freeze", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("freeze", "joint_encoder"): None,
    ("repeat", "force_sensor"): "test_every_sample_is_sound",
    ("repeat", "joint_encoder"): "test_every_sample_is_sound",
    ("bias-drift", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("bias-drift", "joint_encoder"): None,
    ("spike", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("spike", "joint_encoder"): "test_every_sample_is_sound",
    ("noise", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("noise", "joint_encoder"): "test_every_sample_is_sound",
    ("offset", "force_sensor"): None,
    ("offset", "joint_encoder"): "test_every_sample_is_sound",
    ("swap", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("swap", "joint_encoder"): None,
    ("lag", "force_sensor"): "test_every_sample_is_sound",
    ("lag", "joint_encoder"): "test_every_sample_is_sound",
    ("nan", "force_sensor"): "test_every_sample_is_sound",
    ("nan", "joint_encoder"): "test_every_sample_is_sound",
    ("nan", "arm"): "test_each_command_counts",
    ("saturate", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("unit", "force_sensor"): "test_load_is_reported_in_newtons_on_its_axis",
    ("unit", "joint_encoder"): "test_every_sample_is_sound",
    ("unit", "arm"): "test_each_command_counts",
    ("disconnect", "force_sensor"): "test_every_sample_is_sound",
    ("disconnect", "joint_encoder"): "test_every_sample_is_sound",
    ("disconnect", "arm"): "test_each_command_counts",
    ("stuck", "arm"): "test_each_command_counts",
    ("clock-jump", "clock"): "test_absolute_deadlines_do_not_drift",
    ("overrun", "clock"): "test_absolute_deadlines_do_not_drift",
}


def test_every_kind_on_every_port_is_in_the_table() -> None:
    assert BROKEN.keys() == {(kind, port) for kind, known in KINDS.items() for port in known.ports}


@pytest.mark.parametrize(("kind", "port"), [case for case, clause in BROKEN.items() if clause is not None])
def test_each_kind_breaks_a_clause(kind: str, port: str) -> None:
    suite = SUITES[port]()
    # What needs a past begins once there is one.
    first = 0 if port == "arm" else {"drop": 1, "freeze": 1, "repeat": 10}.get(kind, 0)
    suite.plans = (FaultPlan(kind, port, first, **SETTINGS.get(kind, {})),)
    failed = {r.clause.name for r in run_clauses(suite) if r.outcome is ClauseOutcome.FAILED}
    assert BROKEN[kind, port] in failed
    # Whatever the fault: what is opened is closed, and the arm can be stopped.
    kept = ("test_constructor", "test_failed", "test_close", "test_stop_works")
    assert not [name for name in failed if name.startswith(kept)]
