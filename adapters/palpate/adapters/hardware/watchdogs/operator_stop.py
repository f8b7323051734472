"""Stops the arm when a person says so: by a key, a signal, a file or a socket."""

import os
import select
import signal
import threading
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from typing_extensions import override

from palpate.adapters.hardware.watchdogs.sources import FileSource, KeySource, SocketSource, StopSignal, StopSource
from palpate.adapters.hardware.watchdogs.trip import Latch, Latching, TellTrip, WatchdogTrip, stop_surely, tell_surely
from palpate.core.errors import LifecycleError, require_in
from palpate.core.ports import ArmCommand, Clock

_JOIN_S: Final = 1.0
_WAKE: Final = b"\0"


@dataclass(frozen=True, slots=True)
class OperatorSources:
    """Where a stop may come from.

    Attributes:
        file: A file that appears; None for none.
        socket: A connection to a Unix socket at this path; None for none.
        poll_s: How often to look whether the file is there, s.
    """

    keys: bool = True
    signal_number: int | None = signal.SIGUSR1
    file: Path | None = None
    socket: Path | None = None
    poll_s: float = 0.02

    def __post_init__(self) -> None:
        require_in("operator_stop.poll_s", self.poll_s, 0.001, 1.0)


class OperatorStop(Latching):
    """The operator's stop. It latches until it is acknowledged.

    A context manager; ``open`` and ``close`` belong to the main thread as soon as a signal is among the sources.

    Args:
        arm: Is stopped, from a thread of this class or from a signal handler.
        tell: Is told which source tripped, always by the thread, never by a signal handler.
    """

    def __init__(
        self,
        arm: ArmCommand,
        clock: Clock,
        sources: OperatorSources,
        *,
        tell: TellTrip | None = None,
        terminal_fd: int = 0,
    ) -> None:
        self._arm, self._clock, self._settings, self._tell = arm, clock, sources, tell
        self._wanted: list[StopSource] = [KeySource(terminal_fd)] if sources.keys else []
        self._wanted += [FileSource(sources.file)] if sources.file is not None else []
        self._wanted += [SocketSource(sources.socket)] if sources.socket is not None else []
        self._sources: list[StopSource] = []
        self._latch = Latch()
        self._told: WatchdogTrip | None = None
        self._opened: ExitStack | None = None
        self._pipe: tuple[int, int] | None = None
        self._ended = False

    @property
    @override
    def tripped(self) -> WatchdogTrip | None:
        return self._latch.tripped

    @property
    def active(self) -> tuple[str, ...]:
        """The sources that really are there: ``key``, ``signal``, ``file``, ``socket``."""
        by_signal = ("signal",) if self._settings.signal_number is not None and self._opened is not None else ()
        return (*(source.name for source in self._sources), *by_signal)

    def open(self) -> None:
        """Open the sources and watch them.

        Raises:
            ConfigurationError: A source cannot be had.
            LifecycleError: It is open, or was.
        """
        if self._opened is not None or self._ended:
            raise LifecycleError("operator stop", "open or closed", "open()", "make a new one")
        with ExitStack() as opened:
            read_fd, write_fd = os.pipe()
            opened.callback(os.close, read_fd)
            opened.callback(os.close, write_fd)
            os.set_blocking(read_fd, False)
            os.set_blocking(write_fd, False)
            # Released last to first: signals before the thread, and the thread before what it looks at.
            opened.callback(self._forget)
            for source in self._wanted:
                if source.open():
                    opened.callback(source.close)
                    self._sources.append(source)
            self._pipe = (read_fd, write_fd)
            thread = threading.Thread(target=self._run, args=(read_fd,), name="operator stop", daemon=True)
            thread.start()
            opened.callback(thread.join, _JOIN_S)
            opened.callback(self._end_thread)
            number = self._settings.signal_number
            if number is not None:
                handled = StopSignal(number, write_fd, self._on_signal)
                handled.open()
                opened.callback(handled.close)
            self._opened = opened.pop_all()

    def close(self) -> None:
        """Release everything; allowed twice.

        Raises:
            LifecycleError: There is a signal among the sources and this is not the main thread.
        """
        opened, self._opened = self._opened, None
        if opened is not None:
            self._require_may_close(opened)
            opened.close()
        self._ended = True

    def stop(self, text: str = "from the program") -> None:
        """WatchdogTrip, as an operator would. May be called at any time, from any thread and from a signal handler."""
        self._trip("program", text)
        self._wake()

    def acknowledge(self) -> None:
        """Clear the trip; a person's decision. A file that is still there trips again."""
        self._latch.clear()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _require_may_close(self, opened: ExitStack) -> None:
        if self._settings.signal_number is not None and threading.current_thread() is not threading.main_thread():
            self._opened = opened
            raise LifecycleError("operator stop", "open", "close()", "call it in the main thread, as open()")

    def _trip(self, source: str, text: str) -> None:
        """Stop first, then latch; no lock, for a signal handler comes this way."""
        trouble = stop_surely(self._arm)
        self._latch.trip(WatchdogTrip(self._clock.now_ns(), source, text + trouble))

    def _on_signal(self) -> None:
        self._trip("signal", self._signal_text())

    def _signal_text(self) -> str:
        return f"signal {signal.Signals(self._settings.signal_number or 0).name}"

    def _wake(self) -> None:
        pipe = self._pipe
        if pipe is not None:
            with suppress(BlockingIOError):
                # A full pipe wakes as well.
                os.write(pipe[1], _WAKE)

    def _forget(self) -> None:
        self._pipe = None
        self._sources.clear()

    def _end_thread(self) -> None:
        self._ended = True
        self._wake()

    def _run(self, read_fd: int) -> None:
        poller = select.poll()
        poller.register(read_fd, select.POLLIN)
        for source in self._sources:
            if source.fd is not None:
                poller.register(source.fd, select.POLLIN)
        polls = any(source.fd is None for source in self._sources)
        timeout_ms = self._settings.poll_s * 1e3 if polls else None
        while not self._ended:
            ready = {fd for fd, _ in poller.poll(timeout_ms)}
            if read_fd in ready:
                self._read_pipe(read_fd)
            for source in self._sources:
                self._look(source, ready, poller)
            self._tell_news()

    def _read_pipe(self, read_fd: int) -> None:
        number = self._settings.signal_number
        # Numbers of other signals come here as well: they are no business of ours.
        if number is not None and number in os.read(read_fd, 4096) and self._latch.tripped is None:
            self._trip("signal", self._signal_text())

    def _look(self, source: StopSource, ready: set[int], poller: select.poll) -> None:
        fd = source.fd
        # A file is there until somebody removes it, and one stop is enough for that.
        wanted = self._latch.tripped is None if fd is None else fd in ready
        text = source.look() if wanted else None
        if text is not None:
            self._trip(source.name, text)
            source.answer()
        if fd is not None and source.fd is None:
            # Readable for ever, and nothing to read.
            poller.unregister(fd)

    def _tell_news(self) -> None:
        trip = self._latch.tripped
        if trip is not None and trip is not self._told:
            self._told = trip
            tell_surely(self._tell, trip)
