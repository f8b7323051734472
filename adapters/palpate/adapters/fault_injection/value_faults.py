"""Faults of samples that change what one says: frozen, drifting, spiking, saturated, not finite, in another unit."""

from __future__ import annotations

from math import copysign, nan
from typing import Final

import numpy as np

from palpate.adapters.fault_injection.channels import SampleT, changed, channels_of, with_channels
from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.sample_faults import SampleFault
from palpate.adapters.fault_injection.schedule import FaultMoment
from palpate.core.ports.values import Validity

_NS: Final = 1_000_000_000


class Freeze(SampleFault[SampleT]):
    """The values stand still while number and time go on: a sensor that lies."""

    _held: tuple[float, ...] | None = None

    def pass_by(self, sample: SampleT) -> None:
        """See :class:`SampleFault`."""
        self._held = channels_of(sample)

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        if self._held is None:
            self._held = channels_of(sample)
        held = self._held
        values = changed(channels_of(sample), self.plan.channels, lambda i, value: held[i])
        return with_channels(sample, values, sample.validity)


class BiasDrift(SampleFault[SampleT]):
    """An error that grows with the time since the fault began."""

    _since_ns: int | None = None

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        if self._since_ns is None:
            self._since_ns = moment.time_ns
        bias = self.plan.magnitude * (moment.time_ns - self._since_ns) / _NS
        values = changed(channels_of(sample), self.plan.channels, lambda i, value: value + bias)
        return with_channels(sample, values, sample.validity)


class Spike(SampleFault[SampleT]):
    """An error of a single tick, up or down by chance.

    Args:
        plan: What it shall do.
        rng: Throws the coin.
    """

    def __init__(self, plan: FaultPlan, rng: np.random.Generator) -> None:
        super().__init__(plan)
        self._rng = rng

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        error = self.plan.magnitude if self._rng.random() < 0.5 else -self.plan.magnitude
        values = changed(channels_of(sample), self.plan.channels, lambda i, value: value + error)
        return with_channels(sample, values, sample.validity)


class NotANumber(SampleFault[SampleT]):
    """Not a number, and marked ``INVALID``: no sample of NaN can be made without that mark."""

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        values = changed(channels_of(sample), self.plan.channels, lambda i, value: nan)
        return with_channels(sample, values, Validity.INVALID)


class Saturate(SampleFault[SampleT]):
    """The amplifier stands at its limit, on the side of the true value."""

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        limit = self.plan.magnitude
        values = changed(channels_of(sample), self.plan.channels, lambda i, value: copysign(limit, value))
        marked = self.plan.honest and sample.validity is Validity.VALID
        return with_channels(sample, values, Validity.SATURATED if marked else sample.validity)


class WrongUnit(SampleFault[SampleT]):
    """The numbers are those of another unit."""

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        factor = self.plan.factor
        values = changed(channels_of(sample), self.plan.channels, lambda i, value: factor * value)
        return with_channels(sample, values, sample.validity)
