"""Faults of samples: of when one comes (loss, delay, repetition, silence), and of its values.

Samples count as plain rows of numbers here, so that one fault serves both sensor ports.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import copysign, nan
from typing import Any, Final, Generic, NamedTuple, TypeAlias

import numpy as np
from typing_extensions import override

from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.schedule import FaultMoment
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.ports import JointSample, JointVector, SampleT, Validity, WrenchSample

_NS: Final = 1_000_000_000
_Change: TypeAlias = Callable[[int, float], float]
"""Of a channel's number and value."""


def channels_of(sample: WrenchSample | JointSample) -> tuple[float, ...]:
    """Fx Fy Fz Tx Ty Tz in N and Nm, or the joint angles in rad."""
    return (*sample.force_N, *sample.torque_Nm) if isinstance(sample, WrenchSample) else sample.position_rad


def with_channels(sample: SampleT, values: Sequence[float], validity: Validity) -> SampleT:
    """The sample with other numbers and another mark."""
    if isinstance(sample, WrenchSample):
        fx, fy, fz, tx, ty, tz = values
        return replace(sample, force_N=(fx, fy, fz), torque_Nm=(tx, ty, tz), validity=validity)
    return replace(sample, position_rad=tuple(values), validity=validity)


def changed(values: JointVector, channels: Sequence[int], change: _Change) -> JointVector:
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


class Drop(SampleFault[SampleT]):
    """The new sample is lost, so the last one is still the newest."""

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        return self._required(self._last)


class Delay(SampleFault[SampleT]):
    """Every sample comes so many ticks late, with the true times of measurement and arrival.

    Without them what was shown before is shown anew at once: the sensor falls back.
    """

    def __init__(self, plan: FaultPlan, rng: np.random.Generator) -> None:
        super().__init__(plan, rng)
        self._under_way: deque[tuple[int, SampleT]] = deque()
        self._shown: deque[SampleT] = deque(maxlen=plan.delay_ticks + 1)

    @override
    def pass_by(self, sample: SampleT) -> None:
        self._last = sample
        self._shown.append(sample)
        self._under_way.clear()

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        if not self.plan.honest:
            self._shown.append(sample)
            return self._instead_of(sample, self._shown[0])
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


class Struck(NamedTuple):
    """What a change of values may depend on, besides the value itself.

    Attributes:
        held: The values of the last sample before the fault.
        lasted_ns: Since the fault began.
    """

    plan: FaultPlan
    rng: np.random.Generator
    values: tuple[float, ...]
    held: tuple[float, ...]
    lasted_ns: int


def _spike(struck: Struck) -> _Change:
    error = struck.plan.magnitude if struck.rng.random() < 0.5 else -struck.plan.magnitude
    return lambda i, value: value + error


def _swap(struck: Struck) -> _Change:
    one, other = struck.plan.channels
    return lambda i, value: struck.values[other if i == one else one]


_CHANGES: Final[dict[str, Callable[[Struck], _Change]]] = {
    # The values stand still while number and time go on.
    "freeze": lambda struck: lambda i, value: struck.held[i],
    "bias-drift": lambda struck: lambda i, value: value + struck.plan.magnitude * struck.lasted_ns / _NS,
    # White; after "freeze", that of an amplifier whose gauges are dead.
    "noise": lambda struck: lambda i, value: value + struck.plan.magnitude * float(struck.rng.standard_normal()),
    "offset": lambda struck: lambda i, value: value + struck.plan.magnitude,
    "swap": _swap,
    "spike": _spike,
    "nan": lambda struck: lambda i, value: nan,
    # The amplifier stands at its limit, on the side of the true value.
    "saturate": lambda struck: lambda i, value: copysign(struck.plan.magnitude, value),
    "unit": lambda struck: lambda i, value: struck.plan.factor * value,
}
"""What becomes of a value, by kind."""


class Changed(SampleFault[SampleT]):
    """Other values, which a device marks where it can: no sample of NaN can be made without that mark."""

    _since_ns: int | None = None

    @override
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        self._since_ns = moment.time_ns if self._since_ns is None else self._since_ns
        self._last = sample if self._last is None else self._last
        plan, values, lasted_ns = self.plan, channels_of(sample), moment.time_ns - self._since_ns
        change = _CHANGES[plan.kind](Struck(plan, self._rng, values, channels_of(self._last), lasted_ns))
        validity = Validity.INVALID if plan.kind == "nan" else sample.validity
        if plan.kind == "saturate" and plan.honest and validity is Validity.VALID:
            validity = Validity.SATURATED
        return with_channels(sample, changed(values, plan.channels, change), validity)


SAMPLE_FAULTS: Final[dict[str, type[SampleFault[Any]]]] = {
    "drop": Drop,
    "delay": Delay,
    "duplicate": Duplicate,
    "repeat": Repeat,
    "lag": Lag,
    "disconnect": Disconnect,
    **dict.fromkeys(_CHANGES, Changed),
}
"""By kind."""
