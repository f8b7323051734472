"""Another process that acts when this one no longer ticks, and the clock that feeds it."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from contextlib import suppress
from typing import Final, Self

from typing_extensions import override

from palpate.adapters.hardware.watchdogs.process_main import ACKNOWLEDGED, FED, QUIT, READY, RESTING, TRIPPED
from palpate.adapters.hardware.watchdogs.trip import Latch, Latching, TellTrip, WatchdogTrip, stop_surely, tell_surely
from palpate.core.errors import ConfigurationError, LifecycleError, require_in
from palpate.core.ports import ArmCommand, Clock


class WatchedClock(Clock):
    """Feeds at the end of each sleep, which is where a tick begins; so a loop over the ports need not call it."""

    def __init__(self, clock: Clock, watchdog: ProcessWatchdog) -> None:
        self._clock, self._watchdog = clock, watchdog

    @override
    def now_ns(self) -> int:
        return self._clock.now_ns()

    @override
    def sleep_until(self, deadline_ns: int) -> None:
        self._clock.sleep_until(deadline_ns)
        self._watchdog.feed()


_START_S: Final = 60.0
_END_S: Final = 5.0


class ProcessWatchdog(Latching):
    """Must be fed each tick; otherwise another process acts. The trip latches.

    That process cannot call the arm's ``stop``. It sends a signal to this one, for which
    :class:`palpate.adapters.hardware.watchdogs.operator_stop.OperatorStop` has a handler, and it calls a function that
    reaches the arm on a way of its own, such as a second connection to its drives. If this process has died, only the
    function is left.

    Args:
        arm: Is stopped by this process too, if it lives, and if the other one has died.
        clock: The run's clock; for trips only, the other process measures real time.
        timeout_s: Longest time between feedings, s.
        stop_function: ``package.module:function`` that brings the arm to rest; empty for none.
        signal_number: Signal for this process; 0 for none. Without a handler, SIGUSR1 ends a process.
        tell: Is told of a trip, by whoever feeds or asks.
    """

    def __init__(
        self,
        arm: ArmCommand,
        clock: Clock,
        timeout_s: float,
        *,
        stop_function: str = "",
        signal_number: int = signal.SIGUSR1,
        tell: TellTrip | None = None,
    ) -> None:
        require_in("watchdog.timeout_s", timeout_s, 0.001, 3600.0)
        self._arm, self._clock, self._timeout_s, self._tell = arm, clock, timeout_s, tell
        self._stop_function, self._signal_number = stop_function, signal_number
        self._latch = Latch()
        self._process: subprocess.Popen[bytes] | None = None

    @property
    @override
    def tripped(self) -> WatchdogTrip | None:
        self._hear()
        return self._latch.tripped

    def open(self) -> None:
        """Start the process and wait until it watches.

        Raises:
            ConfigurationError: It cannot call the function.
            LifecycleError: It runs already.
        """
        if self._process is not None:
            raise LifecycleError("process watchdog", "open", "open()", "close it first")
        settings = [str(self._timeout_s), str(os.getpid()), str(int(self._signal_number)), self._stop_function]
        command = [sys.executable, "-m", "palpate.adapters.hardware.watchdogs.process_main", *settings]
        # Unbuffered pipes, and a group of its own: Ctrl-C in the terminal is not for it.
        process = subprocess.Popen(
            command, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
        )
        self._process = process
        for pipe in self._pipes(process):
            os.set_blocking(pipe, False)
        if not self._is_ready(process):
            self.close()
            accepted = "package.module:function that can be imported"
            raise ConfigurationError("watchdog.stop_function", self._stop_function, accepted)

    def feed(self) -> None:
        """The loop lives. After a trip this changes nothing.

        Raises:
            LifecycleError: It is not open.
        """
        self._hear()
        if self._latch.tripped is None:
            self._say(FED)

    def rest(self) -> None:
        """Nobody need feed until the next feeding: the trial is over."""
        self._say(RESTING)

    def acknowledge(self) -> None:
        """Clear the trip; a person's decision. Watching goes on with the next feeding."""
        self._hear()
        self._latch.clear()
        self._say(ACKNOWLEDGED)

    def close(self) -> None:
        """End the process; allowed twice."""
        process, self._process = self._process, None
        if process is None:
            return
        feeding, reports = process.stdin, process.stdout
        try:
            os.write(self._pipes(process)[0], QUIT)
            process.wait(_END_S)
        except (OSError, subprocess.TimeoutExpired):
            # It has died, or hangs in its function.
            process.kill()
            with suppress(subprocess.TimeoutExpired):
                process.wait(_END_S)
        finally:
            for pipe in (feeding, reports):
                if pipe is not None:
                    pipe.close()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _is_ready(self, process: subprocess.Popen[bytes]) -> bool:
        reports = self._pipes(process)[1]
        deadline_s = time.monotonic() + _START_S
        while (left_s := deadline_s - time.monotonic()) > 0.0:
            if select.select([reports], [], [], left_s)[0]:
                return os.read(reports, 1) == READY
        return False

    def _hear(self) -> None:
        """Take what the other process reports; never waits."""
        if self._process is None:
            return
        try:
            said = os.read(self._pipes(self._process)[1], 64)
        except BlockingIOError:
            return
        if TRIPPED in said:
            self._trip(f"no tick for {self._timeout_s * 1e3:.1f} ms")
        elif not said:
            self._trip("the watchdog process has died")

    def _say(self, word: bytes) -> None:
        process = self._process
        if process is None:
            raise LifecycleError("process watchdog", "not open", "feed()", "open() it first")
        try:
            os.write(self._pipes(process)[0], word)
        except OSError:
            # Closed, or full because nobody reads: nobody watches any more.
            self._trip("the watchdog process does not listen")

    def _trip(self, text: str) -> None:
        if self._latch.tripped is not None:
            return
        trip = WatchdogTrip(self._clock.now_ns(), "loop process", text + stop_surely(self._arm))
        if self._latch.trip(trip):
            tell_surely(self._tell, trip)

    @staticmethod
    def _pipes(process: subprocess.Popen[bytes]) -> tuple[int, int]:
        """Descriptors for feeding and for reports."""
        if process.stdin is None or process.stdout is None:
            raise LifecycleError("process watchdog", "without pipes", "feed()", "open() it")
        return process.stdin.fileno(), process.stdout.fileno()
