"""Ports under watchdogs keep the contracts as they do without."""

from dataclasses import replace

from palpate.adapters.hardware.watchdogs import (
    GuardedArm,
    OperatorSources,
    OperatorStop,
    WatchedArm,
    WatchedClock,
    WatchedForceSensor,
    WatchedJointEncoder,
)
from palpate.core.ports.contracts import (
    TICK_NS,
    ArmCommandContract,
    ArmCommandRig,
    ClockContract,
    ClockRig,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
)

# As modules: a suite that is imported by name would be run here once more as it is.
from tests.contracts import test_fake as fake
from tests.fake_devices import MAX_AGE_NS

LONG_NS = 20 * TICK_NS
HOUR_NS = 3600 * 10**9


class Counter:
    """A watchdog of the loop that only counts."""

    fed = 0

    def feed(self) -> None:
        self.fed += 1


class TestWatchedClock(ClockContract):
    def make(self) -> ClockRig:
        rig = fake.TestFakeClock().make()
        return replace(rig, clock=WatchedClock(rig.clock, Counter()))


def test_each_sleep_feeds() -> None:
    counter = Counter()
    clock = WatchedClock(fake.FakeClock(), counter)
    for tick in range(1, 50):
        clock.sleep_until(tick * TICK_NS)
    assert (clock.now_ns(), counter.fed) == (49 * TICK_NS, 49)


class TestWatchedForceSensor(ForceSensorContract):
    def make(self) -> ForceSensorRig:
        rig = fake.TestFakeForceSensor().make()
        return replace(rig, device=WatchedForceSensor(rig.device, rig.clock, MAX_AGE_NS, dead_after_ns=2 * MAX_AGE_NS))


class TestWatchedForceSensorThatLies(ForceSensorContract):
    """The sensor underneath never marks a silence; the watchdog does."""

    def make(self) -> ForceSensorRig:
        clock = fake.FakeClock()
        sensor = fake.FakeForceSensor(clock, max_age_ns=HOUR_NS)
        return ForceSensorRig(
            device=WatchedForceSensor(sensor, clock, MAX_AGE_NS, dead_after_ns=2 * MAX_AGE_NS),
            clock=clock,
            advance=clock.advance,
            max_age_ns=MAX_AGE_NS,
            push_N=lambda fx, fy, fz: setattr(sensor, "load_N", (fx, fy, fz)),
            go_silent=lambda: setattr(sensor, "silent", True),
            disconnect=lambda: setattr(sensor, "disconnected", True),
            reconnect=lambda: setattr(sensor, "disconnected", False),
            provoke_fault=sensor.fail,
            is_open=lambda: sensor.is_open,
        )


class TestWatchedJointEncoder(JointEncoderContract):
    def make(self) -> JointEncoderRig:
        rig = fake.TestFakeJointEncoder().make()
        assert rig.arm is not None
        device = WatchedJointEncoder(rig.device, rig.clock, MAX_AGE_NS, dead_after_ns=2 * MAX_AGE_NS)
        return replace(rig, device=device, arm=WatchedArm(rig.arm, rig.clock, LONG_NS))


class TestWatchedArm(ArmCommandContract):
    def make(self) -> ArmCommandRig:
        rig = fake.TestFakeArm().make()
        return replace(rig, device=WatchedArm(rig.device, rig.clock, LONG_NS))


class TestGuardedArm(ArmCommandContract):
    """Under everything at once."""

    def make(self) -> ArmCommandRig:
        rig = fake.TestFakeArm().make()
        operator = OperatorStop(rig.device, rig.clock, OperatorSources(keys=False, signal_number=None))
        arm = WatchedArm(rig.device, rig.clock, LONG_NS)
        return replace(rig, device=GuardedArm(arm, [operator]))
