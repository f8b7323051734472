"""What every driver of a force sensor offers: samples, and what came instead of them."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from palpate.drivers.device.account import Account, listed
from palpate.drivers.errors import DriverError, SilentError

Vector3: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class ForceSample:
    """A reading in SI units, raw: a tool's weight is in it.

    Attributes:
        force_N: Force on the tool, (3,), in the sensor's own frame, right-handed.
        torque_Nm: Torque about its origin, (3,).
        sequence: Counts readings; always increases, also over streams and restarts.
        receive_time_ns: Clock of the poll that found it; it is older by the wait for that poll, the wire and the
            sensor's filter.
        over_range: Beyond the rated range of an axis, where the calibration ends.
        near_saturated: Nearly at the end of what the converter can tell; treat as saturated.
        saturated: At its end, or the sensor says so.
        settling: The sensor's filter still swings after a start.
    """

    force_N: Vector3
    torque_Nm: Vector3
    sequence: int
    receive_time_ns: int
    over_range: bool = False
    near_saturated: bool = False
    saturated: bool = False
    settling: bool = False


class PolledSensor(ABC):
    """A driver of a force sensor.

    Attributes:
        latest: Newest sample; None before the first one.
        failure: Why nothing is taken any more; None otherwise.
    """

    def __init__(self) -> None:
        self.latest: ForceSample | None = None
        self.failure: DriverError | None = None
        self._account = Account()

    @abstractmethod
    def silence(self, now_ns: int) -> SilentError:
        """What came instead of news since the newest sample."""

    def oddities(self, now_ns: int) -> str:
        """What came in the last second besides good samples; empty for nothing."""
        return listed(self._account.lately(now_ns))

    def diagnostics(self, now_ns: int) -> dict[str, str]:
        """Return identity, settings and error counters by name; ``fault`` is what is wrong at present."""
        fault = "" if self.failure is None else str(self.failure)
        return {"fault": fault, "errors in the last second": self.oddities(now_ns) or "none"}

    @abstractmethod
    def poll(self, now_ns: int) -> Sequence[ForceSample]:
        """Take what has arrived; new samples, oldest first. Never raises for what device or wire do: see :meth:`check`.

        Args:
            now_ns: Monotonic time in ns.
        """

    @abstractmethod
    def check(self) -> None:
        """Raise what is wrong now.

        Raises:
            SilentError: Nothing comes any more; a new sample ends that by itself.
            DriverError: The ``failure``.
        """

    def acknowledge(self) -> None:
        """Forget the failure; a person's decision."""
        self.failure = None
