"""Faults of samples: of when one comes (loss, delay, repetition, silence), and of its values.

Samples count as plain rows of numbers here, so that one fault serves both sensor ports.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import copysign, nan
from typing import Any, Final, Generic

import numpy as np
from typing_extensions import override

from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.schedule import FaultMoment
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.ports import JointSample, JointVector, SampleT, Validity, WrenchSample

_NS: Final = 1_000_000_000


def channels_of(sample: WrenchSample | JointSample) -> tuple[float, ...]:
    """Fx Fy Fz Tx Ty Tz in N and Nm, or the joint angles in rad."""
    return (*sample.force_N, *sample.torque_Nm) if isinstance(sample, WrenchSample) else sample.position_rad


def with_channels(sample: SampleT, values: Sequence[float], validity: Validity) -> SampleT:
    """The sample with other numbers and another mark."""
    if isinstance(sample, WrenchSample):
        fx, fy, fz, tx, ty, tz = values
        return replace(sample, force_N=(fx, fy, fz), torque_Nm=(tx, ty, tz), validity=validity)
    return replace(sample, position_rad=tuple(values), validity=validity)


def changed(values: JointVector, channels: Sequence[int], change: Callable[[int, float], float]) -> JointVector:
    """The values with a change made to some of them."""
    if channels and max(channels) >= len(values):
        raise ConfigurationError("faults.channels", tuple(channels), f"numbers from 0 to {len(values) - 1}")
    chosen = channels or range(len(values))
    return tuple(change(i, value) if i in chosen else value for i, value in enumerate(values))


def aged(sample: SampleT, now_ns: int, max_age_ns: int) -> SampleT:
    """The sample, marked ``STALE`` if it is over age and nothing worse."""
    over_age = now_ns - sample.source_time_ns > max_age_ns
    return replace(sample, validity=Validity.STALE) if over_age and sample.validity is not Validity.INVALID else sample


class SampleFault(ABC, Generic[SampleT]):
    """One fault on the way of the samples; each tick it either strikes or the sample passes by."""

    def __init__(self, plan: FaultPlan, rng: np.random.Generator) -> None:
        self.plan, self._rng = plan, rng
        self._last: SampleT | None = None

    def pass_by(self, sample: SampleT) -> None:
        """A tick in which it does not strike, and this is the last sample."""
        self._last = sample

    @abstractmethod
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """A tick in which it strikes; gives the very same object when there is nothing that it could do."""

    def _required(self, sample: SampleT | None) -> SampleT:
        if sample is None:
            raise DeviceError(self.plan.port, "has not delivered a sample yet")
        return sample

    def _instead_of(self, sample: SampleT, old: SampleT) -> SampleT:
        """An older sample: as it was, or with the number and the times of the new measurement."""
        if self.plan.honest:
            return old
        new_times = (sample.source_time_ns, sample.receive_time_ns)
        return replace(old, source_time_ns=new_times[0], receive_time_ns=new_times[1], sequence=sample.sequence)

    def _changed(
        self, sample: SampleT, change: Callable[[int, float], float], validity: Validity | None = None
    ) -> SampleT:
        values = changed(channels_of(sample), self.plan.channels, change)
        return with_channels(sample, values, sample.validity if validity is None else validity)


class Drop(SampleFault[SampleT]):
    """The new sample is lost, so the last one is still the newest."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        return self._required(self._last)


class Delay(SampleFault[SampleT]):
    """Every sample comes so many ticks late, with the true times of measurement and arrival."""

    def __init__(self, plan: FaultPlan, rng: np.random.Generator) -> None:
        super().__init__(plan, rng)
        self._under_way: deque[tuple[int, SampleT]] = deque()

    @override
    def pass_by(self, sample: SampleT) -> None:
        self._last = sample
        self._under_way.clear()

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        self._under_way.append((moment.tick + self.plan.delay_ticks, sample))
        while self._under_way[0][0] <= moment.tick:
            self._last = replace(self._under_way.popleft()[1], receive_time_ns=moment.time_ns)
        return self._required(self._last)


class Duplicate(SampleFault[SampleT]):
    """The sample of the tick before comes once more instead of the new one; never the same one three times."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        last, self._last = self._last, None
        if last is None:
            self._last = sample
            return sample
        return replace(last, receive_time_ns=moment.time_ns)


class Repeat(SampleFault[SampleT]):
    """The stretch of samples before the fault comes again and again."""

    def __init__(self, plan: FaultPlan, rng: np.random.Generator) -> None:
        super().__init__(plan, rng)
        self._stretch: deque[SampleT] = deque(maxlen=plan.span_ticks)
        self._next = 0

    @override
    def pass_by(self, sample: SampleT) -> None:
        self._stretch.append(sample)
        self._next = 0

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        if not self._stretch:
            return sample
        old = self._stretch[self._next % len(self._stretch)]
        self._next += 1
        return self._instead_of(sample, old)


class Lag(SampleFault[SampleT]):
    """Samples come later and later, as through a buffer that fills."""

    def __init__(self, plan: FaultPlan, rng: np.random.Generator) -> None:
        super().__init__(plan, rng)
        self._under_way: deque[SampleT] = deque()
        self._since_ns: int | None = None

    @override
    def pass_by(self, sample: SampleT) -> None:
        self._last, self._since_ns = sample, None
        self._under_way.clear()

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        if self._since_ns is None:
            self._since_ns = moment.time_ns
        late_ns = round(self.plan.time_s * (moment.time_ns - self._since_ns))
        self._under_way.append(sample)
        while self._under_way and self._under_way[0].source_time_ns + late_ns <= moment.time_ns:
            self._last = replace(self._under_way.popleft(), receive_time_ns=moment.time_ns)
        return self._instead_of(sample, self._required(self._last))


class Disconnect(SampleFault[SampleT]):
    """The device is gone."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        raise DeviceError(self.plan.port, "does not answer")


class Freeze(SampleFault[SampleT]):
    """The values stand still while number and time go on."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        if self._last is None:
            self._last = sample
        held = channels_of(self._last)
        return self._changed(sample, lambda i, value: held[i])


class BiasDrift(SampleFault[SampleT]):
    """An error that grows with the time since the fault began."""

    _since_ns: int | None = None

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        if self._since_ns is None:
            self._since_ns = moment.time_ns
        bias = self.plan.magnitude * (moment.time_ns - self._since_ns) / _NS
        return self._changed(sample, lambda i, value: value + bias)


class Noise(SampleFault[SampleT]):
    """White noise on top of the values; after ``freeze``, that of an amplifier whose gauges are dead."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        return self._changed(sample, lambda i, value: value + self.plan.magnitude * float(self._rng.standard_normal()))


class Offset(SampleFault[SampleT]):
    """A constant error, such as a turn that an encoder has lost."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        return self._changed(sample, lambda i, value: value + self.plan.magnitude)


class Swap(SampleFault[SampleT]):
    """Two wires exchanged."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        values, (one, other) = channels_of(sample), self.plan.channels
        return self._changed(sample, lambda i, value: values[other if i == one else one])


class Spike(SampleFault[SampleT]):
    """An error of a single tick, up or down by chance."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        error = self.plan.magnitude if self._rng.random() < 0.5 else -self.plan.magnitude
        return self._changed(sample, lambda i, value: value + error)


class NotANumber(SampleFault[SampleT]):
    """Not a number, and marked ``INVALID``: no sample of NaN can be made without that mark."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        return self._changed(sample, lambda i, value: nan, Validity.INVALID)


class Saturate(SampleFault[SampleT]):
    """The amplifier stands at its limit, on the side of the true value."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        limit = self.plan.magnitude
        marked = self.plan.honest and sample.validity is Validity.VALID
        return self._changed(
            sample, lambda i, value: copysign(limit, value), Validity.SATURATED if marked else sample.validity
        )


class WrongUnit(SampleFault[SampleT]):
    """The numbers are those of another unit."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        factor = self.plan.factor
        return self._changed(sample, lambda i, value: factor * value)


SAMPLE_FAULTS: Final[dict[str, type[SampleFault[Any]]]] = {
    "drop": Drop,
    "delay": Delay,
    "duplicate": Duplicate,
    "freeze": Freeze,
    "repeat": Repeat,
    "bias-drift": BiasDrift,
    "noise": Noise,
    "offset": Offset,
    "swap": Swap,
    "lag": Lag,
    "spike": Spike,
    "nan": NotANumber,
    "saturate": Saturate,
    "unit": WrongUnit,
    "disconnect": Disconnect,
}
"""By kind."""
