"""What trials run on: the four ports, and what is around them. A simulator or real devices; trials cannot tell."""

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


@dataclass(frozen=True, slots=True)
class Truth:
    """What really happened in a trial; no port carries it.

    Attributes:
        hole_in_task_m: Centre of the hole's mouth, (3,), task frame.
        tip_in_task_m: Centre of the peg's end face, (3,), task frame.
        depth_m: Depth of the tip below the plate's surface, along the hole's axis; 0 while it is above.
        peak_force_N: Largest norm of the force through the wrist over all physics steps, without the tool's weight.
        drawn: What else was drawn for this trial or its batch, by names with units; empty where nothing was.
        hole_turn_rad: Rotation vector that turns the task's axes into the hole's, (3,), rad, task frame: the plate's
            lean and the hole's yaw about its own axis.
    """

    hole_in_task_m: tuple[float, float, float]
    tip_in_task_m: tuple[float, float, float]
    depth_m: float
    peak_force_N: float
    drawn: Mapping[str, float] = field(default_factory=dict)
    hole_turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def aside_m(self) -> float:
        """Distance of the tip from the hole's axis."""
        axis = axis_of(self.hole_turn_rad)
        away = [tip - hole for tip, hole in zip(self.tip_in_task_m, self.hole_in_task_m, strict=True)]
        along = sum(a * b for a, b in zip(axis, away, strict=True))
        return hypot(*(a - along * b for a, b in zip(away, axis, strict=True)))


def axis_of(turn_rad: tuple[float, float, float]) -> tuple[float, float, float]:
    """Where a rotation vector, (3,) rad, turns the z axis: a unit vector, (3,)."""
    if not any(turn_rad):
        return 0.0, 0.0, 1.0
    angle = hypot(*turn_rad)
    x, y, z = (each / angle for each in turn_rad)
    s, c = sin(angle), cos(angle)
    return y * s + x * z * (1.0 - c), y * z * (1.0 - c) - x * s, c + z * z * (1.0 - c)


SIMULATOR: Final = "simulator"
"""The kind of world that a simulated rig is."""


@dataclass(frozen=True)
class World:
    """What the ports lead to, as far as a log records it.

    Attributes:
        kind: ``simulator``, or the name of a rig.
        facts: What it takes to set it up again for this trial, and its truth where there is one; plain JSON values.
    """

    kind: str
    facts: dict[str, Any]


class Rig(Protocol):
    """A context manager: on exit the arm is stopped and every device closed.

    Attributes:
        latch: Set by a trip or a fault of a device; while it is, no trial begins here, whoever calls.
        simulated: Whether all ports are the simulator's, so that a trip is a result and not a danger.
    """

    ports: Ports
    latch: FaultLatch
    simulated: bool = False

    @property
    @abstractmethod
    def sensor_facts(self) -> SensorFacts:
        """What is known of the force sensor; on a rig of real devices only once it is entered."""

    @abstractmethod
    def prepare(self, trial: int) -> None:
        """Make ready for a trial: what is not in the core's hands, and free the arm from its last stop."""

    def return_to_ready(self) -> None:
        """Let the next :meth:`prepare` bring the arm to the ready pose, as before the first trial.

        For whoever goes on after a trial that was stopped; a world that is set up anew for each trial need not.
        """
        return

    @abstractmethod
    def world(self) -> World:
        """What a log records of the trial that was just prepared."""

    @abstractmethod
    def truth(self) -> Truth | None:
        """What really happened, for scoring and baselines only; None where nobody knows."""

    def stopped_by(self) -> str:
        """What stopped the arm besides core and supervisor since the last :meth:`prepare`; empty for nothing."""
        return ""

    def device_behind(self, sample: str) -> str:
        """Name of the device that ``force`` or ``joint`` samples come from; empty where there is none.

        After ": " follows what its wire gave of late besides good ones, where there is something to tell.
        """
        return ""

    @property
    @abstractmethod
    def clock_ticks(self) -> int:
        """Control ticks on the clock of a world whose time can be set; 0 where it cannot."""

    @abstractmethod
    def set_clock_ticks(self, ticks: int) -> None:
        """Go on from this time, where time can be set."""

    @abstractmethod
    def __enter__(self) -> Self: ...

    @abstractmethod
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
