"""The rig used for a trial: the four ports and their surroundings, simulated or real."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos, hypot, inf, isfinite, sin
from types import TracebackType
from typing import Any, Final, Protocol, Self

from palpate.core.errors import ConfigurationError
from palpate.core.ports.devices import Ports
from palpate.core.ports.latch import FaultLatch
from palpate.core.ports.values import CONTROL_RATE_HZ, SENSOR_FRAME, Vector3

_TABLE = "force_sensor.facts"
"""Name of the rig file table with facts about the force sensor."""


@dataclass(frozen=True, slots=True)
class SensorFacts:
    """Facts about a force sensor, from the rig file, the driver or the simulated cell.

    Attributes:
        noise_N: Standard deviation of one force channel under constant load; 0 only in a simulated cell.
        noise_Nm: Standard deviation of one torque channel; 0 only in a simulated cell.
        range_N: Maximum measurable force along each axis of its frame, (3,); infinite if unlimited.
        range_Nm: Maximum torque about each axis, (3,).

    Raises:
        ConfigurationError: A value is impossible for a sensor.
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
                raise ConfigurationError(f"{_TABLE}.{name}", value, "three numbers above 0, one per axis")
        if not (isfinite(self.rate_Hz) and self.rate_Hz > 0.0):
            raise ConfigurationError(f"{_TABLE}.rate_Hz", self.rate_Hz, "a finite number above 0")
        if not self.frame:
            raise ConfigurationError(f"{_TABLE}.frame", self.frame, "the name of a frame")


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """Ground truth for a trial, which no port provides.

    Attributes:
        hole_in_task_m: Centre of the hole's mouth, (3,), task frame.
        tip_in_task_m: Centre of the peg's end face, (3,), task frame.
        depth_m: Tip depth below the plate's surface, along the hole's axis; 0 while it is above.
        peak_force_N: Maximum norm of the force through the wrist over all physics steps, excluding the tool's weight.
        drawn: Other quantities drawn at random for this trial or its batch, by name with unit.
        hole_turn_rad: Rotation vector that rotates the task's axes onto the hole's, (3,), rad, task frame: plate
            tilt and hole yaw.
    """

    hole_in_task_m: tuple[float, float, float]
    tip_in_task_m: tuple[float, float, float]
    depth_m: float
    peak_force_N: float
    drawn: Mapping[str, float] = field(default_factory=dict)
    hole_turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def aside_m(self) -> float:
        """Distance from the tip to the hole's axis."""
        axis = axis_of(self.hole_turn_rad)
        away = [tip - hole for tip, hole in zip(self.tip_in_task_m, self.hole_in_task_m, strict=True)]
        along = sum(a * b for a, b in zip(axis, away, strict=True))
        return hypot(*(a - along * b for a, b in zip(away, axis, strict=True)))


def axis_of(turn_rad: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the z axis, a unit vector, (3,), after a rotation by a rotation vector, (3,) rad."""
    if not any(turn_rad):
        return 0.0, 0.0, 1.0
    angle = hypot(*turn_rad)
    x, y, z = (each / angle for each in turn_rad)
    s, c = sin(angle), cos(angle)
    return y * s + x * z * (1.0 - c), y * z * (1.0 - c) - x * s, c + z * z * (1.0 - c)


SIMULATOR: Final = "simulator"
"""World kind for a simulated rig."""


@dataclass(frozen=True)
class WorldRecord:
    """Record of the world behind the ports, for the log.

    Attributes:
        kind: ``simulator``, or a rig's name.
        facts: Plain JSON values that reproduce the world for this trial, with the ground truth if there is one.
    """

    kind: str
    facts: dict[str, Any]


class Rig(Protocol):
    """A rig, used as a context manager that stops the arm and closes every device on exit.

    Attributes:
        latch: Fault latch, set by a trip or a device fault; while it is set, no trial begins on this rig.
        simulated: True if all ports belong to the simulator, in which a trip is a result, not a danger.
    """

    ports: Ports
    latch: FaultLatch
    simulated: bool = False

    @property
    @abstractmethod
    def sensor_facts(self) -> SensorFacts:
        """Return the facts about the force sensor; with real devices, only after the rig has been entered."""

    @abstractmethod
    def prepare(self, trial: int) -> None:
        """Set up everything outside the core for a trial, and release the arm from its last stop."""

    @abstractmethod
    def world(self) -> WorldRecord:
        """Return the world record for the log of the trial just prepared."""

    @abstractmethod
    def truth(self) -> GroundTruth | None:
        """Return the ground truth (for scoring and baselines only), or None if unknown."""

    def move(self, config: Any, ready: Any) -> None:
        """Move to another place at the next :meth:`prepare`.

        Args:
            config: Configuration for the next trials.
            ready: Ready pose for those trials.

        Raises:
            ConfigurationError: The rig has only one place.
        """
        raise ConfigurationError("place.further_mm", "further places", "left out: this rig has one place")

    def stopped_by(self) -> str:
        """Return the external cause of any stop since the last :meth:`prepare`; empty if there is none."""
        return ""

    def device_behind(self, sample: str) -> str:
        """Return the name of the device that provides ``force`` or ``joint`` samples; empty if there is none.

        Any recent connection errors follow after ": ".
        """
        return ""

    @property
    @abstractmethod
    def clock_ticks(self) -> int:
        """Return the clock's time in control ticks, or 0 if the clock cannot be set."""

    @abstractmethod
    def set_clock_ticks(self, ticks: int) -> None:
        """Set the clock to the given time, if possible."""

    @abstractmethod
    def __enter__(self) -> Self: ...

    @abstractmethod
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
