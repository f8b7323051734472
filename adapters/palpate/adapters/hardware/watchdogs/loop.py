"""Stops the arm when the control loop is dead."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from palpate.adapters.hardware.watchdogs.age_watch import AgeWatch
from palpate.adapters.hardware.watchdogs.trip import Latch, Latching, TellTrip, WatchdogTrip, stop_surely, tell_surely
from palpate.core.ports.devices import ArmCommand, Clock


class LoopWatchdog(Latching):
    """Must be fed each tick; otherwise a thread stops the arm. The trip latches.

    It watches from the first feeding, and rests between trials when told so. For a loop that hangs with the whole
    interpreter there is :class:`palpate.adapters.hardware.watchdogs.process.ProcessWatchdog`.

    Args:
        arm: Is stopped, from another thread.
        clock: Real time, or the run's.
        timeout_ns: Longest time between feedings.
        tell: Is told of a trip, by the thread.
    """

    def __init__(self, arm: ArmCommand, clock: Clock, timeout_ns: int, *, tell: TellTrip | None = None) -> None:
        self._arm, self._clock, self._timeout_ns, self._tell = arm, clock, timeout_ns, tell
        self._latch = Latch()
        self._watch = AgeWatch("loop watchdog", clock, timeout_ns, self._starved)

    @property
    def tripped(self) -> WatchdogTrip | None:
        """See :class:`Latching`."""
        return self._latch.tripped

    def feed(self) -> None:
        """The loop lives. After a trip this changes nothing.

        Raises:
            LifecycleError: The watchdog is closed.
        """
        if self._latch.tripped is None and not self._watch.check():
            self._watch.feed()

    def rest(self) -> None:
        """Nobody need feed until the next feeding: the trial is over."""
        self._watch.rest()

    def acknowledge(self) -> None:
        """Clear the trip; a person's decision. Watching goes on with the next feeding."""
        self._latch.clear()

    def close(self) -> None:
        """End the thread; allowed twice."""
        self._watch.end()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _starved(self, age_ns: int) -> None:
        trouble = stop_surely(self._arm)
        text = f"no tick for {age_ns * 1e-6:.1f} ms, {self._timeout_ns * 1e-6:.1f} ms are allowed{trouble}"
        trip = WatchdogTrip(self._clock.now_ns(), "loop", text)
        if self._latch.trip(trip):
            tell_surely(self._tell, trip)
