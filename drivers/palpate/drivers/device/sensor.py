"""Common parts of force sensor drivers: samples and errors."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from palpate.drivers.errors import DriverError, SilentError

Vector3: TypeAlias = tuple[float, float, float]
_STALL_NS: Final = 100_000_000
"""Time without a sample after which a sensor counts as silent."""


@dataclass(frozen=True, slots=True)
class ForceSample:
    """A raw reading in SI units, including the tool's weight.

    Attributes:
        force_N: Force on the tool, (3,), in the sensor's own frame, right-handed.
        torque_Nm: Torque about the origin of that frame, (3,).
        sequence: Number of the reading; always increases, even across streams and restarts.
        receive_time_ns: Time of the poll that received the reading. The reading itself is older: add the wait for that
            poll, the transmission time and the filter delay.
        saturated: True if the reading is at or near the limit of the sensor's range, or if the sensor flags it.
    """

    force_N: Vector3
    torque_Nm: Vector3
    sequence: int
    receive_time_ns: int
    saturated: bool = False
    settling: bool = False


def listed(counts: Mapping[str, int]) -> str:
    """Return counters as text for a message, or an empty string if there are none."""
    return ", ".join(f"{name} ({count})" for name, count in counts.items() if count)


class PolledSensor(ABC):
    """Driver for a force sensor; the error for a silent sensor includes ``remedy``.

    Attributes:
        failure: Error after which no more samples are accepted, or None if there is none.
        errors: Number of invalid messages, by kind.
    """

    def __init__(self, name: str, remedy: str) -> None:
        self.name, self._remedy = name, remedy
        self.latest: ForceSample | None = None
        self.failure: DriverError | None = None
        self.errors: Counter[str] = Counter()
        self._errors_before: Counter[str] = Counter()
        self._polled_ns = 0

    def _is_news(self) -> None:
        """Record that a sample was received; later errors are counted for the next sample."""
        self._errors_before = self.errors.copy()

    def silence(self, now_ns: int) -> SilentError:
        """Return the error for a silent sensor, with the invalid messages received since the latest sample."""
        since = "yet" if self.latest is None else f"for {(now_ns - self.latest.receive_time_ns) * 1e-6:.0f} ms"
        came = listed(self.errors - self._errors_before)
        return SilentError(self.name, f"nothing new {since}{f', but {came}' if came else ''}", self._remedy)

    def diagnostics(self) -> dict[str, str]:
        """Return the identity, settings and error counters by name; ``fault`` is the current fault."""
        return {"fault": "" if self.failure is None else str(self.failure), "errors": listed(self.errors) or "none"}

    @abstractmethod
    def poll(self, now_ns: int) -> Sequence[ForceSample]:
        """Read received data and return new samples, oldest first. :meth:`check` raises device and bus errors.

        Args:
            now_ns: Monotonic time in ns.
        """

    def check(self) -> None:
        """Raise the current error, if any.

        Raises:
            SilentError: The sensor is silent; a new sample ends this error.
            DriverError: The ``failure``.
        """
        if self.failure is not None:
            raise self.failure
        if self.latest is not None and self._polled_ns - self.latest.receive_time_ns > _STALL_NS:
            raise self.silence(self._polled_ns)

    def acknowledge(self) -> None:
        """Clear the failure. Only a person may decide to do this."""
        self.failure = None
