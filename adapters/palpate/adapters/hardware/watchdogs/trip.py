"""What a watchdog says when it trips, and how a trip latches without a lock."""

from abc import abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, Protocol, TypeAlias

from palpate.core.ports import ArmCommand


@dataclass(frozen=True, slots=True)
class WatchdogTrip:
    """A watchdog has tripped.

    Attributes:
        source: What tripped: ``command age``, ``loop``, ``key``, ``signal``, ``file``, ``socket``, ...
    """

    time_ns: int
    source: str
    text: str


TellTrip: TypeAlias = Callable[[WatchdogTrip], None]


class Latching(Protocol):
    """Whatever keeps its trip until a person acknowledges it."""

    @property
    @abstractmethod
    def tripped(self) -> WatchdogTrip | None:
        """The trip, or None."""


class Latch:
    """Keeps the first trip. No lock: a signal handler may interrupt any of it."""

    _KEY: Final = "trip"

    def __init__(self) -> None:
        self._kept: dict[str, WatchdogTrip] = {}

    @property
    def tripped(self) -> WatchdogTrip | None:
        """The first trip since the last acknowledgement, or None."""
        return self._kept.get(self._KEY)

    def trip(self, trip: WatchdogTrip) -> bool:
        """Keep a trip; True if it is the first."""
        # One step for the interpreter, so two threads cannot both be first.
        return self._kept.setdefault(self._KEY, trip) is trip

    def clear(self) -> None:
        """Forget the trip; a person's decision."""
        self._kept.clear()


def tell_surely(tell: TellTrip | None, trip: WatchdogTrip) -> None:
    """Tell whoever wants to know; if that fails, the watch goes on."""
    if tell is not None:
        with suppress(Exception):
            tell(trip)


def stop_surely(arm: ArmCommand) -> str:
    """Stop an arm that may be gone already; empty, or why it could not be told, to be added to the account."""
    try:
        arm.stop()
    except Exception as error:
        # The contract forbids it, a stranger's arm may do it all the same, and a watchdog must live on.
        return f"; stop() failed: {error!r}"
    return ""
