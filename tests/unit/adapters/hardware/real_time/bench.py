"""Fakes under a stopwatch; every clock and every account is the test's own."""

from collections.abc import Callable

from palpate.adapters.hardware.real_time import LateTick, Limits, SlowCore, Stopwatch, ThreadAccount
from palpate.adapters.hardware.real_time.attribution import Account
from palpate.core.control_loop import LoopObserver, next_snapshot, trial_ticks
from palpate.core.ports import JointCommand, JointSample, Ports, WrenchSample
from palpate.core.ports.contracts import FakeClock
from palpate.core.trial.report import Outcome, TrialReport, TrialSetup
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

SETUP = TrialSetup(0, 0, (0.0, 0.0))
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
    """Time goes by, by no sleep that could be woken late."""
    assert isinstance(clock, FakeClock)
    FakeClock.sleep_until(clock, clock.now_ns() + took_ns)


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
        self.ports = Ports(self.clock, self.sensor, self.encoder, self.arm)
        self.observers: tuple[LoopObserver, ...] = (self.stopwatch,)
        self.core_ns = 0

    def trial(self, ticks: int, on_tick: Callable[[int], None] = lambda tick: None) -> None:
        """The core's loop over a task that works for a while."""
        task = IdleTask()
        loop = trial_ticks(task, self.ports, SETUP, None, self.observers)  # type: ignore[arg-type]
        snapshot = next(loop, None)
        while snapshot is not None:
            work(self.clock, self.core_ns)
            on_tick(snapshot.tick)
            if snapshot.tick == ticks - 1:
                task.report.outcome = Outcome.INSERTED
            snapshot = next_snapshot(loop, JointCommand(HOME_RAD))


class IdleTask:
    """Has a report, and nothing to do."""

    def __init__(self) -> None:
        self.report = TrialReport(SETUP)

    def begin(self, setup: TrialSetup) -> None:
        pass

    def conclude(self) -> None:
        pass
