"""Common parts of arm drivers: life cycle, set-point limits, and measured poses."""

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
"""Tolerance for rounding, so that a step of exactly the maximum length is accepted."""


def require_angles(requested_rad: Sequence[float], joints: int) -> tuple[float, ...]:
    """Check a set-point and return it as floats.

    Raises:
        RefusedError: The number of angles is wrong, or one is not finite.
    """
    requested = tuple(map(float, requested_rad))
    if len(requested) != joints or not all(map(isfinite, requested)):
        raise RefusedError("arm", f"{requested} are not {joints} finite angles", "correct the caller; nothing was sent")
    return requested


def clamped(
    requested_rad: Sequence[float], lower_rad: Sequence[float], upper_rad: Sequence[float]
) -> tuple[float, ...]:
    """Return joint angles limited to the position limits, (n,)."""
    limits = zip(requested_rad, lower_rad, upper_rad, strict=True)
    return tuple(min(max(angle, lower), upper) for angle, lower, upper in limits)


def held_back(
    within_rad: Sequence[float], previous_rad: Sequence[float], most_rad: Sequence[float]
) -> tuple[float, ...]:
    """Return a set-point in which every joint's step is limited, (n,).

    All steps are reduced by the same factor, so the arm keeps its direction in joint space.

    Args:
        within_rad: Requested set-point, already within the position limits, (n,).
        previous_rad: Previous set-point, (n,).
        most_rad: Maximum step for each joint, (n,).
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
    """Measurements from one bus cycle.

    Attributes:
        position_rad: Joint angles, (n,); the last known angle for an axis that did not answer.
        time_ns: Measurement time on the driver's clock.
    """

    position_rad: tuple[float, ...]
    time_ns: int


class ArmState(enum.Enum):
    """States in the life cycle of an arm with its own controller or drives."""

    NEW = "new"
    CONFIGURED = "configured"
    ENABLED = "enabled"
    STOPPED = "stopped"
    FAULTED = "faulted"
    CLOSED = "closed"


class ArmDriver(Protocol):
    """Driver for an arm, for use by a single thread.

    An error while the arm is enabled stops the arm and is latched: each cycle raises it again until it is acknowledged.

    Raises:
        StateError: Raised by any request made in the wrong state or with a joint outside its limits.
        RefusedError: Raised by ``cycle`` if the number of angles is wrong or one is not finite; nothing was sent.
        SettingError, WiringError: Raised by ``open`` if the device is missing, differs from the configuration or has
            different settings.
        SilentError, GarbledError: The bus, or a device on it, is silent or sends invalid data.
        DeviceFaultError: A device reports a fault, or a pose is not allowed.
    """

    @property
    def notes(self) -> tuple[str, ...]:
        """Return the functions that the arm lacks, and their substitutes; known after ``open``."""
        return ()

    @property
    def is_faulted(self) -> bool:
        """True if a fault must be acknowledged."""
        return False

    @abstractmethod
    def open(self) -> None:
        """Find the arm on its bus and read its pose, without switching power on."""

    @abstractmethod
    def enable(self) -> None:
        """Engage the servos to hold the arm in its current pose."""

    @abstractmethod
    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        """Run one bus cycle; None holds the pose. Set-points are limited; a stopped arm ignores them."""

    def diagnostics(self) -> dict[str, str]:
        """Return the identity, state and error counters by name; ``fault`` is the current fault."""
        return {}

    @abstractmethod
    def stop(self) -> None:
        """Stop the arm. May be called at any time and repeatedly; never raises."""

    @abstractmethod
    def disable(self) -> None:
        """Undo ``enable``."""

    @abstractmethod
    def acknowledge(self) -> None:
        """Clear a fault. Only a person may decide to do this."""

    @abstractmethod
    def close(self) -> None:
        """Stop, and end all communication; never raises. The caller closes the bus."""


class LatchingArm(ArmDriver):
    """An arm that, on any communication error, stops and latches the fault.

    Attributes:
        fault: The latched fault, or None.
        setpoint_rad: Set-point of an enabled arm, within the limits, (n,).
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
        """The arm's state in its life cycle."""
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
        """Stop the arm on any error in the context, and latch the fault until it is acknowledged."""
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
