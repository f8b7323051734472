"""Adapters that keep or lose something over a cut cable, and some that go wrong beside something else only."""

from dataclasses import replace
from typing import Any

from palpate.core.ports import AppliedCommand, CommandReason, JointCommand, Life
from palpate.core.ports.contracts.fakes import TICK_NS, FakeClock
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder


class Plugged:
    """Does something when its cable is plugged in again."""

    cut = ever = False

    @property
    def disconnected(self) -> bool:
        return self.cut

    @disconnected.setter
    def disconnected(self, value: bool) -> None:
        again, self.cut = self.cut and not value, value
        if again:
            self.ever = True
            self.replugged()

    def replugged(self) -> None: ...


class PluggedArm(Plugged, FakeArm):
    asked_rad: Any = None

    def go_on(self) -> None:
        self._target_rad, self._target_since_ns = self.asked_rad or self._target_rad, self.clock.now_ns()


class ResumesPlugged(PluggedArm):
    """The drives carry out what they were told last, before the stop."""

    replugged = PluggedArm.go_on

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        if not self._stopped:
            self.asked_rad = applied.position_rad
        return applied


class SendsLater(PluggedArm):
    """What was refused without a cable is carried out with it."""

    replugged = PluggedArm.go_on

    def send(self, command: JointCommand) -> AppliedCommand:
        self.asked_rad = command.position_rad if self.cut and not self._stopped else None
        return super().send(command)


class ForgetsStopWithoutCable(PluggedArm):
    def stop(self) -> None:
        if not self.cut:
            super().stop()


class FreedPlugged(PluggedArm):
    """Initialised anew, and so no longer stopped."""

    def replugged(self) -> None:
        self._stopped = False


class UnlimitedPlugged(PluggedArm):
    def replugged(self) -> None:
        self._max_step_rad = 9.0


class ClearedPlugged(PluggedArm):
    def replugged(self) -> None:
        if self._life is Life.FAULTED:
            self._life, self._fault = Life.CONFIGURED, None


class AcknowledgesStrangely(PluggedArm):
    """What its library raises without a cable comes through."""

    def _on_acknowledge(self) -> None:
        if self.cut:
            raise ValueError("not enough values to unpack")


class NeverOldPlugged(Plugged, FakeForceSensor):
    def replugged(self) -> None:
        self._max_age_ns = 10**18


class UnmarkedPlugged(Plugged, FakeForceSensor):
    """The ranges are not asked for once more."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample, most = super()._measured(now_ns, sequence), 400.0 if self.ever else 1e9
        return replace(sample, force_N=tuple(max(-most, min(most, f)) for f in sample.force_N))


class ForgetsTurnsUnplugged(Plugged, FakeJointEncoder):
    """It stands where it stood when its power went."""

    was_rad: Any = None

    def read(self) -> Any:
        sample = super().read()
        if not self.ever:
            self.was_rad = sample.position_rad
        return replace(sample, position_rad=self.was_rad) if self.ever else sample


# Beside something else


class StopsUnlessClamped(FakeArm):
    """One flag says both that a command was cut short and that the arm is held."""

    held = False

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        self.held = applied.reason in (CommandReason.POSITION_LIMIT, CommandReason.VELOCITY_LIMIT)
        return applied

    def stop(self) -> None:
        if not self.held:
            super().stop()


class CoastsAtSpeed(FakeArm):
    """Out of more than half its speed it needs another tick."""

    def stop(self) -> None:
        target_rad, here_rad = self._target_rad, self.position_rad()
        super().stop()
        if max(abs(a - b) for a, b in zip(target_rad, here_rad, strict=True)) > 0.5 * self._max_step_rad:
            self._target_rad, self._target_since_ns = target_rad, self.clock.now_ns()


class FinishesLongAfter(FakeArm):
    """A way that a stop broke off is gone on with when the arm is activated more than five seconds later."""

    left: Any = None

    def stop(self) -> None:
        target_rad, here_rad = self._target_rad, self.position_rad()
        super().stop()
        if target_rad != here_rad:
            self.left = target_rad, self.clock.now_ns()

    def _on_activate(self) -> None:
        super()._on_activate()
        if self.left and self.clock.now_ns() - self.left[1] > 5 * 10**9:
            self._target_rad, self._target_since_ns = self.left[0], self.clock.now_ns()
        self.left = None


class EitherLimit(FakeArm):
    """What was slowed down is not held against the bounds any more."""

    def send(self, command: JointCommand) -> AppliedCommand:
        bounds = self._lower_rad, self._upper_rad
        ways = zip(command.position_rad, self.position_rad(), strict=False)
        if any(abs(q - here) > self._max_step_rad for q, here in ways):
            self._lower_rad, self._upper_rad = (-9.0,) * 3, (9.0,) * 3
        try:
            return super().send(command)
        finally:
            self._lower_rad, self._upper_rad = bounds


class TurnsTwiceAsFast(FakeArm):
    """Way back and way forth are one way."""

    way_rad = 0.0

    def send(self, command: JointCommand) -> AppliedCommand:
        most_rad, way_rad = self._max_step_rad, command.position_rad[0] - self.position_rad()[0]
        self._max_step_rad, self.way_rad = most_rad * (1 + (way_rad * self.way_rad < 0.0)), way_rad
        try:
            return super().send(command)
        finally:
            self._max_step_rad = most_rad


class LosesFirstCommand(FakeArm):
    """The first command of a session goes into the frame that switches the servos on."""

    fresh = False

    def _on_activate(self) -> None:
        super()._on_activate()
        self.fresh = True

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        if self.fresh and not self._stopped:
            self._halt()
        self.fresh = False
        return applied


class KeepsAliveWithTheFirst(FakeArm):
    """Half a second without a command: it sends the one with which it was made once more."""

    first_rad: Any = None

    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        self.first_rad = self.first_rad or applied.position_rad
        return applied

    def position_rad(self) -> Any:
        if self.first_rad and not self._stopped and self.clock.now_ns() - self._target_since_ns > 5 * 10**8:
            self._target_rad = self.first_rad
        return super().position_rad()

    def _on_activate(self) -> None:
        super()._on_activate()
        self.first_rad = None


class KeepsTheFirstOfTwoLikeOnes(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        target_rad, since_ns = self._target_rad, self._target_since_ns
        applied = super().send(command)
        like = max(abs(a - b) for a, b in zip(target_rad, applied.position_rad, strict=True)) < 1e-3
        if like and since_ns == self.clock.now_ns():
            self._target_rad = target_rad
        return applied


class SaysAsAskedWhereItIsHeld(FakeArm):
    def send(self, command: JointCommand) -> AppliedCommand:
        applied = super().send(command)
        return AppliedCommand(applied.position_rad) if applied.position_rad == command.position_rad else applied


class NewestCause(FakeArm):
    faults = 0

    def fail(self, cause: str = "fault on demand") -> None:
        super().fail(cause)
        self.faults += 1
        self._fault = f"{cause}, fault number {self.faults}"


class FailsOnlyActive(FakeArm):
    def fail(self, cause: str = "fault on demand") -> None:
        if self._life is Life.ACTIVE:
            super().fail(cause)


class StopEndsFault(FakeArm):
    """Five seconds after a stop the fault is over."""

    def stop(self) -> None:
        super().stop()
        self.at_ns = self.clock.now_ns()

    @property
    def life(self) -> Life:
        if self._life is Life.FAULTED and self.clock.now_ns() - getattr(self, "at_ns", 10**18) > 5 * 10**9:
            self._life, self._fault = Life.CONFIGURED, None
        return self._life


class TimesOut(FakeJointEncoder):
    """After three seconds of silence its library has had enough."""

    def read(self) -> Any:
        sample = super().read()
        if self.clock.now_ns() - sample.source_time_ns > 3 * 10**9:
            raise TimeoutError
        return sample


class SleepsWhileStopped(FakeJointEncoder):
    """A stopped arm stands still."""

    was_rad: Any = None

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        self.was_rad = (self.was_rad or sample.position_rad) if self.arm._stopped else None  # type: ignore[attr-defined]
        return replace(sample, position_rad=self.was_rad or sample.position_rad)


class MirrorsInTension(FakeForceSensor):
    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        x, y, z = sample.torque_Nm
        return replace(sample, torque_Nm=(x, -y if sample.force_N[2] > 0.01 else y, z))


class TaresLittle(FakeForceSensor):
    """Less than 1 N at the start is drift."""

    zero_N: Any = None

    def _on_activate(self) -> None:
        super()._on_activate()
        self.zero_N = None

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        if self.zero_N is None:
            self.zero_N = sample.force_N if max(map(abs, sample.force_N)) < 1.0 else (0.0,) * 3
        return replace(sample, force_N=tuple(f - z for f, z in zip(sample.force_N, self.zero_N, strict=True)))


class ClipsTogether(FakeForceSensor):
    """Beside a large force a torque is clipped."""

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        most = 8.0 if max(map(abs, sample.force_N)) > 200.0 else 1e9
        return replace(sample, torque_Nm=tuple(max(-most, min(most, t)) for t in sample.torque_Nm))


class RestartsOverloaded(FakeForceSensor):
    """An overload restarts it, without the order of its torques."""

    over = False

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        self.over |= max(map(abs, sample.force_N)) > 300.0
        x, y, z = sample.torque_Nm
        return replace(sample, torque_Nm=(y, x, z)) if self.over else sample


class QueuesWhilePaused(FakeForceSensor):
    """One that fell asleep in a long pause delivers what waits in the line, as new."""

    paused_ns = until_ns = 0
    was: Any = None

    def _on_deactivate(self) -> None:
        self.paused_ns = self.clock.now_ns()

    def _on_activate(self) -> None:
        now_ns = self.clock.now_ns()
        self.until_ns = now_ns + 50 * TICK_NS if self.paused_ns and now_ns - self.paused_ns > 5 * 10**9 else 0

    def _measured(self, now_ns: int, sequence: int) -> Any:
        sample = super()._measured(now_ns, sequence)
        if now_ns < self.until_ns and self.was:
            return replace(sample, force_N=self.was.force_N, torque_Nm=self.was.torque_Nm)
        self.was = sample
        return sample


class WrapsAt32Bits(FakeClock):
    def now_ns(self) -> int:
        return super().now_ns() % 2**32


class SleepsAMillisecondAtLeast(FakeClock):
    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(max(deadline_ns, self._now_ns + 10**6) if deadline_ns > self._now_ns else deadline_ns)
