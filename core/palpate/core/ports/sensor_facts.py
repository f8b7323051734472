"""What is known of a rig's force sensor before it is relied on: noise, range, rate and frame."""

from dataclasses import dataclass
from math import inf, isfinite

from palpate.core.errors import ConfigurationError
from palpate.core.ports.values import CONTROL_RATE_HZ, SENSOR_FRAME, Vector3

_TABLE = "force_sensor.facts"
"""Where a rig file states them."""


@dataclass(frozen=True, slots=True)
class SensorFacts:
    """Facts about a force sensor. They come from the rig: its file, its driver, the simulated cell.

    Attributes:
        noise_N: Standard deviation of one force channel while nothing changes; 0 only in a simulated cell.
        noise_Nm: Standard deviation of one torque channel; 0 only in a simulated cell.
        range_N: Largest force that it can show along each axis of its frame, (3,); infinite where there is no end.
        range_Nm: Largest torque about each axis, (3,).

    Raises:
        ConfigurationError: A value that no sensor has.
    """

    noise_N: float
    noise_Nm: float
    range_N: Vector3 = (inf, inf, inf)
    range_Nm: Vector3 = (inf, inf, inf)
    rate_Hz: float = float(CONTROL_RATE_HZ)
    frame: str = SENSOR_FRAME

    def __post_init__(self) -> None:
        for name in ("noise_N", "noise_Nm"):
            if not (isfinite(value := getattr(self, name)) and value >= 0.0):
                raise ConfigurationError(f"{_TABLE}.{name}", value, "a standard deviation, a finite number from 0 up")
        for name in ("range_N", "range_Nm"):
            if len(value := getattr(self, name)) != 3 or not all(each > 0.0 for each in value):
                raise ConfigurationError(f"{_TABLE}.{name}", value, "three numbers above 0, one an axis")
        if not (isfinite(self.rate_Hz) and self.rate_Hz > 0.0):
            raise ConfigurationError(f"{_TABLE}.rate_Hz", self.rate_Hz, "a finite number above 0")
        if not self.frame:
            raise ConfigurationError(f"{_TABLE}.frame", self.frame, "the name of a frame")
