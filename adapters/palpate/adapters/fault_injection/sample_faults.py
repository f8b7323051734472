"""Faults of samples that change when one comes, not what it says: loss, delay, repetition, silence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from dataclasses import replace
from typing import Generic

from palpate.adapters.fault_injection.channels import SampleT
from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.adapters.fault_injection.schedule import FaultMoment
from palpate.core.errors import DeviceError


class SampleFault(ABC, Generic[SampleT]):
    """One fault on the way of the samples. Each tick it either strikes or sees the sample pass by.

    Args:
        plan: What it shall do.
    """

    def __init__(self, plan: FaultPlan) -> None:
        self.plan = plan

    def pass_by(self, sample: SampleT) -> None:
        """A tick in which it does not strike."""

    @abstractmethod
    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """A tick in which it strikes; gives the very same object when there is nothing that it could do.

        Raises:
            DeviceError: There is no sample at all.
        """

    def _required(self, sample: SampleT | None) -> SampleT:
        if sample is None:
            raise DeviceError(self.plan.port, "has not delivered a sample yet")
        return sample


class Drop(SampleFault[SampleT]):
    """The new sample is lost, so the last one is still the newest."""

    _last: SampleT | None = None

    def pass_by(self, sample: SampleT) -> None:
        """See :class:`SampleFault`."""
        self._last = sample

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        return self._required(self._last)


class Delay(SampleFault[SampleT]):
    """Every sample comes so many ticks late, and says when it was measured and when it came."""

    def __init__(self, plan: FaultPlan) -> None:
        super().__init__(plan)
        self._last: SampleT | None = None
        self._under_way: deque[tuple[int, SampleT]] = deque()

    def pass_by(self, sample: SampleT) -> None:
        """See :class:`SampleFault`."""
        self._last = sample
        self._under_way.clear()

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        self._under_way.append((moment.tick + self.plan.delay_ticks, sample))
        while self._under_way[0][0] <= moment.tick:
            self._last = replace(self._under_way.popleft()[1], receive_time_ns=moment.time_ns)
        return self._required(self._last)


class Duplicate(SampleFault[SampleT]):
    """The sample of the tick before comes once more instead of the new one; never the same one three times."""

    _last: SampleT | None = None

    def pass_by(self, sample: SampleT) -> None:
        """See :class:`SampleFault`."""
        self._last = sample

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        last, self._last = self._last, None
        if last is None:
            self._last = sample
            return sample
        return replace(last, receive_time_ns=moment.time_ns)


class Repeat(SampleFault[SampleT]):
    """The stretch of samples before the fault comes again and again."""

    def __init__(self, plan: FaultPlan) -> None:
        super().__init__(plan)
        self._stretch: deque[SampleT] = deque(maxlen=plan.span_ticks)
        self._next = 0

    def pass_by(self, sample: SampleT) -> None:
        """See :class:`SampleFault`."""
        self._stretch.append(sample)
        self._next = 0

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        if not self._stretch:
            return sample
        old = self._stretch[self._next % len(self._stretch)]
        self._next += 1
        if self.plan.honest:
            return old
        # The liar: what it said then, as if it were measured now.
        new_times = (sample.source_time_ns, sample.receive_time_ns)
        return replace(old, source_time_ns=new_times[0], receive_time_ns=new_times[1], sequence=sample.sequence)


class Disconnect(SampleFault[SampleT]):
    """The device is gone."""

    def strike(self, sample: SampleT, moment: FaultMoment) -> SampleT:
        """See :class:`SampleFault`."""
        raise DeviceError(self.plan.port, "does not answer")
