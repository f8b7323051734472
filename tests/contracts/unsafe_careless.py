"""What an engineer in a hurry does: a good fake but for one thing that seemed right when it was written.

The suites had let all of these through.
"""

from dataclasses import replace
from typing import Any

from palpate.core.ports import JointCommand, Validity
from palpate.core.ports.contracts.fakes import TICK_NS, FakeClock
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder


class FifoAfterAPause(FakeForceSensor):
    """Takes one record a reading from a queue that fills while nobody reads, and stamps it as it takes it."""

    was: Any = None
    asked_ns = behind = 0

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        if now_ns - self.asked_ns > 10 * TICK_NS and self.asked_ns:
            self.behind = (now_ns - self.asked_ns) // TICK_NS
        self.asked_ns, self.behind = now_ns, self.behind - (self.behind > 0)
        if self.behind and self.was:
            return replace(sample, force_N=self.was.force_N, torque_Nm=self.was.torque_Nm)
        self.was = sample
        return sample


class Crosstalk(FakeForceSensor):
    """The lower part of the calibration matrix is left out: a force shows as 5 mN m/N of torque."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        (fx, _, _), (tx, ty, tz) = sample.force_N, sample.torque_Nm
        return replace(sample, torque_Nm=(tx, ty + 5e-3 * fx, tz))


class Deadband(FakeForceSensor):
    """Less than 0.05 N is noise, and not shown."""

    shown = (0.0, 0.0, 0.0)

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        if max(abs(a - b) for a, b in zip(sample.force_N, self.shown, strict=True)) > 0.05:
            self.shown = sample.force_N
        return replace(sample, force_N=self.shown)


class MarkedOnce(FakeForceSensor):
    """The flag of saturation is one of the device's that reading clears."""

    def read(self) -> Any:
        before, sample = self._sample, super().read()
        if max(map(abs, sample.force_N)) <= 400.0:
            return sample
        fresh = before is not sample and (before is None or before.force_N != sample.force_N)
        clipped = tuple(max(-400.0, min(400.0, f)) for f in sample.force_N)
        return replace(sample, force_N=clipped, validity=Validity.SATURATED if fresh else sample.validity)


class SixteenBits(FakeJointEncoder):
    """Passes on the device's own counter."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        return super()._measured(now_ns, (sequence + 1) % 2**16)


class ForgetsBoundsOnceStopped(FakeArm):
    """A stop ends its program, and with it the bounds that were in there."""

    def stop(self) -> None:
        super().stop()
        self._lower_rad, self._upper_rad = (-9.0,) * 3, (9.0,) * 3


class ForgetsSpeedAtSecondFault(FakeArm):
    """What was set by hand is gone once its drives start anew, which is after the second fault."""

    faults = 0

    def fail(self, cause: str = "fault on demand") -> None:
        super().fail(cause)
        self.faults += 1
        if self.faults == 2:
            self._max_step_rad = 9.0


class MasksAtStart(FakeArm):
    """What the drives report in the first ticks after activation is inrush."""

    active_ns = 0

    def _on_activate(self) -> None:
        super()._on_activate()
        self.active_ns = self.clock.now_ns()

    def fail(self, cause: str = "fault on demand") -> None:
        if self.clock.now_ns() - self.active_ns > 3 * TICK_NS:
            super().fail(cause)


class StopsWhileLed(FakeArm):
    """Of a stop long after the last command nothing is kept."""

    sent_ns = 0

    def send(self, command: JointCommand) -> Any:
        self.sent_ns = self.clock.now_ns()
        return super().send(command)

    def stop(self) -> None:
        super().stop()
        self._stopped = self.clock.now_ns() - self.sent_ns < 50 * TICK_NS


class SwallowsTenthOfMilliradian(FakeArm):
    """A move of less than 0.1 mrad is not worth a frame."""

    def send(self, command: JointCommand) -> Any:
        target = self._target_rad, self._target_since_ns
        applied = super().send(command)
        if max(abs(a - b) for a, b in zip(target[0], applied.position_rad, strict=True)) < 1e-4:
            self._target_rad, self._target_since_ns = target
        return applied


class StaysOpenOnceStopped(FakeArm):
    """A stopped arm keeps its connection: nobody knows what it would do without."""

    def _on_close(self) -> None:
        was = self._stopped
        super()._on_close()
        self.is_open = was


class Rough(FakeClock):
    """Time in whole milliseconds."""

    def now_ns(self) -> int:
        return super().now_ns() // 1_000_000 * 1_000_000


class SleepsInPieces(FakeClock):
    """Waits for a second at most, as the system call below does."""

    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(min(deadline_ns, self._now_ns + 10**9))


class JumpsOnce(FakeClock):
    """A time server sets it on by a second, once."""

    looks = 0

    def now_ns(self) -> int:
        self.looks += 1
        if self.looks == 700:
            self._now_ns += 10**9
        return super().now_ns()


class SleepsOnTheDeadlineGone(FakeClock):
    """A deadline that has gone by is one of the next period."""

    def sleep_until(self, deadline_ns: int) -> None:
        while deadline_ns < self._now_ns:
            deadline_ns += 5_000_000
        super().sleep_until(deadline_ns)
