"""Unsafe arms, each a sound fake with one thing overridden, and the clause that has to find it."""

from collections import deque
from threading import get_ident

from palpate.adapters.contracts import TICK_NS
from palpate.core.ports import AppliedCommand, CommandReason, Life
from tests.fake_devices import FakeArm


class ResumesPlugged(FakeArm):
    """Plugged in again, the drives go on to where they were sent before the stop."""

    cut, requested_rad = False, None

    @property
    def disconnected(self):
        return self.cut

    @disconnected.setter
    def disconnected(self, value):
        again, self.cut = self.cut and not value, value
        if again and self.requested_rad:
            self._target_rad, self._target_since_ns = self.requested_rad, self.clock.now_ns()

    def send(self, command):
        applied = super().send(command)
        if not self._stopped:
            self.requested_rad = applied.position_rad
        return applied


class DropsEverySecond(FakeArm):
    sent = 0

    def send(self, command):
        before = self._target_rad, self._target_since_ns
        applied = super().send(command)
        self.sent += 1
        if not self.sent % 2:
            self._target_rad, self._target_since_ns = before
        return applied


class ClosesMoving(FakeArm):
    """``close`` leaves the command under way."""

    def _on_close(self):
        self.is_open = False


class GoesBackWhenActivated(FakeArm):
    """Turned by hand while it was not active, it returns."""

    was_rad = None

    def _on_deactivate(self):
        super()._on_deactivate()
        self.was_rad = self._target_rad

    def _on_activate(self):
        super()._on_activate()
        self._target_rad, self.was_rad = self.was_rad or self._target_rad, None


class ClampsSilently(FakeArm):
    hushed = CommandReason.POSITION_LIMIT

    def send(self, command):
        applied = super().send(command)
        return applied._replace(reason=CommandReason.AS_REQUESTED) if applied.reason is self.hushed else applied


class SlowsSilently(ClampsSilently):
    hushed = CommandReason.VELOCITY_LIMIT


class NoLowerLimit(FakeArm):
    def _on_configure(self):
        super()._on_configure()
        self._lower_rad = (*self._lower_rad[:2], -9.0)


class CannotLeaveItsLimit(FakeArm):
    """At a limit it refuses every further move, away from it too."""

    def send(self, command):
        applied, here = super().send(command), self.position_rad()
        limits = zip(here, self._lower_rad, self._upper_rad, strict=True)
        if not self._stopped and any(q in (lower, upper) for q, lower, upper in limits):
            self._target_rad = here
            return applied._replace(position_rad=here)
        return applied


class AddsUpWithinATick(FakeArm):
    """The velocity limit counts from the last command, not from the tick."""

    def send(self, command):
        here, self._here_rad = self._here_rad, self._target_rad
        try:
            return super().send(command)
        finally:
            self._here_rad = here

    def position_rad(self):
        return self._here_rad if self.clock.now_ns() == self._target_since_ns else super().position_rad()


class MovesUnasked(FakeArm):
    """Passes on what it refuses."""

    def send(self, command):
        if len(command.position_rad) != 3:
            self._target_rad, self._target_since_ns = (*command.position_rad, 0.0)[:3], self.clock.now_ns()
        return super().send(command)


class Queues(FakeArm):
    """Works off its commands one tick after the other."""

    def _on_configure(self):
        super()._on_configure()
        self.queue = deque()
        self.last_ns = self.clock.now_ns()

    def position_rad(self):
        if self.clock.now_ns() > self.last_ns and self.queue:
            self._here_rad, self.last_ns = self.queue.popleft(), self.clock.now_ns()
        return self._here_rad

    def send(self, command):
        applied = super().send(command)
        self.queue.append(applied.position_rad)
        self.last_ns = self.clock.now_ns()
        return applied

    def _halt(self):
        self.queue = deque()


class StopsOnlyAlive(FakeArm):
    def stop(self):
        if self._life is Life.CLOSED:
            raise RuntimeError("not now")
        super().stop()


class StopsForItsThreadOnly(FakeArm):
    thread = 0

    def _on_configure(self):
        super()._on_configure()
        self.thread = get_ident()

    def stop(self):
        if self.thread not in (0, get_ident()):
            raise RuntimeError("used from another thread")
        super().stop()


class StopSendsNothing(FakeArm):
    def stop(self):
        self._stopped = True


class StopWearsOff(FakeArm):
    stopped_ns = 0

    def stop(self):
        super().stop()
        self.stopped_ns = self.clock.now_ns()

    def send(self, command):
        self._stopped = self._stopped and self.clock.now_ns() < self.stopped_ns + 50 * TICK_NS
        return super().send(command)


class HidesStop(FakeArm):
    def send(self, command):
        applied = super().send(command)
        return AppliedCommand(applied.position_rad) if self._stopped else applied


LIFE, BOUNDS, SPEED = "life_follows_the_table", "position_limit", "velocity_limit"
STILL = "after_stop_the_arm_holds_still"
UNSAFE_ARMS = [
    *((kind, LIFE) for kind in (ResumesPlugged, DropsEverySecond, ClosesMoving)),
    (GoesBackWhenActivated, "turned_by_hand"),
    *((kind, BOUNDS) for kind in (ClampsSilently, NoLowerLimit, CannotLeaveItsLimit)),
    *((kind, SPEED) for kind in (SlowsSilently, AddsUpWithinATick)),
    (MovesUnasked, "wrong_number"),
    (Queues, "newest_command_wins"),
    (StopsOnlyAlive, "stop_works_in_every_state"),
    (StopsForItsThreadOnly, "stop_works_from_another_thread"),
    *((kind, STILL) for kind in (StopSendsNothing, StopWearsOff, HidesStop)),
]
"""Arm, and the beginning of the name of the clause that has to fail."""
