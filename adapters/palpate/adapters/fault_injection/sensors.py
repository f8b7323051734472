"""Sensor ports with faults."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, Generic

import numpy as np

from palpate.adapters.fault_injection.channels import aged
from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.sample_faults import Delay, Disconnect, Drop, Duplicate, Repeat, SampleFault
from palpate.adapters.fault_injection.schedule import FaultAccount, FaultDelivery, FaultMoment, Schedule, Tell, Ticker
from palpate.adapters.fault_injection.value_faults import BiasDrift, Freeze, NotANumber, Saturate, Spike, WrongUnit
from palpate.core.errors import DeviceError
from palpate.core.ports.decorator import SampleT, SensorDecorator
from palpate.core.ports.devices import Clock, ForceSensor, JointEncoder
from palpate.core.ports.values import CONTROL_RATE_HZ, JointSample, WrenchSample

MAX_AGE_NS: Final = 5 * 1_000_000_000 // CONTROL_RATE_HZ
"""Age above which a sample that a fault holds back is marked ``STALE``, unless another is given: five ticks."""

_FAULTS: Final[dict[str, Callable[[FaultPlan, np.random.Generator], SampleFault[Any]]]] = {
    "drop": lambda plan, rng: Drop(plan),
    "delay": lambda plan, rng: Delay(plan),
    "duplicate": lambda plan, rng: Duplicate(plan),
    "freeze": lambda plan, rng: Freeze(plan),
    "repeat": lambda plan, rng: Repeat(plan),
    "bias-drift": lambda plan, rng: BiasDrift(plan),
    "spike": Spike,
    "nan": lambda plan, rng: NotANumber(plan),
    "saturate": lambda plan, rng: Saturate(plan),
    "unit": lambda plan, rng: WrongUnit(plan),
    "disconnect": lambda plan, rng: Disconnect(plan),
}


class _Line(Generic[SampleT]):
    """The way of the samples of one port, past its faults in the order of the plans."""

    def __init__(self, port: str, clock: Clock, plans: Sequence[FaultPlan], tell: Tell | None, max_age_ns: int) -> None:
        self.account = FaultAccount(tell)
        self._ticker, self._max_age_ns = Ticker(clock), max_age_ns
        self._stages: list[tuple[Schedule, SampleFault[SampleT]]] = [
            (schedule, _FAULTS[schedule.plan.kind](schedule.plan, schedule.rng))
            for schedule in self.account.schedules(port, plans)
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


class _FaultySensor(SensorDecorator[SampleT]):
    _line: _Line[SampleT]

    @property
    def deliveries(self) -> list[FaultDelivery]:
        """What was delivered so far."""
        return self._line.account.deliveries


class FaultyForceSensor(_FaultySensor[WrenchSample], ForceSensor):
    """A force sensor with faults.

    Args:
        sensor: The sensor.
        clock: The run's clock.
        plans: Its faults; the first is next to the device.
        tell: Is told of each delivery.
        max_age_ns: Age above which a sample that a fault holds back is marked ``STALE``.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    def __init__(
        self,
        sensor: ForceSensor,
        clock: Clock,
        plans: Sequence[FaultPlan],
        tell: Tell | None = None,
        *,
        max_age_ns: int = MAX_AGE_NS,
    ) -> None:
        self._line = _Line[WrenchSample]("force_sensor", clock, plans, tell, max_age_ns)
        super().__init__(sensor, sensor.read, self._line.past)


class FaultyJointEncoder(_FaultySensor[JointSample], JointEncoder):
    """Joint encoders with faults.

    Args:
        encoder: The encoders.
        clock: The run's clock.
        plans: Their faults; the first is next to the device.
        tell: Is told of each delivery.
        max_age_ns: Age above which a sample that a fault holds back is marked ``STALE``.

    Raises:
        ConfigurationError: A plan is for another port.
    """

    def __init__(
        self,
        encoder: JointEncoder,
        clock: Clock,
        plans: Sequence[FaultPlan],
        tell: Tell | None = None,
        *,
        max_age_ns: int = MAX_AGE_NS,
    ) -> None:
        self._line = _Line[JointSample]("joint_encoder", clock, plans, tell, max_age_ns)
        super().__init__(encoder, encoder.read, self._line.past)
