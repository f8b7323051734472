"""Sensors and a clock with faults, and all four ports together."""

from collections.abc import Callable, Sequence
from typing import ClassVar, Final, Generic

from typing_extensions import override

from palpate.adapters.fault_injection.arm import FaultyArm
from palpate.adapters.fault_injection.plan import PORTS, FaultPlan
from palpate.adapters.fault_injection.sample_faults import SAMPLE_FAULTS, SampleFault, aged
from palpate.adapters.fault_injection.schedule import FaultMoment, Notify, Schedule, Ticker, schedules
from palpate.core.errors import DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    Clock,
    DeviceDecorator,
    ForceSensor,
    JointEncoder,
    JointSample,
    Ports,
    SampleT,
    Sensor,
    WrenchSample,
)

MAX_AGE_NS: Final = 5 * 1_000_000_000 // CONTROL_RATE_HZ
"""Age above which a sample that a fault holds back is marked ``STALE``, unless another is given: five ticks."""


class _Line(Generic[SampleT]):
    """The way of the samples of one port, past its faults in the order of the plans."""

    def __init__(
        self, port: str, clock: Clock, plans: Sequence[FaultPlan], notify: Notify | None, max_age_ns: int
    ) -> None:
        self._ticker, self._max_age_ns = Ticker(clock), max_age_ns
        self._stages: list[tuple[Schedule, SampleFault[SampleT]]] = [
            (schedule, SAMPLE_FAULTS[schedule.plan.kind](schedule.plan, schedule.rng))
            for schedule in schedules(port, plans, notify)
        ]
        self._tick: int | None = None
        self._outcome: SampleT | DeviceError | None = None

    def past(self, fresh: SampleT) -> SampleT:
        """What is read instead of the device's own sample; the same again within a tick."""
        if not self._stages:
            return fresh
        moment = self._ticker.moment()
        if moment.tick != self._tick or self._outcome is None:
            self._tick = moment.tick
            self._outcome = self._struck(fresh, moment)
        if isinstance(self._outcome, DeviceError):
            raise self._outcome
        return self._outcome

    def _struck(self, fresh: SampleT, moment: FaultMoment) -> SampleT | DeviceError:
        sample = fresh
        for schedule, fault in self._stages:
            if not schedule.strikes(moment):
                fault.pass_by(sample)
                continue
            before = sample
            try:
                sample = fault.strike(before, moment)
            except DeviceError as error:
                schedule.delivered(moment)
                return error
            if sample is not before:
                schedule.delivered(moment)
        # What no fault has touched stays as the device marked it.
        return sample if sample is fresh else aged(sample, moment.time_ns, self._max_age_ns)


class _FaultySensor(DeviceDecorator, Generic[SampleT]):
    """A sensor with faults.

    Args:
        plans: Its faults; the first is next to the device.
        max_age_ns: Age above which a sample that a fault holds back is marked ``STALE``.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    PORT: ClassVar[str]

    def __init__(
        self,
        sensor: Sensor[SampleT],
        clock: Clock,
        plans: Sequence[FaultPlan],
        notify: Notify | None = None,
        *,
        max_age_ns: int = MAX_AGE_NS,
    ) -> None:
        self._line: _Line[SampleT] = _Line(self.PORT, clock, plans, notify, max_age_ns)
        super().__init__(sensor)
        self._read: Callable[[], SampleT] = sensor.read

    def read(self) -> SampleT:
        """What is read instead of the device's own sample."""
        return self._line.past(self._read())


class FaultyForceSensor(_FaultySensor[WrenchSample], ForceSensor):
    """A force sensor with faults."""

    PORT = "force_sensor"


class FaultyJointEncoder(_FaultySensor[JointSample], JointEncoder):
    """Joint encoders with faults."""

    PORT = "joint_encoder"


def faulty(
    ports: Ports, plans: Sequence[FaultPlan], notify: Notify | None = None, *, max_age_ns: int = MAX_AGE_NS
) -> Ports:
    """The four ports, decorated. Decorate anew for each trial: ticks count from the first use.

    The rig keeps the plain ports and leads their lives; the trial runs over the decorated ones.

    Args:
        plans: Faults of any of them; those of one port meet what passes in this order.
        max_age_ns: Age above which a sample that a fault holds back is marked ``STALE``.
    """
    own = {port: [plan for plan in plans if plan.port == port] for port in PORTS}
    clock = ports.clock
    return Ports(
        FaultyClock(clock, own["clock"], notify),
        FaultyForceSensor(ports.force_sensor, clock, own["force_sensor"], notify, max_age_ns=max_age_ns),
        FaultyJointEncoder(ports.joint_encoder, clock, own["joint_encoder"], notify, max_age_ns=max_age_ns),
        FaultyArm(ports.arm, clock, own["arm"], notify),
    )


_NS: Final = 1_000_000_000


class FaultyClock(Clock):
    """A clock with faults. A sleep begins a tick; faults come at its end.

    A jump backwards is what the contract of the port forbids: instead, the clock stands still until time has caught up.

    Args:
        notify: Called with each delivery; times are those of ``clock``.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    def __init__(self, clock: Clock, plans: Sequence[FaultPlan], notify: Notify | None = None) -> None:
        self._clock, self._schedules = clock, schedules("clock", plans, notify)
        self._tick = -1
        self._offset_ns = 0
        self._floor_ns: int | None = None
        self._jumped: set[int] = set()

    @override
    def now_ns(self) -> int:
        shown_ns = self._clock.now_ns() + self._offset_ns
        if self._floor_ns is not None:
            shown_ns = max(shown_ns, self._floor_ns)
        self._floor_ns = shown_ns
        return shown_ns

    @override
    def sleep_until(self, deadline_ns: int) -> None:
        if not self._schedules:
            self._clock.sleep_until(deadline_ns)
            return
        if self.now_ns() < deadline_ns:
            self._clock.sleep_until(deadline_ns - self._offset_ns)
        self._tick += 1
        moment = FaultMoment(self._tick, self._clock.now_ns())
        for number, schedule in enumerate(self._schedules):
            strikes = schedule.strikes(moment)
            if schedule.plan.kind == "clock-jump":
                self._jump(number, schedule, moment, strikes)
            elif strikes:
                self._clock.sleep_until(self._clock.now_ns() + round(schedule.plan.time_s * _NS))
                schedule.delivered(moment)

    def _jump(self, number: int, schedule: Schedule, moment: FaultMoment, strikes: bool) -> None:
        if strikes == (number in self._jumped):
            return
        self._jumped ^= {number}
        # The present time is shown first, so that none later can be before it.
        self.now_ns()
        jump_ns = round(schedule.plan.time_s * _NS) * (1 if strikes else -1)
        self._offset_ns += jump_ns
        back = ", which a clock may not: it stands still until then" if jump_ns < 0 else ""
        schedule.report(moment, f"time jumps by {jump_ns / _NS:+g} s{back}")
