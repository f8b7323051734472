"""Arms that stop when their commands stop coming, and that stay at rest while a trip is latched."""

import threading
from collections.abc import Callable, Sequence
from typing import Final

from typing_extensions import override

from palpate.adapters.hardware.watchdogs.process import ProcessWatchdog
from palpate.adapters.hardware.watchdogs.trip import Latch, Latching, TellTrip, WatchdogTrip, stop_surely, tell_surely
from palpate.core.errors import ConfigurationError, FaultLatchedError, LifecycleError
from palpate.core.ports import AppliedCommand, ArmCommand, Clock, CommandReason, DeviceDecorator, JointCommand, Life

_JOIN_S: Final = 1.0
_NS: Final = 1_000_000_000


class AgeWatch:
    """Calls when the last feeding is too old: at most a tenth of the limit too late.

    The thread sleeps as long as nothing can be too old, and without end while resting. The first feeding starts it.

    Args:
        clock: Gives the age. While a virtual clock stands still nothing ages.
        on_old: Is called with the age in ns, by the thread or by whoever calls ``check``; then the watch rests until it
            is fed again.
    """

    def __init__(self, name: str, clock: Clock, max_age_ns: int, on_old: Callable[[int], None]) -> None:
        if max_age_ns <= 0:
            raise ConfigurationError(f"{name}, max_age_ns", max_age_ns, "more than 0")
        self._name, self._clock, self._max_age_ns, self._on_old = name, clock, max_age_ns, on_old
        self._slack_s = max(0.1 * max_age_ns / _NS, 1e-3)
        self._wake = threading.Event()
        # One looks at a time: a second one that finished later would put an arm to rest that goes again by then.
        self._looking = threading.RLock()
        self._thread: threading.Thread | None = None
        self._fed_ns = 0
        self._watching = self._ended = False

    def feed(self) -> None:
        """It has happened; from now on it has to happen again and again."""
        self._fed_ns = self._clock.now_ns()
        if not self._watching:
            self._begin()

    def rest(self) -> None:
        """It need not happen until the next feeding. May be called by a signal handler."""
        self._watching = False

    def check(self) -> bool:
        """Look now; True if it was too old and nobody had found out before."""
        with self._looking:
            age_ns = self._clock.now_ns() - self._fed_ns
            if not self._watching or age_ns <= self._max_age_ns:
                return False
            self._on_old(age_ns)
            self._watching = False
            return True

    def end(self) -> None:
        """End the thread; allowed twice."""
        self._ended, self._watching = True, False
        self._wake.set()
        thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join(_JOIN_S)

    def _begin(self) -> None:
        if self._ended:
            raise LifecycleError(self._name, "closed", "feed()", "make a new one")
        self._watching = True
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()
        self._wake.set()

    def _run(self) -> None:
        while not self._ended:
            # Cleared first: what is set from here on ends the wait below.
            self._wake.clear()
            self.check()
            timeout_s = None
            if self._watching:
                left_ns = self._max_age_ns - (self._clock.now_ns() - self._fed_ns)
                timeout_s = max(left_ns / _NS, 0.0) + self._slack_s
            if not self._ended:
                self._wake.wait(timeout_s)


class WatchedArm(DeviceDecorator, ArmCommand):
    """Stops the arm when the newest command is too old: from a thread of its own, for the loop may be dead.

    It watches from the first command that the arm accepts until the arm is stopped, deactivated or closed. A trip stays
    until the arm is activated again.

    Args:
        arm: The arm. Its ``stop`` is called from another thread.
        max_command_age_ns: Age of the newest command at which the arm still goes on.
        tell: Is told of a trip, by the thread or by whoever sends.
    """

    def __init__(self, arm: ArmCommand, clock: Clock, max_command_age_ns: int, *, tell: TellTrip | None = None) -> None:
        super().__init__(arm)
        self._arm, self._clock, self._limit_ns, self._tell = arm, clock, max_command_age_ns, tell
        self._latch = Latch()
        self._watch = AgeWatch("command watchdog", clock, max_command_age_ns, self._too_old)

    @property
    def tripped(self) -> WatchdogTrip | None:
        """The trip, until the arm is activated again; or None."""
        return self._latch.tripped

    @override
    def activate(self) -> None:
        super().activate()
        self._latch.clear()

    @override
    def deactivate(self) -> None:
        self._watch.rest()
        super().deactivate()

    @override
    def close(self) -> None:
        self._watch.rest()
        try:
            super().close()
        finally:
            self._watch.end()

    def send(self, command: JointCommand) -> AppliedCommand:
        """A command that comes too late finds the arm stopped."""
        self._watch.check()
        was_tripped = self._latch.tripped is not None
        applied = self._arm.send(command)
        if applied.reason is CommandReason.STOPPED:
            self._watch.rest()
            return applied
        if was_tripped:
            # Somebody has activated the arm again underneath.
            self._latch.clear()
        self._watch.feed()
        return applied

    def stop(self) -> None:
        """Takes no lock, and tells nobody: a signal handler may call it."""
        self._watch.rest()
        stop_surely(self._arm)

    def _too_old(self, age_ns: int) -> None:
        trouble = stop_surely(self._arm)
        text = f"no command for {age_ns * 1e-6:.1f} ms, {self._limit_ns * 1e-6:.1f} ms are allowed{trouble}"
        trip = WatchdogTrip(self._clock.now_ns(), "command age", text)
        if self._latch.trip(trip):
            tell_surely(self._tell, trip)


class GuardedArm(DeviceDecorator, ArmCommand):
    """Neither activates nor moves the arm until every trip is acknowledged.

    Args:
        resting: Watchdogs of the loop, which rests when the arm was stopped.
    """

    def __init__(self, arm: ArmCommand, latches: Sequence[Latching], resting: Sequence[ProcessWatchdog] = ()) -> None:
        super().__init__(arm)
        self._arm, self._latches, self._resting = arm, tuple(latches), tuple(resting)

    def activate(self) -> None:
        """Activate the arm, unless a trip is latched.

        Raises:
            FaultLatchedError: Besides the arm's own: a trip waits to be acknowledged.
        """
        trip = self._tripped()
        # A request that is wrong anyway is refused by the arm, with the reason.
        if trip is not None and self._arm.life is Life.CONFIGURED:
            raise FaultLatchedError("arm", f"{trip.source}: {trip.text}")
        super().activate()

    def send(self, command: JointCommand) -> AppliedCommand:
        """While a trip is latched the arm is stopped, and says so."""
        if self._tripped() is not None:
            # Somebody may have activated it underneath since it was stopped.
            stop_surely(self._arm)
        return self._arm.send(command)

    @override
    def stop(self) -> None:
        self._arm.stop()
        for watchdog in self._resting:
            watchdog.rest()

    def _tripped(self) -> WatchdogTrip | None:
        for latch in self._latches:
            if (trip := latch.tripped) is not None:
                return trip
        return None
