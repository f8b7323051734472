"""What every driver of a force sensor offers: samples, and what came instead of them."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from palpate.drivers.errors import DriverError, SilentError

Vector3: TypeAlias = tuple[float, float, float]
_STALL_NS: Final = 100_000_000
"""A sensor is silent after this time without a sample."""


@dataclass(frozen=True, slots=True)
class ForceSample:
    """A reading in SI units, raw: a tool's weight is in it.

    Attributes:
        force_N: Force on the tool, (3,), in the sensor's own frame, right-handed.
        torque_Nm: Torque about its origin, (3,).
        sequence: Counts readings; always increases, also over streams and restarts.
        receive_time_ns: Clock of the poll that found it; it is older by the wait for that poll, the wire and the
            sensor's filter.
        saturated: At, or nearly at, the end of what the sensor can tell, or it says so.
        settling: The sensor's filter still swings after a start.
    """

    force_N: Vector3
    torque_Nm: Vector3
    sequence: int
    receive_time_ns: int
    saturated: bool = False
    settling: bool = False


def listed(counts: Mapping[str, int]) -> str:
    """Counters for a message; empty for none."""
    return ", ".join(f"{name} ({count})" for name, count in counts.items() if count)


class PolledSensor(ABC):
    """A driver of a force sensor.

    Args:
        remedy: What to do where it falls silent.

    Attributes:
        latest: Newest sample; None before the first one.
        failure: Why nothing is taken any more; None otherwise.
        errors: What came besides good samples, counted by what it was.
    """

    def __init__(self, name: str, remedy: str) -> None:
        self.name, self._remedy = name, remedy
        self.latest: ForceSample | None = None
        self.failure: DriverError | None = None
        self.errors: Counter[str] = Counter()
        self._errors_before: Counter[str] = Counter()
        self._polled_ns = 0

    def _is_news(self) -> None:
        """Say that a new sample has come: what is counted after it came instead of the next."""
        self._errors_before = self.errors.copy()

    def silence(self, now_ns: int) -> SilentError:
        """What came instead of news since the newest sample."""
        since = "yet" if self.latest is None else f"for {(now_ns - self.latest.receive_time_ns) * 1e-6:.0f} ms"
        came = listed(self.errors - self._errors_before)
        return SilentError(self.name, f"nothing new {since}{f', but {came}' if came else ''}", self._remedy)

    def diagnostics(self) -> dict[str, str]:
        """Return identity, settings and error counters by name; ``fault`` is what is wrong at present."""
        return {"fault": "" if self.failure is None else str(self.failure), "errors": listed(self.errors) or "none"}

    @abstractmethod
    def poll(self, now_ns: int) -> Sequence[ForceSample]:
        """Take what has arrived; new samples, oldest first. Never raises for what device or wire do: see :meth:`check`.

        Args:
            now_ns: Monotonic time in ns.
        """

    def check(self) -> None:
        """Raise what is wrong now.

        Raises:
            SilentError: Nothing comes any more; a new sample ends that by itself.
            DriverError: The ``failure``.
        """
        if self.failure is not None:
            raise self.failure
        if self.latest is not None and self._polled_ns - self.latest.receive_time_ns > _STALL_NS:
            raise self.silence(self._polled_ns)

    def acknowledge(self) -> None:
        """Forget the failure; a person's decision."""
        self.failure = None
