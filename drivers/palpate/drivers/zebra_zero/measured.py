"""What a cycle brings back, and what there is to say about the arm."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.drivers.nmc.frames import Aux, NmcStatus
from palpate.drivers.nmc.settings import CycleBudget
from palpate.drivers.nmc.startup import Module
from palpate.drivers.nmc.statistics import BusStatistics
from palpate.drivers.zebra_zero.counts import Six, SixCounts
from palpate.drivers.zebra_zero.settings import Applied, Streaming
from palpate.drivers.zebra_zero.states import ZebraState


@dataclass(frozen=True, slots=True)
class Measured:
    """One cycle over all axes. The axes are read one after the other, between ``begin_ns`` and ``end_ns``.

    Attributes:
        position_rad: Joint angles, (6,).
        velocity_rad_per_s: Joint velocities from the counts of this and the last complete cycle, (6,).
        counts: Counter values, (6,).
        status: NmcStatus bytes, (6,).
        aux: Auxiliary bytes, (6,); None where the reply had none.
        is_fresh: Which axes answered in this cycle; the others show their last values.
        applied: What became of the set-point; None when there was none.
        begin_ns: Clock before the first exchange.
        end_ns: Clock after the last.
    """

    position_rad: Six
    velocity_rad_per_s: Six
    counts: SixCounts
    status: tuple[NmcStatus, ...]
    aux: tuple[Aux | None, ...]
    is_fresh: tuple[bool, ...]
    applied: Applied | None
    begin_ns: int
    end_ns: int

    @property
    def time_ns(self) -> int:
        """Middle of the cycle, the best single time for the pose."""
        return (self.begin_ns + self.end_ns) // 2

    @property
    def is_complete(self) -> bool:
        """Whether every axis answered."""
        return all(self.is_fresh)


@dataclass(frozen=True, slots=True)
class ArmReport:
    """Facts about the arm for a person.

    Attributes:
        state: Where it is in its life.
        fault: The latched fault, or None.
        modules: Identity of every module.
        baud: Rate of the line.
        streaming: How set-points reach the motors.
        budget: What a cycle costs.
        wanted_rate_Hz: As in the settings.
        achieved_rate_Hz: Over the newest cycles; None before the second.
        statistics: Of the bus.
    """

    state: ZebraState
    fault: str | None
    modules: tuple[Module, ...]
    baud: int
    streaming: Streaming
    budget: CycleBudget
    wanted_rate_Hz: float
    achieved_rate_Hz: float | None
    statistics: BusStatistics
