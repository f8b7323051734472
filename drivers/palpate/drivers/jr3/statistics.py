"""What a health check wants to know about the sensor and its wire."""

from __future__ import annotations

from dataclasses import dataclass

from palpate.drivers.jr3.messages import FullScales
from palpate.drivers.jr3.transport import WireCounts


@dataclass(frozen=True, slots=True)
class Identity:
    """All by which a board can be told from another. FACT: the protocol has neither serial number nor version.

    Attributes:
        name: The wire, and the node on it.
        full_scales: Of the sensor.
        cutoff_Hz: Cut-off of the filter as the board is told, 0 = unfiltered.
        period_us: Time between readings as the board is told.
    """

    name: str
    full_scales: FullScales
    cutoff_Hz: float
    period_us: int


@dataclass(frozen=True, slots=True)
class Jr3Statistics:
    """Counters since the driver was made.

    Attributes:
        wire: What the wire has seen.
        samples: Samples given out.
        rate_Hz: Rate of the newest samples; 0 when there are fewer than two.
        duplicates: Readings with the counter of the one before.
        doubted: Readings dropped because their counter fitted nothing before.
        gaps: How often readings were missing.
        missed: How many.
        restarts: How often the frame counter went back without our asking.
        boots: How often the board said that it has started.
        unasked: Readings that came while no stream was ours.
        zero_readings: All-zero readings dropped after a zeroing.
        timeouts: Requests not answered in time.
        strays: Acknowledgements that answered nothing.
        round_trip_min_ms: Fastest answer; None before the first one. As coarse as the polling.
        round_trip_median_ms: Usual answer.
        round_trip_max_ms: Slowest answer.
    """

    wire: WireCounts
    samples: int
    rate_Hz: float
    duplicates: int
    doubted: int
    gaps: int
    missed: int
    restarts: int
    boots: int
    unasked: int
    zero_readings: int
    timeouts: int
    strays: int
    round_trip_min_ms: float | None
    round_trip_median_ms: float | None
    round_trip_max_ms: float | None
