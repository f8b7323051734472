"""The replay ports keep the contracts: each clause is first tried on a recorded fake, then again on the recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.log.reader import TrialLog, assemble, sound_messages
from palpate.adapters.log.recorded_ports import RecordedArm, RecordedClock, RecordedForceSensor, RecordedJointEncoder
from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.records import EndRecord, StartRecord
from palpate.adapters.log.writer_client import MemorySink, Opening
from palpate.adapters.replay.tape import ReplayArm, ReplayClock, ReplayForceSensor, ReplayJointEncoder, Tape
from palpate.core.insertion.trial import TrialReport, TrialSetup
from palpate.core.ports.contracts import (
    ArmCommandContract,
    ClauseNotApplicable,
    ClockContract,
    ForceSensorContract,
    JointEncoderContract,
    clauses,
)
from palpate.core.ports.contracts.rigs import ArmCommandRig, ClockRig, ForceSensorRig, JointEncoderRig
from palpate.core.ports.devices import ArmCommand, Clock, ForceSensor, JointEncoder
from palpate.core.ports.values import JointVector
from tests.contracts.test_fake import TestFakeArm as FakeArmSuite
from tests.contracts.test_fake import TestFakeClock as FakeClockSuite
from tests.contracts.test_fake import TestFakeForceSensor as FakeForceSensorSuite
from tests.contracts.test_fake import TestFakeJointEncoder as FakeJointEncoderSuite

START = StartRecord(
    schema="palpate.log/1", command="contract", config_toml="", arm="", model_sha256="", core_sha256="", seed=0,
    trial=0, start_m=(0.0, 0.0), ready_rad=(0.0,), tip_rotation=(1.0,) * 9, perception_json="", policy="",
)  # fmt: skip

Knob = Callable[[], JointVector]


class Nobody:
    """No task runs while a clause is tried."""

    report = TrialReport(TrialSetup(0, 0, (0.0, 0.0)))


class Recording:
    """What was recorded in one rig: the ports, and what the test saw of the world besides."""

    def __init__(self) -> None:
        self._sink = MemorySink()
        self.recorder = FlightRecorder(self._sink)
        self.recorder.begin(Opening(Path("contract.mcap"), {}), Nobody(), lambda: START)
        self.seen: list[JointVector] = []

    def watched(self, knob: Knob) -> Knob:
        def look() -> JointVector:
            self.seen.append(knob())
            return self.seen[-1]

        return look

    def log(self) -> TrialLog:
        self.recorder.end(EndRecord(tick=0))
        data = self._sink.logs[0]
        return assemble("contract.mcap", data, list(sound_messages("contract.mcap", data)))


def recorded_rig(rig: Any, recording: Recording) -> Any:
    """The rig with its ports decorated."""
    recorder = recording.recorder
    if isinstance(rig, ClockRig):
        return replace(rig, clock=RecordedClock(rig.clock, recorder))
    changes: dict[str, Any] = {"clock": RecordedClock(rig.clock, recorder)}
    if isinstance(rig, ForceSensorRig):
        changes["device"] = RecordedForceSensor(rig.device, recorder)
    elif isinstance(rig, JointEncoderRig):
        changes["device"] = RecordedJointEncoder(rig.device, recorder)
        if rig.arm is not None:
            changes["arm"] = RecordedArm(rig.arm, recorder)
    elif isinstance(rig, ArmCommandRig):
        changes["device"] = RecordedArm(rig.device, recorder)
        if rig.position_rad is not None:
            changes["position_rad"] = recording.watched(rig.position_rad)
    return replace(rig, **changes)


def replayed_rig(rig: Any, recording: Recording) -> Any:
    """The same rig over the recording; what a test does to the world has been done already."""
    tape = Tape(recording.log())
    if isinstance(rig, ClockRig):
        return replace(rig, clock=ReplayClock(tape))
    changes: dict[str, Any] = {"clock": ReplayClock(tape), "advance": lambda _: None, "is_open": None}
    device: Any
    if isinstance(rig, ForceSensorRig):
        device = ReplayForceSensor(tape)
        changes["push_N"] = lambda *_: None
    elif isinstance(rig, JointEncoderRig):
        device = ReplayJointEncoder(tape)
        if rig.arm is not None:
            changes["arm"] = ReplayArm(tape)
    else:
        device = ReplayArm(tape)
        changes["position_rad"] = partial(next, iter(recording.seen))
    for name in ("go_silent", "disconnect"):
        if hasattr(rig, name):
            changes[name] = lambda: None
    changes["provoke_fault"] = partial(device._latch, "fault on demand")
    return replace(rig, device=device, **changes)


SUITES = {
    ClockContract: FakeClockSuite,
    ForceSensorContract: FakeForceSensorSuite,
    JointEncoderContract: FakeJointEncoderSuite,
    ArmCommandContract: FakeArmSuite,
}


@pytest.mark.parametrize(
    ("contract", "clause"),
    [(contract, clause.name) for contract in SUITES for clause in clauses(contract)],
    ids=lambda value: value if isinstance(value, str) else value.__name__,
)
def test_clause_holds_on_its_own_recording(contract: Any, clause: str) -> None:
    made: list[tuple[Any, Recording]] = []

    class OnRecorded(SUITES[contract]):  # type: ignore[misc]
        def make(self) -> Any:
            rig, recording = super().make(), Recording()
            made.append((rig, recording))
            return recorded_rig(rig, recording)

    class OnRecording(contract):  # type: ignore[misc]
        def make(self) -> Any:
            return replayed_rig(*made.pop(0))

    try:
        getattr(OnRecorded(), clause)()
        getattr(OnRecording(), clause)()
    except ClauseNotApplicable as reason:
        pytest.skip(f"a recording holds nothing open: {reason}")
    assert made == []


def test_the_replay_ports_are_their_ports() -> None:
    tape = Tape(Recording().log())
    assert isinstance(ReplayClock(tape), Clock)
    assert isinstance(ReplayArm(tape), ArmCommand)
    assert isinstance(ReplayForceSensor(tape), ForceSensor)
    assert isinstance(ReplayJointEncoder(tape), JointEncoder)
