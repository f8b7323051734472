"""Arms that would hurt somebody: each a good fake with one thing overridden."""

from typing import Any

from palpate.core.ports import CommandReason, JointCommand, Life
from palpate.core.ports.contracts import TICK_NS
from tests.contracts import test_fake as fake
from tests.fake_devices import FakeArm

HOME = fake.HOME_RAD

# Arms that do not come to rest


def only_said(self: Any) -> None:
    self._stopped = True


def left_moving(self: Any) -> None: ...


class HoldsFirstStop(FakeArm):
    held: Any = None

    def stop(self) -> None:
        super().stop()
        self.held = self._target_rad = self.held or self._target_rad


class SaysItIsAtHome(FakeArm):
    def send(self, command: JointCommand) -> Any:
        applied = super().send(command)
        return applied._replace(position_rad=HOME) if applied.reason is CommandReason.STOPPED else applied


class StopWearsOff(FakeArm):
    stopped_ns = 0

    def stop(self) -> None:
        super().stop()
        self.stopped_ns = self.clock.now_ns()

    def send(self, command: JointCommand) -> Any:
        self._stopped = self._stopped and self.clock.now_ns() < self.stopped_ns + 50 * TICK_NS
        return super().send(command)


class MovesOnAfterStop(FakeArm):
    """A second after a stop the motion goes on, without a command."""

    def stop(self) -> None:
        self.asked_rad, self.stopped_ns = self._target_rad, self.clock.now_ns()
        super().stop()

    def position_rad(self) -> Any:
        if self._stopped and self.clock.now_ns() > self.stopped_ns + 140 * TICK_NS:
            self._target_rad = self.asked_rad
        return super().position_rad()


class Resumes(FakeArm):
    """Activated again, it goes on to where it was sent before."""

    after = "stop"

    def _halt(self) -> None:
        if self._target_rad != self.position_rad():
            self.asked_rad = self._target_rad
        super()._halt()

    def stop(self) -> None:
        super().stop()
        self.after_what = "stop"

    def fail(self, cause: str = "") -> None:
        super().fail("overload")
        self.after_what = "fault"

    def _on_activate(self) -> None:
        self._stopped = False
        if getattr(self, "after_what", "") == self.after:
            self._target_rad = self.asked_rad


class ActivatesAtHome(FakeArm):
    def _on_activate(self) -> None:
        super()._on_activate()
        self._target_rad = HOME


class StopForgetsFault(FakeArm):
    def stop(self) -> None:
        super().stop()
        if self._life is Life.FAULTED:
            self._life, self._fault = Life.CONFIGURED, None


# Commands


class DropsEverySecond(FakeArm):
    sent = 0

    def send(self, command: JointCommand) -> Any:
        before, since_ns = self._target_rad, self._target_since_ns
        applied = super().send(command)
        self.sent += 1
        if not self.sent % 2:
            self._target_rad, self._target_since_ns = before, since_ns
        return applied


class MovesUnasked(FakeArm):
    """Passes on what it refuses."""

    refused_in: Any = None

    def send(self, command: JointCommand) -> Any:
        if self._life is (self.refused_in or self._life):
            self._target_rad, self._target_since_ns = command.position_rad[:3], self.clock.now_ns()
        return super().send(command)


class OnlyBounds(FakeArm):
    """Some of the limits are not there."""

    absent: tuple[tuple[str, int], ...] = ()

    def _on_configure(self) -> None:
        super()._on_configure()
        for name, joint in self.absent:
            limits = list(getattr(self, name))
            limits[joint] *= 9.0
            setattr(self, name, tuple(limits))


class SaysLimitAndGoesOn(FakeArm):
    def send(self, command: JointCommand) -> Any:
        applied = super().send(command)
        if applied.reason is CommandReason.POSITION_LIMIT:
            self._target_rad = command.position_rad
        return applied


class AddsUpWithinATick(FakeArm):
    """The velocity limit counts from the last command, not from the tick."""

    def send(self, command: JointCommand) -> Any:
        here, self._here_rad = self._here_rad, self._target_rad
        try:
            return super().send(command)
        finally:
            self._here_rad = here


class LimitsTheFirstTickOnly(FakeArm):
    """Further ticks of a motion that was too fast are as fast as they were asked."""

    limited_ns = -1

    def send(self, command: JointCommand) -> Any:
        now_ns = self.clock.now_ns()
        self._max_step_rad = 0.02 if self.limited_ns in (-1, now_ns) else 9.0
        applied = super().send(command)
        self.limited_ns = now_ns if applied.reason is CommandReason.VELOCITY_LIMIT else -1
        return applied


class LimitsOneJoint(FakeArm):
    def send(self, command: JointCommand) -> Any:
        ways = zip(command.position_rad, self.position_rad(), strict=False)
        self._max_step_rad = 9.0 if sum(abs(q - p) > 0.02 for q, p in ways) > 1 else 0.02
        return super().send(command)


class KeepsOneLimitAtATime(FakeArm):
    """With two joints beyond their limits at once, both go there."""

    def send(self, command: JointCommand) -> Any:
        applied = super().send(command)
        limits = zip(command.position_rad, self._lower_rad, self._upper_rad, strict=True)
        if sum(not lower <= q <= upper for q, lower, upper in limits) < 2:
            return applied
        self._target_rad = command.position_rad
        return applied._replace(position_rad=self._target_rad)


class SavesUpHaste(FakeArm):
    """After a pause it may go as far at once as it could have gone meanwhile."""

    sent_ns = 0

    def send(self, command: JointCommand) -> Any:
        now_ns = self.clock.now_ns()
        self._max_step_rad = 0.02 * max(1, (now_ns - self.sent_ns) // TICK_NS)
        self.sent_ns = now_ns
        return super().send(command)


class HangsNowAndThen(FakeArm):
    sent = 0

    def send(self, command: JointCommand) -> Any:
        self.sent += 1
        self.clock.sleep_until(self.clock.now_ns() + 10**9 * (self.sent % 6 == 0))
        return super().send(command)


class StopToggles(FakeArm):
    def stop(self) -> None:
        was_stopped = self._stopped
        super().stop()
        self._stopped = not was_stopped


class RefusalEndsStop(FakeArm):
    def send(self, command: JointCommand) -> Any:
        self._stopped = self._stopped and len(command.position_rad) == len(HOME)
        return super().send(command)


class ClosesTowardsHome(FakeArm):
    """With a fault, closing drives it home."""

    def _on_close(self) -> None:
        super()._on_close()
        if self._fault:
            to_home(self)


class StopsOnce(FakeArm):
    stops = 0

    def stop(self) -> None:
        self.stops += 1
        self._stopped = True
        if self.stops == 1:
            self._halt()


class BrakeLetsGoLate(FakeArm):
    """Deactivated, it holds for a while before it sinks."""

    paused_ns = 0

    def _on_deactivate(self) -> None:
        super()._on_deactivate()
        self.paused_ns = self.clock.now_ns()

    def position_rad(self) -> Any:
        q = super().position_rad()
        sinks = self._life is Life.CONFIGURED and 0 < self.paused_ns < self.clock.now_ns() - 100 * TICK_NS
        return (q[0] + 0.01, *q[1:]) if sinks else q


def to_home(self: Any) -> None:
    self._target_rad, self._target_since_ns = HOME, self.clock.now_ns()


class RemembersWhatItSwallowed(FakeArm):
    """What was sent while it was stopped is carried out once it is active again."""

    kept_rad: Any = None

    def send(self, command: JointCommand) -> Any:
        applied = super().send(command)
        if applied.reason is CommandReason.STOPPED:
            self.kept_rad = command.position_rad
        return applied

    def _on_activate(self) -> None:
        super()._on_activate()
        if self.kept_rad is not None:
            self._target_rad, self._target_since_ns, self.kept_rad = self.kept_rad, self.clock.now_ns(), None
