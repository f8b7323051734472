"""When a fault strikes, and the account of when it did."""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from palpate.adapters.fault_injection.plan import FaultPlan
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Clock


@dataclass(frozen=True, slots=True)
class FaultDelivery:
    """A fault that was delivered. One that lasts is reported when it begins, one that strikes by chance each time.

    Attributes:
        tick: Tick of the decorated port, from 0 at its first use.
    """

    tick: int
    time_ns: int
    kind: str
    port: str
    text: str


Notify: TypeAlias = Callable[[FaultDelivery], None]


@dataclass(frozen=True, slots=True)
class FaultMoment:
    """A tick of one port.

    Attributes:
        tick: Counted from 0 at the port's first use.
    """

    tick: int
    time_ns: int


class Ticker:
    """Counts the ticks of one port: a use at a later time than the one before begins a tick."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._last_ns: int | None = None
        self._tick = 0

    def moment(self) -> FaultMoment:
        """The port is used now."""
        now_ns = self._clock.now_ns()
        if self._last_ns is not None and now_ns > self._last_ns:
            self._tick += 1
        self._last_ns = now_ns
        return FaultMoment(self._tick, now_ns)


class Schedule:
    """Whether a fault strikes in each tick, and reports of what was delivered."""

    def __init__(self, plan: FaultPlan, notify: Notify | None) -> None:
        self.plan, self._notify = plan, notify
        # Without the name, losses on two ports with the default seed would always fall on the same ticks.
        name = zlib.crc32(f"{plan.port}.{plan.kind}".encode())
        self.rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(name,)))
        self._tick: int | None = None
        self._begin: int | None = None
        self._strikes = False
        self._delivered: int | None = None

    def strikes(self, moment: FaultMoment) -> bool:
        """Whether the fault strikes in this tick; the same answer throughout the tick."""
        if moment.tick != self._tick:
            self._tick = moment.tick
            if self._begin is None and moment.tick >= self.plan.first_tick:
                self._begin = moment.tick
            self._strikes = self._lasts(moment.tick) and self._chance()
        return self._strikes

    def delivered(self, moment: FaultMoment) -> None:
        """The fault has just done something."""
        last, self._delivered = self._delivered, moment.tick
        goes_on = last is not None and moment.tick - last <= 1
        if last != moment.tick and not (goes_on and self.plan.probability >= 1.0):
            self.report(moment, self.plan.text)

    def report(self, moment: FaultMoment, text: str) -> None:
        """Report something that is worth an entry of its own."""
        if self._notify is not None:
            self._notify(FaultDelivery(moment.tick, moment.time_ns, self.plan.kind, self.plan.port, text))

    def _lasts(self, tick: int) -> bool:
        duration = self.plan.duration_ticks
        return self._begin is not None and (duration == 0 or tick - self._begin < duration)

    def _chance(self) -> bool:
        return self.plan.probability >= 1.0 or self.rng.random() < self.plan.probability


def schedules(port: str, plans: Sequence[FaultPlan], notify: Notify | None) -> list[Schedule]:
    """One schedule for each plan of a port's faults.

    Args:
        notify: Called with each delivery.

    Raises:
        ConfigurationError: A plan is for another port.
    """
    for plan in plans:
        if plan.port != port:
            raise ConfigurationError("faults.port", plan.port, f"{port}, which is what is decorated")
    return [Schedule(plan, notify) for plan in plans]
