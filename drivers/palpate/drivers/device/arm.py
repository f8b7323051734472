"""What every driver of an arm offers: a life cycle, limited set-points and poses."""

import contextlib
import enum
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Final, Protocol

from typing_extensions import override

from palpate.drivers.errors import DeviceFaultError, DriverError, RefusedError, StateError

_SLACK: Final = 1e-11
"""A step of exactly the greatest length must not be called too long for its rounding error."""


def require_angles(asked_rad: Sequence[float], joints: int) -> tuple[float, ...]:
    """The set-point as floats.

    Raises:
        RefusedError: A wrong number of angles, or one is not finite.
    """
    asked = tuple(map(float, asked_rad))
    if len(asked) != joints or not all(map(isfinite, asked)):
        raise RefusedError("arm", f"{asked} are not {joints} finite angles", "correct the caller; nothing was sent")
    return asked


def clamped(asked_rad: Sequence[float], lower_rad: Sequence[float], upper_rad: Sequence[float]) -> tuple[float, ...]:
    """Joint angles within the position limits, (n,)."""
    limits = zip(asked_rad, lower_rad, upper_rad, strict=True)
    return tuple(min(max(angle, lower), upper) for angle, lower, upper in limits)


def held_back(
    within_rad: Sequence[float], previous_rad: Sequence[float], most_rad: Sequence[float]
) -> tuple[float, ...]:
    """A set-point of which no joint goes further than so much, (n,).

    All joints are held back by the same share, so the arm keeps its direction in joint space.

    Args:
        within_rad: What is wanted, within the position limits, (n,).
        previous_rad: Set-point before, (n,).
        most_rad: How far each joint can go in time, (n,).
    """
    share = 1.0
    for target, start, most in zip(within_rad, previous_rad, most_rad, strict=True):
        step = abs(target - start)
        if step > most * (1.0 + _SLACK):
            share = min(share, most / step)
    if share == 1.0:
        return tuple(within_rad)
    return tuple(start + share * (target - start) for start, target in zip(previous_rad, within_rad, strict=True))


@dataclass(frozen=True, slots=True)
class Measured:
    """What one cycle of the bus found.

    Attributes:
        position_rad: Joint angles, (n,); where an axis did not answer, its last one.
        time_ns: When the angles were measured, on the driver's clock.
    """

    position_rad: tuple[float, ...]
    time_ns: int


class ArmState(enum.Enum):
    """Where in its life an arm is that a controller or drives of its own hold."""

    NEW = "new"
    CONFIGURED = "configured"
    ENABLED = "enabled"
    STOPPED = "stopped"
    FAULTED = "faulted"
    CLOSED = "closed"


class ArmDriver(Protocol):
    """A driver of an arm, for one thread.

    What fails while it is enabled stops the arm and is latched: each cycle raises it again until it is acknowledged.

    Raises:
        StateError: By any request that is out of order, or that finds a joint outside its limits.
        RefusedError: By ``cycle``: a wrong number of angles, or one is not finite; nothing was sent.
        SettingError, WiringError: By ``open``: no device is there, or another one, or it is set up otherwise.
        SilentError, GarbledError: The bus, or a device on it, fell silent or makes no sense.
        DeviceFaultError: A fault is reported, or a pose is where it may not be.
    """

    @property
    def notes(self) -> tuple[str, ...]:
        """What the arm lacks, and what is done instead; known once it is open."""
        return ()

    @property
    def is_faulted(self) -> bool:
        """Whether a fault waits to be acknowledged."""
        return False

    @abstractmethod
    def open(self) -> None:
        """Find the arm on its bus and establish where it is; nothing gets power."""

    @abstractmethod
    def enable(self) -> None:
        """Let the servos hold the arm where it stands."""

    @abstractmethod
    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """One cycle of the bus; None holds. A set-point is held to the limits; a stopped arm takes none."""

    def diagnostics(self) -> dict[str, str]:
        """Return identity, state and error counters by name; ``fault`` is what is wrong at present."""
        return {}

    @abstractmethod
    def stop(self) -> None:
        """Bring the arm to rest; at any time, twice too, never raising."""

    @abstractmethod
    def disable(self) -> None:
        """End what ``enable`` began."""

    @abstractmethod
    def acknowledge(self) -> None:
        """Clear a fault; a person's decision."""

    @abstractmethod
    def close(self) -> None:
        """Stop, and end all traffic; never raising. The caller closes the bus."""


class LatchingArm(ArmDriver):
    """An arm that is stopped, and keeps its fault, on every way out of a conversation that is not the good one.

    Attributes:
        fault: Why the arm stopped for good, or None.
        setpoint_rad: Where an enabled arm is led, within the limits, (n,).
    """

    def __init__(self) -> None:
        self.fault: str | None = None
        self.setpoint_rad: tuple[float, ...] = ()
        self._state = ArmState.NEW

    @override
    def diagnostics(self) -> dict[str, str]:
        return {"state": self._state.value, "fault": self.fault or ""}

    @property
    def state(self) -> ArmState:
        """Where in its life the arm is."""
        return self._state

    @property
    @override
    def is_faulted(self) -> bool:
        return self._state is ArmState.FAULTED

    @override
    def disable(self) -> None:
        self._require("disable()", ArmState.CONFIGURED, ArmState.ENABLED, ArmState.STOPPED)
        self.stop()
        if not self.is_faulted:
            self._state = ArmState.CONFIGURED

    def _require(self, request: str, *states: ArmState) -> None:
        if self._state in states:
            return
        if self._state is ArmState.FAULTED:
            raise DeviceFaultError("arm", f"{request} refused, a fault is latched: {self.fault}", "acknowledge it")
        wanted = " or ".join(state.value for state in states)
        raise StateError("arm", f"{request} while it is {self._state.value}", f"it has to be {wanted}")

    def _require_fault(self) -> None:
        if self._state is not ArmState.FAULTED:
            raise StateError("arm", f"there is no fault to acknowledge while it is {self._state.value}", "go on")

    @contextlib.contextmanager
    def _latching(self) -> Iterator[None]:
        """Stop on every way out that is not the good one, and keep a fault until it is acknowledged."""
        try:
            yield
        except DriverError as error:
            self._fail(error)
            self.stop()
            raise
        except BaseException:
            self.stop()
            raise

    def _fail(self, error: DriverError) -> None:
        self._state, self.fault = ArmState.FAULTED, str(error)
