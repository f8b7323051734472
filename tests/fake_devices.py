"""Plain fakes of the device ports: no physics, all knobs in reach, in virtual time.

A sensor takes a new sample when it is read at a time at which it has none yet; the arm is perfect and stands at a new
set-point as soon as time has gone on.
"""

from abc import abstractmethod
from dataclasses import replace

from palpate.adapters.contracts import TICK_NS
from palpate.core.errors import CommandError, DeviceError
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    CommandReason,
    ForceSensor,
    JointEncoder,
    JointSample,
    ManagedDevice,
    Validity,
    WrenchKind,
    WrenchSample,
)

MAX_AGE_NS = 5 * TICK_NS


class FakeDevice(ManagedDevice):
    """What the three fake devices have in common."""

    def __init__(self, name, clock):
        super().__init__(name)
        self.clock = clock
        self.disconnected = False
        self.is_open = False

    def fail(self, cause="fault on demand"):
        """Latch a fault."""
        self._latch(cause)

    def _require_connection(self):
        if self.disconnected:
            raise DeviceError(self.name, "does not answer")

    def _on_configure(self):
        self._require_connection()
        self.is_open = True

    def _on_close(self):
        self.is_open = False


class FakeSensor(FakeDevice):
    """A sensor that takes a sample when it is read at a time at which it has none yet."""

    def __init__(self, name, clock, max_age_ns):
        super().__init__(name, clock)
        self.silent = False
        self._max_age_ns = max_age_ns
        self._sample = None

    @abstractmethod
    def _measured(self, now_ns, sequence):
        """A new sample."""

    def read(self):
        """Newest sample."""
        self._require_active("read()")
        self._require_connection()
        now_ns, last = self.clock.now_ns(), self._sample
        if not self.silent and (last is None or now_ns > last.source_time_ns):
            self._sample = self._measured(now_ns, 0 if last is None else last.sequence + 1)
        if self._sample is None:
            raise DeviceError(self.name, "has not delivered a sample yet")
        if now_ns - self._sample.source_time_ns > self._max_age_ns:
            return replace(self._sample, validity=Validity.STALE)
        return self._sample


class FakeForceSensor(FakeSensor, ForceSensor):
    """A force sensor that reports the load it is given."""

    def __init__(self, clock, *, max_age_ns=MAX_AGE_NS):
        super().__init__("fake force sensor", clock, max_age_ns)
        self.load_N = (0.0, 0.0, 0.0)
        self.load_Nm = (0.0, 0.0, 0.0)
        self.kind = WrenchKind.RAW
        self.saturated = False

    def _measured(self, now_ns, sequence):
        validity = Validity.SATURATED if self.saturated else Validity.VALID
        return WrenchSample(self.load_N, self.load_Nm, now_ns, now_ns, sequence, validity, self.kind)


class FakeJointEncoder(FakeSensor, JointEncoder):
    """An encoder that reports given joint angles."""

    def __init__(self, clock, position_rad, *, max_age_ns=MAX_AGE_NS):
        super().__init__("fake joint encoder", clock, max_age_ns)
        self._position_rad = position_rad

    def _measured(self, now_ns, sequence):
        return JointSample(self._position_rad(), now_ns, now_ns, sequence)


class FakeArm(FakeDevice, ArmCommand):
    """A perfect arm: it stands at the newest set-point as soon as time has gone on."""

    def __init__(self, clock, home_rad, *, lower_rad, upper_rad, max_step_rad):
        super().__init__("fake arm", clock)
        self._lower_rad, self._upper_rad, self._max_step_rad = lower_rad, upper_rad, max_step_rad
        self._stopped = False
        self._here_rad = home_rad
        self._target_rad = home_rad
        self._target_since_ns = clock.now_ns()

    def position_rad(self):
        """Where the joints stand now, (n,)."""
        # A command shows only once time has gone on: what is observed in a tick cannot depend on it.
        if self.clock.now_ns() > self._target_since_ns:
            self._here_rad = self._target_rad
        return self._here_rad

    def turn_by_hand(self, position_rad):
        """Bring the joints elsewhere from outside."""
        self._here_rad = self._target_rad = position_rad

    def send(self, command):
        """Move to the set-points, within the velocity limit and then within the position limits."""
        self._require_active("send()")
        self._require_connection()
        here_rad, requested_rad, stopped = self.position_rad(), command.position_rad, self._stopped
        if len(requested_rad) != len(here_rad):
            raise CommandError(f"a command for {len(here_rad)} joints has {len(requested_rad)}", requested_rad)
        if stopped:
            return AppliedCommand(here_rad, CommandReason.STOPPED)
        reason, step_rad = CommandReason.AS_REQUESTED, self._max_step_rad
        slow_rad = tuple(
            min(max(q, here - step_rad), here + step_rad) for q, here in zip(requested_rad, here_rad, strict=True)
        )
        if slow_rad != requested_rad:
            reason = CommandReason.VELOCITY_LIMIT
        limits = zip(slow_rad, self._lower_rad, self._upper_rad, strict=True)
        applied_rad = tuple(min(max(q, lower), upper) for q, lower, upper in limits)
        if applied_rad != slow_rad:
            reason = CommandReason.POSITION_LIMIT
        self._target_rad, self._target_since_ns = applied_rad, self.clock.now_ns()
        if self._stopped:  # meanwhile, by a signal handler or another thread
            self._halt()
        return AppliedCommand(applied_rad, reason)

    def stop(self):
        """Hold still until deactivated and activated again."""
        self._stopped = True
        self._halt()

    def fail(self, cause="fault on demand"):
        """Latch a fault; the arm halts where it is."""
        self._halt()
        super().fail(cause)

    def _halt(self):
        self._target_rad = self.position_rad()

    def _on_activate(self):
        self._halt()
        self._stopped = False

    def _on_deactivate(self):
        self._halt()

    def _on_close(self):
        self._halt()
        super()._on_close()
