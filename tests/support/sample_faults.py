"""Faults between a sensor and its reader: what a reader gets instead of the samples that were measured."""

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import replace
from math import copysign, nan
from typing import NamedTuple

import numpy as np

from palpate.core.errors import DeviceError
from palpate.core.ports import Validity, WrenchSample

_NS = 1_000_000_000


def channels_of(sample):
    """Return Fx Fy Fz Tx Ty Tz in N and Nm, or the joint angles in rad."""
    return (*sample.force_N, *sample.torque_Nm) if isinstance(sample, WrenchSample) else sample.position_rad


def with_channels(sample, values, validity):
    if isinstance(sample, WrenchSample):
        fx, fy, fz, tx, ty, tz = values
        return replace(sample, force_N=(fx, fy, fz), torque_Nm=(tx, ty, tz), validity=validity)
    return replace(sample, position_rad=tuple(values), validity=validity)


def changed(values, channels, change):
    """Return the values with a change made to some of them, or to all where no channels are given."""
    chosen = channels or range(len(values))
    return tuple(change(i, value) if i in chosen else value for i, value in enumerate(values))


class SampleFault(ABC):
    """A fault between a sensor and its reader; each tick it either strikes or lets the sample pass."""

    def __init__(self, plan, rng):
        self.plan, self._rng = plan, rng
        self._last = None

    def pass_by(self, sample):
        self._last = sample

    @abstractmethod
    def strike(self, sample, moment):
        """Return the sample that is read instead; the same object if there is nothing to change."""

    def _required(self, sample):
        if sample is None:
            raise DeviceError(self.plan.port, "has not delivered a sample yet")
        return sample

    def _instead_of(self, sample, old):
        """Return an older sample, with the number and times of the new measurement if the fault is not honest."""
        if self.plan.honest:
            return old
        new_times = (sample.source_time_ns, sample.receive_time_ns)
        return replace(old, source_time_ns=new_times[0], receive_time_ns=new_times[1], sequence=sample.sequence)


class Drop(SampleFault):
    """The new sample is lost."""

    def strike(self, sample, moment):
        return self._required(self._last)


class Delay(SampleFault):
    """Every sample comes late, with its true times; if not honest, the sensor falls back at once instead."""

    def __init__(self, plan, rng):
        super().__init__(plan, rng)
        self._under_way = deque()
        self._shown = deque(maxlen=plan.delay_ticks + 1)

    def pass_by(self, sample):
        self._last = sample
        self._shown.append(sample)
        self._under_way.clear()

    def strike(self, sample, moment):
        if not self.plan.honest:
            self._shown.append(sample)
            return self._instead_of(sample, self._shown[0])
        self._under_way.append((moment.tick + self.plan.delay_ticks, sample))
        while self._under_way[0][0] <= moment.tick:
            self._last = replace(self._under_way.popleft()[1], receive_time_ns=moment.time_ns)
        return self._required(self._last)


class Duplicate(SampleFault):
    """The previous sample comes again instead of the new one; never the same one three times."""

    def strike(self, sample, moment):
        last, self._last = self._last, None
        if last is None:
            self._last = sample
            return sample
        return replace(last, receive_time_ns=moment.time_ns)


class Repeat(SampleFault):
    """The samples before the fault come again and again."""

    def __init__(self, plan, rng):
        super().__init__(plan, rng)
        self._stretch = deque(maxlen=plan.span_ticks)
        self._next = 0

    def pass_by(self, sample):
        self._stretch.append(sample)
        self._next = 0

    def strike(self, sample, moment):
        if not self._stretch:
            return sample
        old = self._stretch[self._next % len(self._stretch)]
        self._next += 1
        return self._instead_of(sample, old)


class Lag(SampleFault):
    """Samples come later and later, as through a buffer that fills."""

    def __init__(self, plan, rng):
        super().__init__(plan, rng)
        self._under_way = deque()
        self._since_ns = None

    def pass_by(self, sample):
        self._last, self._since_ns = sample, None
        self._under_way.clear()

    def strike(self, sample, moment):
        if self._since_ns is None:
            self._since_ns = moment.time_ns
        late_ns = round(self.plan.time_s * (moment.time_ns - self._since_ns))
        self._under_way.append(sample)
        while self._under_way and self._under_way[0].source_time_ns + late_ns <= moment.time_ns:
            self._last = replace(self._under_way.popleft(), receive_time_ns=moment.time_ns)
        return self._instead_of(sample, self._required(self._last))


class Disconnect(SampleFault):
    """The device is gone."""

    def strike(self, sample, moment):
        raise DeviceError(self.plan.port, "does not answer")


class Struck(NamedTuple):
    """Inputs of a change of values, in addition to the value itself."""

    plan: object
    rng: np.random.Generator
    values: tuple[float, ...]
    held: tuple[float, ...]
    lasted_ns: int


def _spike(struck):
    error = struck.plan.magnitude if struck.rng.random() < 0.5 else -struck.plan.magnitude
    return lambda i, value: value + error


def _swap(struck):
    one, other = struck.plan.channels
    return lambda i, value: struck.values[other if i == one else one]


_CHANGES = {
    "freeze": lambda struck: lambda i, value: struck.held[i],
    "bias-drift": lambda struck: lambda i, value: value + struck.plan.magnitude * struck.lasted_ns / _NS,
    # After "freeze": the noise of an amplifier whose gauges are dead.
    "noise": lambda struck: lambda i, value: value + struck.plan.magnitude * float(struck.rng.standard_normal()),
    "offset": lambda struck: lambda i, value: value + struck.plan.magnitude,
    "swap": _swap,
    "spike": _spike,
    "nan": lambda struck: lambda i, value: nan,
    "saturate": lambda struck: lambda i, value: copysign(struck.plan.magnitude, value),
    "unit": lambda struck: lambda i, value: struck.plan.factor * value,
}


class Changed(SampleFault):
    """Other values, marked where a device would mark them."""

    _since_ns = None

    def strike(self, sample, moment):
        self._since_ns = moment.time_ns if self._since_ns is None else self._since_ns
        self._last = sample if self._last is None else self._last
        plan, values, lasted_ns = self.plan, channels_of(sample), moment.time_ns - self._since_ns
        change = _CHANGES[plan.kind](Struck(plan, self._rng, values, channels_of(self._last), lasted_ns))
        validity = Validity.INVALID if plan.kind == "nan" else sample.validity
        if plan.kind == "saturate" and plan.honest and validity is Validity.VALID:
            validity = Validity.SATURATED
        return with_channels(sample, changed(values, plan.channels, change), validity)


SAMPLE_FAULTS = {
    "drop": Drop,
    "delay": Delay,
    "duplicate": Duplicate,
    "repeat": Repeat,
    "lag": Lag,
    "disconnect": Disconnect,
    **dict.fromkeys(_CHANGES, Changed),
}
