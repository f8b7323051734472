"""Ports under the flight recorder keep the contracts as they do without it, whether a log is open or not."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.log.reader import assemble, sound_messages
from palpate.adapters.log.recorded_ports import RecordedArm, RecordedClock, RecordedForceSensor, RecordedJointEncoder
from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.records import EndRecord
from palpate.adapters.log.writer_client import MemorySink, Opening
from palpate.core.ports.contracts import (
    ArmCommandContract,
    ArmCommandRig,
    ClockContract,
    ClockRig,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
)
from palpate.core.ports.devices import ArmCommand, Clock, ForceSensor, JointEncoder

# As modules: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake
from tests.contracts import test_mujoco as mujoco
from tests.unit.adapters.log.crafted import STARTING
from tests.unit.adapters.log.recording_bench import Task


class UnderRecorder:
    """Gives each clause a recorder; what it recorded must be a sound log."""

    OPEN = True

    @pytest.fixture(autouse=True)
    def recorder_and_log(self) -> Iterator[None]:
        sink = MemorySink()
        self.recorder = FlightRecorder(sink)
        if self.OPEN:
            self.recorder.begin(Opening(Path("x"), {}), Task(), lambda: STARTING)
        yield
        self.recorder.end(EndRecord(tick=0))
        assert self.recorder.troubles == []
        assert len(sink.logs) == self.OPEN
        for data in sink.logs:
            log = assemble("x", data, list(sound_messages("x", data)))
            list(log.records())


class TestRecordedFakeClock(UnderRecorder, ClockContract):
    def make(self) -> ClockRig:
        rig = fake.TestFakeClock().make()
        return replace(rig, clock=RecordedClock(rig.clock, self.recorder))


class TestRecordedFakeForceSensor(UnderRecorder, ForceSensorContract):
    def make(self) -> ForceSensorRig:
        rig = fake.TestFakeForceSensor().make()
        return replace(rig, device=RecordedForceSensor(rig.device, self.recorder))


class TestRecordedFakeJointEncoder(UnderRecorder, JointEncoderContract):
    def make(self) -> JointEncoderRig:
        rig = fake.TestFakeJointEncoder().make()
        assert rig.arm is not None
        device, arm = RecordedJointEncoder(rig.device, self.recorder), RecordedArm(rig.arm, self.recorder)
        return replace(rig, device=device, arm=arm)


class TestRecordedFakeArm(UnderRecorder, ArmCommandContract):
    def make(self) -> ArmCommandRig:
        rig = fake.TestFakeArm().make()
        return replace(rig, device=RecordedArm(rig.device, self.recorder))


class TestRecordedMujocoClock(UnderRecorder, ClockContract):
    def make(self) -> ClockRig:
        rig = mujoco.TestMujocoClock().make()
        return replace(rig, clock=RecordedClock(rig.clock, self.recorder))


class TestRecordedMujocoForceSensor(UnderRecorder, ForceSensorContract):
    def make(self) -> ForceSensorRig:
        rig = mujoco.TestMujocoForceSensor().make()
        return replace(rig, device=RecordedForceSensor(rig.device, self.recorder))


class TestRecordedMujocoJointEncoder(UnderRecorder, JointEncoderContract):
    def make(self) -> JointEncoderRig:
        rig = mujoco.TestMujocoJointEncoder().make()
        assert rig.arm is not None
        device, arm = RecordedJointEncoder(rig.device, self.recorder), RecordedArm(rig.arm, self.recorder)
        return replace(rig, device=device, arm=arm)


class TestRecordedMujocoArm(UnderRecorder, ArmCommandContract):
    def make(self) -> ArmCommandRig:
        rig = mujoco.TestMujocoArm().make()
        return replace(rig, device=RecordedArm(rig.device, self.recorder))


class TestIdleFakeClock(TestRecordedFakeClock):
    OPEN = False


class TestIdleFakeForceSensor(TestRecordedFakeForceSensor):
    OPEN = False


class TestIdleFakeJointEncoder(TestRecordedFakeJointEncoder):
    OPEN = False


class TestIdleFakeArm(TestRecordedFakeArm):
    OPEN = False


class TestIdleMujocoClock(TestRecordedMujocoClock):
    OPEN = False


class TestIdleMujocoForceSensor(TestRecordedMujocoForceSensor):
    OPEN = False


class TestIdleMujocoJointEncoder(TestRecordedMujocoJointEncoder):
    OPEN = False


class TestIdleMujocoArm(TestRecordedMujocoArm):
    OPEN = False


def test_decorated_ports_are_their_ports() -> None:
    recorder, bench = FlightRecorder(MemorySink()), mujoco.Bench.fresh()
    assert isinstance(RecordedClock(bench.clock, recorder), Clock)
    assert isinstance(RecordedArm(bench.arm(), recorder), ArmCommand)
    assert isinstance(RecordedForceSensor(fake.TestFakeForceSensor().make().device, recorder), ForceSensor)
    assert isinstance(RecordedJointEncoder(fake.TestFakeJointEncoder().make().device, recorder), JointEncoder)
