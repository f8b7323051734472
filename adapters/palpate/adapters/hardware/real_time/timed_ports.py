"""Decorators over the four ports that tell a stopwatch which section runs. They change nothing."""

from __future__ import annotations

from palpate.adapters.hardware.real_time.sections import TickSection
from palpate.adapters.hardware.real_time.stopwatch import Stopwatch
from palpate.core.ports.decorator import DeviceDecorator
from palpate.core.ports.devices import ArmCommand, Clock, ForceSensor, JointEncoder, Ports
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, WrenchSample

# As plain numbers: members of an enumeration are looked up slowly.
_CLOCK, _FORCE, _JOINTS, _SEND, _RECORD = (
    int(section)
    for section in (TickSection.CLOCK, TickSection.FORCE, TickSection.JOINTS, TickSection.SEND, TickSection.RECORD)
)


class TimedClock(Clock):
    """Knows from the loop's sleeping where ticks begin and end, and how late they are.

    Args:
        clock: The clock.
        stopwatch: Is told.
    """

    def __init__(self, clock: Clock, stopwatch: Stopwatch) -> None:
        self._clock, self._stopwatch = clock, stopwatch
        self._now, self._spent = stopwatch.now_ns, stopwatch.spent
        self._deadline_ns: int | None = None

    def now_ns(self) -> int:
        """See :class:`Clock`.

        Raises:
            DeviceError: The tick that begins is later than the stopwatch's limits allow.
        """
        begin = self._now()
        time_ns = self._clock.now_ns()
        self._spent[_CLOCK] += self._now() - begin
        deadline = self._deadline_ns
        if deadline is not None:
            self._deadline_ns = None
            self._stopwatch.begun(deadline, time_ns)
        elif not self._stopwatch.in_tick:
            # Asked outside of any tick: a loop takes the time from which its slots are counted.
            self._stopwatch.schedule_begins()
        return time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        self._stopwatch.tick_ends()
        self._clock.sleep_until(deadline_ns)
        self._deadline_ns = deadline_ns
        self._stopwatch.tick_begins()


class TimedForceSensor(DeviceDecorator, ForceSensor):
    """Charges readings to a section. One that fails is not charged: it ends the trial.

    Args:
        sensor: The sensor.
        stopwatch: Is told.
        section: Is charged.
    """

    def __init__(self, sensor: ForceSensor, stopwatch: Stopwatch, section: int = _FORCE) -> None:
        super().__init__(sensor)
        self._read, self._now, self._spent, self._section = sensor.read, stopwatch.now_ns, stopwatch.spent, section

    def read(self) -> WrenchSample:
        """See :class:`ForceSensor`."""
        begin = self._now()
        sample = self._read()
        self._spent[self._section] += self._now() - begin
        return sample


class TimedJointEncoder(DeviceDecorator, JointEncoder):
    """Charges readings to a section. One that fails is not charged: it ends the trial.

    Args:
        encoder: The encoder.
        stopwatch: Is told.
        section: Is charged.
    """

    def __init__(self, encoder: JointEncoder, stopwatch: Stopwatch, section: int = _JOINTS) -> None:
        super().__init__(encoder)
        self._read, self._now, self._spent, self._section = encoder.read, stopwatch.now_ns, stopwatch.spent, section

    def read(self) -> JointSample:
        """See :class:`JointEncoder`."""
        begin = self._now()
        sample = self._read()
        self._spent[self._section] += self._now() - begin
        return sample


class TimedArm(DeviceDecorator, ArmCommand):
    """Charges commands to a section; a stop ends the tick that is under way, and is no part of it.

    Args:
        arm: The arm.
        stopwatch: Is told.
        section: Is charged.
    """

    def __init__(self, arm: ArmCommand, stopwatch: Stopwatch, section: int = _SEND) -> None:
        super().__init__(arm)
        self._arm, self._stopwatch = arm, stopwatch
        self._send, self._now, self._spent, self._section = arm.send, stopwatch.now_ns, stopwatch.spent, section

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`."""
        begin = self._now()
        applied = self._send(command)
        self._spent[self._section] += self._now() - begin
        return applied

    def stop(self) -> None:
        """See :class:`ArmCommand`."""
        # First of all the arm; bringing a real one to rest takes a while.
        begin = self._now()
        try:
            self._arm.stop()
        finally:
            if self._stopwatch.in_tick:
                self._stopwatch.tick_ends(begin)


class RecordingClock(Clock):
    """Charges what a recorder's clock adds to the section of recording.

    Args:
        clock: The recorder's clock, over a timed one.
        stopwatch: Is told.
    """

    def __init__(self, clock: Clock, stopwatch: Stopwatch) -> None:
        self._clock, self._stopwatch = clock, stopwatch
        self._now, self._spent = stopwatch.now_ns, stopwatch.spent

    def now_ns(self) -> int:
        """See :class:`Clock`."""
        begin = self._now()
        time_ns = self._clock.now_ns()
        self._spent[_RECORD] += self._now() - begin
        return time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        self._clock.sleep_until(deadline_ns)
        self._stopwatch.recorder_woke()


def timed(ports: Ports, stopwatch: Stopwatch) -> Ports:
    """The ports, timed."""
    return Ports(
        TimedClock(ports.clock, stopwatch),
        TimedForceSensor(ports.force_sensor, stopwatch),
        TimedJointEncoder(ports.joint_encoder, stopwatch),
        TimedArm(ports.arm, stopwatch),
    )


def timed_recording(ports: Ports, stopwatch: Stopwatch) -> Ports:
    """Ports that a recorder put over timed ones: what it adds to each call is charged to recording."""
    return Ports(
        RecordingClock(ports.clock, stopwatch),
        TimedForceSensor(ports.force_sensor, stopwatch, _RECORD),
        TimedJointEncoder(ports.joint_encoder, stopwatch, _RECORD),
        TimedArm(ports.arm, stopwatch, _RECORD),
    )
