"""The replay ports keep the contracts: each clause is first tried on a recorded fake, then again on the recording."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

import pytest

from palpate.adapters.log import CallEntry, TickRecord, TrialLog, assemble, sound_messages
from palpate.adapters.log.messages import encode_record
from palpate.adapters.log.reader import RawMessage
from palpate.adapters.log.schema import CALL, START, TICK
from palpate.adapters.replay.ports import ReplayArm, ReplayClock, ReplayForceSensor, ReplayJointEncoder
from palpate.adapters.replay.tape import Tape
from palpate.core.errors import PalpateError
from palpate.core.ports import Clock, DeviceDecorator, JointCommand, JointVector
from palpate.core.ports.contracts import (
    ArmCommandContract,
    ClauseNotApplicable,
    ClockContract,
    ForceSensorContract,
    JointEncoderContract,
    clauses,
)
from palpate.core.ports.contracts.rigs import ArmCommandRig, ClockRig, ForceSensorRig, JointEncoderRig
from tests.contracts.test_fake import TestFakeArm as FakeArmSuite
from tests.contracts.test_fake import TestFakeClock as FakeClockSuite
from tests.contracts.test_fake import TestFakeForceSensor as FakeForceSensorSuite
from tests.contracts.test_fake import TestFakeJointEncoder as FakeJointEncoderSuite
from tests.unit.adapters.log.crafted import STARTING, log_bytes

Knob = Callable[[], JointVector]
T = TypeVar("T")


class Recording:
    """What was recorded in one rig: every port call on its own, and what the test saw of the world besides."""

    def __init__(self) -> None:
        self._ticks: list[TickRecord] = []
        self._calls: list[CallEntry] = []
        self.seen: list[JointVector] = []

    def slept(self, deadline_ns: int) -> None:
        self._ticks.append(TickRecord(len(self._ticks), deadline_ns=deadline_ns))

    def called(self, port: str, call: str, **what: Any) -> None:
        self._calls.append(CallEntry(tick=len(self._ticks) - 1, port=port, call=call, **what))

    def watched(self, knob: Knob) -> Knob:
        def look() -> JointVector:
            self.seen.append(knob())
            return self.seen[-1]

        return look

    def log(self) -> TrialLog:
        content = [RawMessage(START.id, 0, encode_record("Start", STARTING))]
        content += [RawMessage(TICK.id, 0, encode_record("Tick", tick)) for tick in self._ticks]
        content += [RawMessage(CALL.id, 0, encode_record("Call", call)) for call in self._calls]
        data = log_bytes(content)
        return assemble("contract.mcap", data, list(sound_messages("contract.mcap", data)))


class RecordedClock(Clock):
    def __init__(self, clock: Clock, recording: Recording) -> None:
        self._clock, self._recording = clock, recording

    def now_ns(self) -> int:
        now = self._clock.now_ns()
        self._recording.called("clock", "now_ns", time_ns=now)
        return now

    def sleep_until(self, deadline_ns: int) -> None:
        self._clock.sleep_until(deadline_ns)
        self._recording.slept(deadline_ns)


class RecordedDevice(DeviceDecorator):
    """Whichever of the three devices it decorates."""

    def __init__(self, device: Any, port: str, sample: str, recording: Recording) -> None:
        super().__init__(device)
        self._inner, self._port, self._sample, self._recording = device, port, sample, recording

    def _kept(self, call: str, result: str, do: Callable[[], T], **asked: Any) -> T:
        try:
            done = do()
        except PalpateError as error:
            self._recording.called(self._port, call, error=type(error).__name__, text=str(error), **asked)
            raise
        self._recording.called(self._port, call, **{result: done}, **asked)
        return done

    def read(self) -> Any:
        return self._kept("read", self._sample, self._inner.read)

    def send(self, command: JointCommand) -> Any:
        return self._kept("send", "applied", lambda: self._inner.send(command), asked_rad=command.position_rad)

    def stop(self) -> None:
        self._inner.stop()


def recorded_rig(rig: Any, recording: Recording) -> Any:
    """The rig with its ports decorated."""
    changes: dict[str, Any] = {"clock": RecordedClock(rig.clock, recording)}
    if isinstance(rig, ForceSensorRig):
        changes["device"] = RecordedDevice(rig.device, "force_sensor", "wrench", recording)
    elif isinstance(rig, JointEncoderRig):
        changes["device"] = RecordedDevice(rig.device, "joint_encoder", "joints", recording)
        if rig.arm is not None:
            changes["arm"] = RecordedDevice(rig.arm, "arm", "", recording)
    elif isinstance(rig, ArmCommandRig):
        changes["device"] = RecordedDevice(rig.device, "arm", "", recording)
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
