"""Fakes under a stopwatch; every clock and every account is the test's own."""

from __future__ import annotations

from palpate.adapters.hardware.real_time import Limits, Stopwatch, ThreadAccount, timed
from palpate.adapters.hardware.real_time.attribution import Account
from palpate.adapters.hardware.real_time.lateness import LateTick, SlowCore
from palpate.core.control_loop import next_slot, tick_time_ns
from palpate.core.ports.contracts.fakes import FakeArm, FakeClock, FakeForceSensor, FakeJointEncoder
from palpate.core.ports.devices import Ports
from palpate.core.ports.values import JointCommand, JointSample, WrenchSample

HOME_RAD = (0.1, -0.2, 0.3)
MS = 1_000_000


class FakeAccount(ThreadAccount):
    """An account that says what it is told to."""

    def __init__(self, run_ns_each: int = 0, turns_each: int = 1) -> None:
        self.run_ns = self.delay_ns = self.turns = 0
        self.run_ns_each, self.turns_each = run_ns_each, turns_each

    def read(self) -> Account:
        self.run_ns += self.run_ns_each
        self.turns += self.turns_each
        return Account(self.run_ns, self.delay_ns, self.turns)


class SlowSensor(FakeForceSensor):
    """Takes its time."""

    took_ns = 0

    def read(self) -> WrenchSample:
        work(self.clock, self.took_ns)
        return super().read()


class SlowEncoder(FakeJointEncoder):
    """Takes its time."""

    took_ns = 0

    def read(self) -> JointSample:
        work(self.clock, self.took_ns)
        return super().read()


class SlowArm(FakeArm):
    """Comes to rest slowly."""

    rest_ns = 0

    def stop(self) -> None:
        super().stop()
        work(self.clock, self.rest_ns)


def work(clock: object, took_ns: int) -> None:
    """Time goes by."""
    assert isinstance(clock, FakeClock)
    clock.sleep_until(clock.now_ns() + took_ns)


class LazyClock(FakeClock):
    """Wakes a sleeper late."""

    late_ns = 0

    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(deadline_ns)
        if self.late_ns:
            super().sleep_until(self.now_ns() + self.late_ns)


class Bench:
    """Ports under a stopwatch, and the loop over them."""

    def __init__(
        self, limits: Limits | None = None, account: ThreadAccount | None = None, *, clock_works: bool = False
    ) -> None:
        self.clock = LazyClock(5)
        self.told: list[LateTick | SlowCore] = []
        self.stopwatch = Stopwatch(
            limits, account=account, tell=self.told.append, clock_works=clock_works, now_ns=self.clock.now_ns
        )
        self.arm = SlowArm(self.clock, HOME_RAD, lower_rad=(-1.0,) * 3, upper_rad=(1.0,) * 3, max_step_rad=0.02)
        self.sensor = SlowSensor(self.clock)
        self.encoder = SlowEncoder(self.clock, self.arm.position_rad)
        for device in (self.sensor, self.encoder, self.arm):
            device.configure()
            device.activate()
        self.plain = Ports(self.clock, self.sensor, self.encoder, self.arm)
        self.ports = timed(self.plain, self.stopwatch)
        self.core_ns = 0

    def trial(self, ticks: int) -> None:
        """As the core's loop does."""
        p = self.ports
        start_ns, slot = p.clock.now_ns(), 0
        try:
            for _ in range(ticks):
                p.clock.sleep_until(tick_time_ns(start_ns, slot))
                time_ns = p.clock.now_ns()
                p.force_sensor.read()
                p.joint_encoder.read()
                work(self.clock, self.core_ns)
                p.arm.send(JointCommand(HOME_RAD))
                slot = next_slot(start_ns, slot, time_ns)
        finally:
            p.arm.stop()
