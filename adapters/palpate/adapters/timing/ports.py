"""Decorators over the four ports that tell a stopwatch which section runs. They change nothing."""

from __future__ import annotations

from palpate.adapters.decorator import DeviceDecorator
from palpate.adapters.timing.sections import Section
from palpate.adapters.timing.stopwatch import Stopwatch
from palpate.core.cycle import Ports
from palpate.core.ports import ArmCommand, Clock, ForceSensor, JointEncoder
from palpate.core.values import AppliedCommand, JointCommand, JointSample, WrenchSample

# As plain numbers: members of an enumeration are looked up slowly.
_CLOCK, _FORCE, _JOINTS, _SEND, _RECORD = (
    int(section) for section in (Section.CLOCK, Section.FORCE, Section.JOINTS, Section.SEND, Section.RECORD)
)


class TimedClock(Clock):
    """Knows from the loop's sleeping where ticks begin and end, and how late they are.

    Args:
        clock: The clock.
        stopwatch: Is told.
    """

    def __init__(self, clock: Clock, stopwatch: Stopwatch) -> None:
        self._clock, self._stopwatch = clock, stopwatch
        self._deadline_ns: int | None = None

    def now_ns(self) -> int:
        """See :class:`Clock`.

        Raises:
            DeviceError: The tick that begins is later than the stopwatch's limits allow.
        """
        stopwatch = self._stopwatch
        before = stopwatch.mark(_CLOCK)
        try:
            now = self._clock.now_ns()
            deadline, self._deadline_ns = self._deadline_ns, None
            if deadline is not None:
                stopwatch.begun(deadline, now)
            elif not stopwatch.in_tick:
                # Asked outside of any tick: a loop takes the time from which its slots are counted.
                stopwatch.schedule_begins()
            return now
        finally:
            stopwatch.mark(before)

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        self._stopwatch.tick_ends()
        self._clock.sleep_until(deadline_ns)
        self._deadline_ns = deadline_ns
        self._stopwatch.tick_begins()


class TimedForceSensor(DeviceDecorator, ForceSensor):
    """Charges readings to a section.

    Args:
        sensor: The sensor.
        stopwatch: Is told.
        section: Is charged.
    """

    def __init__(self, sensor: ForceSensor, stopwatch: Stopwatch, section: int = _FORCE) -> None:
        super().__init__(sensor)
        self._read, self._mark, self._section = sensor.read, stopwatch.mark, section

    def read(self) -> WrenchSample:
        """See :class:`ForceSensor`."""
        before = self._mark(self._section)
        try:
            return self._read()
        finally:
            self._mark(before)


class TimedJointEncoder(DeviceDecorator, JointEncoder):
    """Charges readings to a section.

    Args:
        encoder: The encoder.
        stopwatch: Is told.
        section: Is charged.
    """

    def __init__(self, encoder: JointEncoder, stopwatch: Stopwatch, section: int = _JOINTS) -> None:
        super().__init__(encoder)
        self._read, self._mark, self._section = encoder.read, stopwatch.mark, section

    def read(self) -> JointSample:
        """See :class:`JointEncoder`."""
        before = self._mark(self._section)
        try:
            return self._read()
        finally:
            self._mark(before)


class TimedArm(DeviceDecorator, ArmCommand):
    """Charges commands to a section; a stop ends the tick that is under way.

    Args:
        arm: The arm.
        stopwatch: Is told.
        section: Is charged.
    """

    def __init__(self, arm: ArmCommand, stopwatch: Stopwatch, section: int = _SEND) -> None:
        super().__init__(arm)
        self._arm, self._stopwatch = arm, stopwatch
        self._send, self._mark, self._section = arm.send, stopwatch.mark, section

    def send(self, command: JointCommand) -> AppliedCommand:
        """See :class:`ArmCommand`."""
        before = self._mark(self._section)
        try:
            return self._send(command)
        finally:
            self._mark(before)

    def stop(self) -> None:
        """See :class:`ArmCommand`."""
        try:
            self._arm.stop()
        finally:
            if self._stopwatch.in_tick:
                self._stopwatch.tick_ends()


class RecordingClock(Clock):
    """Charges what a recorder's clock adds to the section of recording.

    Args:
        clock: The recorder's clock, over a timed one.
        stopwatch: Is told.
    """

    def __init__(self, clock: Clock, stopwatch: Stopwatch) -> None:
        self._clock, self._mark = clock, stopwatch.mark

    def now_ns(self) -> int:
        """See :class:`Clock`."""
        before = self._mark(_RECORD)
        try:
            return self._clock.now_ns()
        finally:
            self._mark(before)

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        before = self._mark(_RECORD)
        try:
            self._clock.sleep_until(deadline_ns)
        finally:
            self._mark(before)


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
