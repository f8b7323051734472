"""An arm that answers with nonsense in mid-trial: the supervisor leads it back and latches."""

from dataclasses import replace
from math import nan

import pytest

from palpate.adapters.config import RunConfig
from palpate.adapters.experiments import build_perception, build_task, comparator, run_scored_trial, supervisor_of
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import FaultLatchedError
from palpate.core.ports import AppliedCommand, ArmCommand, CommandReason, DeviceDecorator, JointCommand, JointVector
from palpate.core.trial import Outcome, TripReason
from tests.unit.adapters.samples import ready_pose


class Odd(DeviceDecorator, ArmCommand):
    """From its 60th command on it answers with these angles, once."""

    def __init__(self, arm: ArmCommand, answer: JointVector) -> None:
        super().__init__(arm)
        self.arm, self.answer, self.sent = arm, answer, 0

    def send(self, command: JointCommand) -> AppliedCommand:
        self.sent += 1
        applied = self.arm.send(command)
        return AppliedCommand(self.answer, CommandReason.VELOCITY_LIMIT) if self.sent == 60 else applied

    def stop(self) -> None:
        self.arm.stop()


@pytest.mark.parametrize("answer", [(nan,) * 6, (0.1,) * 5, ()])
def test_an_arm_that_answers_with_nonsense_is_led_back_and_latched(answer: JointVector) -> None:
    config, ready = RunConfig(), ready_pose()
    with SimulatedRig(config, ready) as rig:
        arm = Odd(rig.ports.arm, answer)
        rig.ports = replace(rig.ports, arm=arm)
        task = build_task(config, ready, build_perception(config), comparator("torque", config, tuple))
        supervisor = supervisor_of(rig, config, ready)
        report = run_scored_trial(config, rig, task, 0, supervisor=supervisor).report
        assert (report.outcome, supervisor.trip and supervisor.trip.reason) == (
            Outcome.SENSOR_FAULT, TripReason.COMMAND_NOT_FINITE,
        )  # fmt: skip
        # 15 mm back at 20 mm/s.
        assert arm.sent > 60 + 100
        with pytest.raises(FaultLatchedError):
            run_scored_trial(config, rig, task, 1, supervisor=supervisor_of(rig, config, ready))
