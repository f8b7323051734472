"""Unsafe adapters, each a sound fake with one thing overridden, and the clause that has to find it."""

from dataclasses import replace
from threading import Event, Thread
from time import sleep

from palpate.adapters.contracts import TICK_NS, FakeClock
from palpate.core.ports import Life, Validity, WrenchKind

# As a module: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake
from tests.contracts.unsafe_arms import LIFE, UNSAFE_ARMS
from tests.fake_devices import FakeForceSensor, FakeJointEncoder

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

    def read(self):
        self._position_rad = lambda: self.arm._target_rad
        return super().read()


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
SOUND, SILENT, LOAD = "every_sample_is_sound", "silence_is_marked", "load_has_its_sign"
UNSAFE = [
    (FORCE, OpensBeforeItAsks, "only_configure_opens"),
    (FORCE, AcknowledgeActivates, LIFE),
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
    *((ARM, kind, name) for kind, name in UNSAFE_ARMS),
    (CLOCK, TellsSeconds, "time_is_integer"),
    (CLOCK, TurnsBack, "past_deadline_returns_at_once"),
    (CLOCK, Drifts, "absolute_deadlines_do_not_drift"),
]
"""Suite, adapter, and the beginning of the name of the clause that has to fail."""
