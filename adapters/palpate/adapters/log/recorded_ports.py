"""Decorators over the four ports that tell a flight recorder what passes. They change nothing."""

from __future__ import annotations

from palpate.adapters.log.recorder import FlightRecorder
from palpate.adapters.log.records import CallEntry
from palpate.core.errors import PalpateError
from palpate.core.ports.decorator import DeviceDecorator
from palpate.core.ports.devices import ArmCommand, Clock, ForceSensor, JointEncoder, Ports
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, JointVector, WrenchSample


class RecordedClock(Clock):
    """A clock whose every reading is recorded.

    Args:
        clock: The clock.
        recorder: Is told.
    """

    def __init__(self, clock: Clock, recorder: FlightRecorder) -> None:
        self._clock, self._recorder = clock, recorder

    def now_ns(self) -> int:
        """See :class:`Clock`."""
        now = self._clock.now_ns()
        self._recorder.read_clock(now)
        return now

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        self._clock.sleep_until(deadline_ns)
        self._recorder.slept(deadline_ns)


class RecordedDevice(DeviceDecorator):
    """A device whose faults and ends are recorded."""

    PORT = "device"

    def __init__(self, device: ForceSensor | JointEncoder | ArmCommand, recorder: FlightRecorder) -> None:
        super().__init__(device)
        self._recorder = recorder

    def acknowledge_fault(self) -> None:
        """See :class:`palpate.core.ports.devices.Device`."""
        cause = self.fault
        super().acknowledge_fault()
        self._tell("acknowledge_fault", text=cause or "")

    def _failed(self, call: str, error: PalpateError, asked_rad: JointVector | None = None) -> None:
        self._tell(call, error=type(error).__name__, text=str(error), asked_rad=asked_rad)

    def _tell(self, call: str, *, error: str = "", text: str = "", asked_rad: JointVector | None = None) -> None:
        if self._recorder.recording:
            tick = self._recorder.tick
            entry = CallEntry(tick=tick, port=self.PORT, call=call, asked_rad=asked_rad, error=error, text=text)
            self._recorder.call(entry)


class RecordedForceSensor(RecordedDevice, ForceSensor):
    """A force sensor whose every sample is recorded."""

    PORT = "force_sensor"

    def __init__(self, sensor: ForceSensor, recorder: FlightRecorder) -> None:
        super().__init__(sensor, recorder)
        self._sensor = sensor

    def read(self) -> WrenchSample:
        """See :class:`ForceSensor`."""
        try:
            sample = self._sensor.read()
        except PalpateError as error:
            self._failed("read", error)
            raise
        self._recorder.read_wrench(sample)
        return sample


class RecordedJointEncoder(RecordedDevice, JointEncoder):
    """Encoders whose every sample is recorded."""

    PORT = "joint_encoder"

    def __init__(self, encoder: JointEncoder, recorder: FlightRecorder) -> None:
        super().__init__(encoder, recorder)
        self._encoder = encoder

    def read(self) -> JointSample:
        """See :class:`JointEncoder`."""
        try:
            sample = self._encoder.read()
        except PalpateError as error:
            self._failed("read", error)
            raise
        self._recorder.read_joints(sample)
        return sample


class RecordedArm(RecordedDevice, ArmCommand):
    """An arm whose every command is recorded, as asked and as applied."""

    PORT = "arm"

    def __init__(self, arm: ArmCommand, recorder: FlightRecorder) -> None:
        super().__init__(arm, recorder)
        self._arm = arm

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`.

        Raises:
            DeviceError: Besides the arm's own: the recorder lost something, and the trial is to end for that.
        """
        try:
            applied = self._arm.send(command)
        except PalpateError as error:
            self._failed("send", error, command.position_rad)
            raise
        self._recorder.sent(command, applied)
        return applied

    def stop(self) -> None:
        """See :class:`ArmCommand`. The arm first, then the log."""
        try:
            self._arm.stop()
        except PalpateError as error:
            self._failed("stop", error)
            raise
        self._tell("stop")


def recorded(ports: Ports, recorder: FlightRecorder) -> Ports:
    """The four ports, decorated."""
    return Ports(
        RecordedClock(ports.clock, recorder),
        RecordedForceSensor(ports.force_sensor, recorder),
        RecordedJointEncoder(ports.joint_encoder, recorder),
        RecordedArm(ports.arm, recorder),
    )
