"""Unsafe adapters, each a sound fake with one thing overridden, and the clause that has to find it."""

from collections import deque
from dataclasses import replace
from threading import Event, Thread, get_ident
from time import sleep
from typing import Any

from palpate.adapters.contracts import TICK_NS, FakeClock
from palpate.core.ports import AppliedCommand, CommandReason, Life, Validity, WrenchKind

# As a module: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

ZERO = (0.0, 0.0, 0.0)


def altered(base, /, **changes):
    """A kind of device whose samples differ from the true ones in some fields."""

    def read(device):
        sample = base.read(device)
        return replace(sample, **{name: change(sample) for name, change in changes.items()})

    return type("Altered" + "".join(changes), (base,), {"read": read})


# The life of a device


class OpensBeforeItAsks(FakeForceSensor):
    def _on_configure(self):
        self.is_open = True
        super()._on_configure()


class AcknowledgeActivates(FakeForceSensor):
    def acknowledge_fault(self):
        super().acknowledge_fault()
        self.activate()


class ResumesPlugged(FakeArm):
    """Plugged in again, the drives go on to where they were sent before the stop."""

    cut, asked_rad = False, None

    @property
    def disconnected(self):
        return self.cut

    @disconnected.setter
    def disconnected(self, value):
        again, self.cut = self.cut and not value, value
        if again and self.asked_rad:
            self._target_rad, self._target_since_ns = self.asked_rad, self.clock.now_ns()

    def send(self, command):
        applied = super().send(command)
        if not self._stopped:
            self.asked_rad = applied.position_rad
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


class HidesDisconnection(FakeForceSensor):
    def _require_connection(self):
        if self._life is not Life.ACTIVE:
            super()._require_connection()


class StaysOpenAfterFault(FakeForceSensor):
    def close(self):
        was_faulted = self._life is Life.FAULTED
        super().close()
        self.is_open = was_faulted


class LeavesThread(FakeForceSensor):
    def _on_configure(self):
        super()._on_configure()
        Thread(target=Event().wait, args=(5.0,), daemon=True).start()


class AwaitsNews(FakeForceSensor):
    """Reading a second time waits for the next sample, in vain."""

    def read(self):
        last, sample = self._sample, super().read()
        if sample is last:
            self.clock.advance(2)
        return sample


class Sleeps(FakeForceSensor):
    """Waits by a clock that is not the rig's."""

    def read(self):
        sleep(0.01)
        return super().read()


# Samples


class LosesJoint(FakeJointEncoder):
    def read(self):
        sample = super().read()
        return replace(sample, position_rad=sample.position_rad[:2]) if sample.sequence % 70 == 69 else sample


class StaleIsZero(FakeForceSensor):
    def read(self):
        sample = super().read()
        return replace(sample, force_N=(1.0, 0.0, 0.0)) if self.silent else sample


def never_stale(clock):
    return FakeForceSensor(clock, max_age_ns=10**18)


class Mirrors(FakeForceSensor):
    """Whose range is marked, at least."""

    def read(self):
        sample = super().read()
        validity = Validity.SATURATED if max(map(abs, sample.force_N)) > 50.0 else sample.validity
        return replace(sample, force_N=tuple(-x for x in sample.force_N), validity=validity)


class ClipsTorque(FakeForceSensor):
    """What it clips is not marked."""

    def _measured(self, now_ns, sequence):
        sample = super()._measured(now_ns, sequence)
        return replace(sample, torque_Nm=tuple(max(-1.1, min(1.1, t)) for t in sample.torque_Nm))


class TaresOnConfigure(FakeForceSensor):
    zero_N = ZERO

    def _on_configure(self):
        super()._on_configure()
        self.zero_N = self.load_N

    def read(self):
        sample = super().read()
        return replace(sample, force_N=tuple(f - zero for f, zero in zip(sample.force_N, self.zero_N, strict=True)))


class MeasuresTarget(FakeJointEncoder):
    """Takes a sample from the command of its own tick."""

    arm: FakeArm

    def read(self):
        self._position_rad = lambda: self.arm._target_rad
        return super().read()


# Commands and stops


class GoesBackWhenActivated(FakeArm):
    """Turned by hand while it was not active, it returns."""

    was_rad: Any = None

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
        return applied._replace(reason=CommandReason.AS_ASKED) if applied.reason is self.hushed else applied


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


# Clocks


class TellsSeconds(FakeClock):
    def now_ns(self):
        return float(super().now_ns())


class TurnsBack(FakeClock):
    def sleep_until(self, deadline_ns):
        self._now_ns = deadline_ns


class Drifts(FakeClock):
    """Sleeps for a duration, each time a little too long."""

    late_ns = 0

    def sleep_until(self, deadline_ns):
        self.late_ns += 1
        super().sleep_until(deadline_ns + self.late_ns if deadline_ns > self.now_ns() else deadline_ns)


FORCE, ENCODER, ARM, CLOCK = (fake.TestFakeForceSensor, fake.TestFakeJointEncoder, fake.TestFakeArm, fake.TestFakeClock)
LIFE, SOUND, SILENT, LOAD = "life_follows_the_table", "every_sample_is_sound", "silence_is_marked", "load_has_its_sign"
BOUNDS, SPEED, STILL = "position_limit", "velocity_limit", "after_stop_the_arm_holds_still"
UNSAFE = [
    (FORCE, OpensBeforeItAsks, "only_configure_opens"),
    (FORCE, AcknowledgeActivates, LIFE),
    *((ARM, kind, LIFE) for kind in (ResumesPlugged, DropsEverySecond, ClosesMoving)),
    (FORCE, HidesDisconnection, "lost_device_raises"),
    *((FORCE, kind, "close_releases") for kind in (StaysOpenAfterFault, LeavesThread)),
    *((FORCE, kind, "calls_do_not_block") for kind in (AwaitsNews, Sleeps)),
    (FORCE, altered(FakeForceSensor, source_time_ns=lambda s: s.source_time_ns - 9 * TICK_NS), SOUND),
    (FORCE, altered(FakeForceSensor, sequence=lambda s: s.sequence % 256), SOUND),
    (FORCE, altered(FakeForceSensor, kind=lambda _: WrenchKind.TARED), SOUND),
    (ENCODER, LosesJoint, SOUND),
    *((FORCE, kind, SILENT) for kind in (never_stale, StaleIsZero)),
    (FORCE, Mirrors, LOAD),
    (FORCE, altered(FakeForceSensor, torque_Nm=lambda s: tuple(map(abs, s.torque_Nm))), LOAD),
    (FORCE, ClipsTorque, "what_is_beyond_the_range"),
    (FORCE, TaresOnConfigure, "no_hidden_tare"),
    (ENCODER, altered(FakeJointEncoder, position_rad=lambda s: tuple(q + 2e-4 for q in s.position_rad)), "angles_are"),
    (ENCODER, MeasuresTarget, "encoders_follow"),
    (ARM, GoesBackWhenActivated, "turned_by_hand"),
    *((ARM, kind, BOUNDS) for kind in (ClampsSilently, NoLowerLimit, CannotLeaveItsLimit)),
    *((ARM, kind, SPEED) for kind in (SlowsSilently, AddsUpWithinATick)),
    (ARM, MovesUnasked, "wrong_number"),
    (ARM, Queues, "newest_command_wins"),
    (ARM, StopsOnlyAlive, "stop_works_in_every_state"),
    (ARM, StopsForItsThreadOnly, "stop_works_from_another_thread"),
    *((ARM, kind, STILL) for kind in (StopSendsNothing, StopWearsOff, HidesStop)),
    (CLOCK, TellsSeconds, "time_is_integer"),
    (CLOCK, TurnsBack, "past_deadline_returns_at_once"),
    (CLOCK, Drifts, "absolute_deadlines_do_not_drift"),
]
"""Suite, adapter, and the beginning of the name of the clause that has to fail."""
