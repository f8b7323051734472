"""How late is too late, and what is told of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from palpate.adapters.realtime.config import RealTimeConfig
from palpate.adapters.timing.attribution import Attribution


@dataclass(frozen=True, slots=True)
class Limits:
    """Thresholds, looked at in every tick; 0 stands for never.

    Attributes:
        warn_late_ns: A tick that begins later than this after its time is told.
        stop_late_ns: One that begins later than this ends the run.
        warn_core_ns: A tick in which the core thought for longer than this is told.
        warm_up_ticks: Ticks at the start to which nothing of this applies.
    """

    warn_late_ns: int = 0
    stop_late_ns: int = 0
    warn_core_ns: int = 0
    warm_up_ticks: int = 0

    @classmethod
    def of(cls, config: RealTimeConfig) -> Self:
        """The limits of a configuration."""
        late, stop, core = (round(ms * 1e6) for ms in (config.warn_late_ms, config.stop_late_ms, config.warn_core_ms))
        return cls(late, stop, core, config.warm_up_ticks)


@dataclass(frozen=True, slots=True)
class LateTick:
    """A tick that began too late.

    Attributes:
        tick: Counts the ticks that were timed, from 0.
        time_ns: When it began, run clock.
        late_ns: How late.
        attribution: Whose fault.
    """

    tick: int
    time_ns: int
    late_ns: int
    attribution: Attribution

    def __str__(self) -> str:
        return (
            f"tick {self.tick} at {self.time_ns * 1e-9:.3f} s began {self.late_ns * 1e-6:.2f} ms late:"
            f" {self.attribution.cause.value} ({self.attribution})"
        )


@dataclass(frozen=True, slots=True)
class SlowCore:
    """A tick in which the core thought for too long.

    Attributes:
        tick: Counts the ticks that were timed, from 0.
        core_ns: How long.
    """

    tick: int
    core_ns: int

    def __str__(self) -> str:
        return f"tick {self.tick}: the core took {self.core_ns * 1e-6:.2f} ms"
