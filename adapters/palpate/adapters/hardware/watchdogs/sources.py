"""Where an operator's stop may come from: a key, a file, a socket, a signal."""

import os
import signal
import socket
import stat
import termios
import threading
import tty
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

from typing_extensions import override

from palpate.core.errors import ConfigurationError, LifecycleError


class StopSource(ABC):
    """Something that a person can do.

    Attributes:
        fd: Readable when there is something to look at; None for what must be looked at again and again.
    """

    name = ""
    fd: int | None = None

    @abstractmethod
    def open(self) -> bool:
        """Get ready; False if this source does not exist here."""

    @abstractmethod
    def look(self) -> str | None:
        """What the operator did; None if nothing. Never waits."""

    def answer(self) -> None:
        """The arm has been stopped: tell whoever asked for it."""
        # Most sources have nobody to answer to.
        return

    @abstractmethod
    def close(self) -> None:
        """Release it."""


class KeySource(StopSource):
    """Any key, pressed in the terminal, without Enter. Ctrl-C keeps its meaning.

    Args:
        terminal_fd: The terminal; nothing happens if it is none, or if we run in its background.
    """

    name = "key"

    def __init__(self, terminal_fd: int) -> None:
        self._terminal_fd = terminal_fd
        self._before: list[Any] | None = None

    @override
    def open(self) -> bool:
        if not self._is_ours():
            return False
        self._before = termios.tcgetattr(self._terminal_fd)
        tty.setcbreak(self._terminal_fd, termios.TCSANOW)
        self.fd = self._terminal_fd
        return True

    def look(self) -> str | None:
        """A terminal that is gone counts as a stop: nobody could press a key any more."""
        if self.fd is None:
            return None
        try:
            pressed = os.read(self.fd, 64)
        except OSError:
            pressed = b""
        if not pressed:
            self.fd = None
            return "the terminal is gone"
        return "a key was pressed"

    @override
    def close(self) -> None:
        before, self._before, self.fd = self._before, None, None
        if before is not None:
            with suppress(termios.error):
                # Gone terminals need no restoring.
                termios.tcsetattr(self._terminal_fd, termios.TCSANOW, before)

    def _is_ours(self) -> bool:
        try:
            if not os.isatty(self._terminal_fd):
                return False
            # Changing a terminal from its background would stop the whole process.
            return os.tcgetpgrp(self._terminal_fd) == os.getpgrp()
        except OSError:
            # A terminal, but not the one that controls us: it has no background.
            return True


class FileSource(StopSource):
    """A file that appears. As long as it is there it counts, so remove it before acknowledging.

    Its folder must be there, or nobody could make it.

    A place where nobody can look counts too: a file in there would never be found.
    """

    name = "file"

    def __init__(self, path: Path) -> None:
        self._path = path

    @override
    def open(self) -> bool:
        if not self._path.parent.is_dir():
            raise ConfigurationError("operator.file", str(self._path), "a path in a folder that is there")
        return True

    @override
    def look(self) -> str | None:
        try:
            return f"{self._path} is there" if self._path.exists() else None
        except OSError as error:
            return f"{self._path} cannot be looked for ({error.strerror})"

    def close(self) -> None:
        """The file is the operator's."""


class SocketSource(StopSource):
    """Any connection to a Unix socket; once the arm has been told, ``stopped`` comes back.

    Args:
        path: Where the socket is made; one that nobody serves any more is replaced.
    """

    name = "socket"

    def __init__(self, path: Path) -> None:
        self._path = path
        self._server: socket.socket | None = None
        self._answered: socket.socket | None = None
        self._caller: socket.socket | None = None

    @override
    def open(self) -> bool:
        server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._remove_orphan()
            server.bind(str(self._path))
            server.listen()
        except OSError as error:
            server.close()
            accepted = f"a path at which a socket can be made ({error.strerror or error})"
            raise ConfigurationError("operator.socket", str(self._path), accepted) from error
        server.setblocking(False)
        self._server, self.fd = server, server.fileno()
        return True

    @override
    def look(self) -> str | None:
        if self._server is None:
            return None
        try:
            self._caller, _ = self._server.accept()
        except (BlockingIOError, ConnectionAbortedError):
            # Gone before it was answered; it has called all the same.
            return "a connection, gone already"
        except OSError as error:
            # Nobody could be heard any more, and the caller that waits would wake the thread without end.
            self.fd = None
            return f"the socket fails ({error.strerror})"
        self._caller.setblocking(False)
        said = b""
        with suppress(OSError):
            said = self._caller.recv(80)
        words = said.decode("utf-8", "replace").strip()
        return f"a connection: {words}" if words else "a connection"

    @override
    def answer(self) -> None:
        caller, self._caller = self._caller, None
        if caller is not None:
            with suppress(OSError):
                caller.send(b"stopped\n")
                caller.shutdown(socket.SHUT_WR)
            # Words that come late must be let in: closed over them, the caller would get an error, not the answer.
            self._hang_up()
            self._answered = caller

    @override
    def close(self) -> None:
        server, self._server, self.fd = self._server, None, None
        self._hang_up()
        if server is not None:
            server.close()
            self._path.unlink(missing_ok=True)

    def _hang_up(self) -> None:
        answered, self._answered = self._answered, None
        if answered is not None:
            with answered, suppress(OSError):
                answered.recv(80)

    def _remove_orphan(self) -> None:
        """A socket that a run before left behind; anything else is left alone."""
        if not (self._path.exists() and stat.S_ISSOCK(self._path.stat().st_mode)):
            return
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
            try:
                probe.connect(str(self._path))
            except ConnectionRefusedError:
                self._path.unlink()


class StopSignal:
    """Handles one signal.

    The interpreter runs handlers in the main thread only, and not before the main thread is back from whatever it does
    in C. So the signal's number is written to a pipe as well, at the very moment, for a thread to read; unless somebody
    else, such as an event loop, uses that way already.
    """

    def __init__(self, number: int, pipe_fd: int, act: Callable[[], None]) -> None:
        self._number, self._pipe_fd, self._act = number, pipe_fd, act
        self._before: Any = None
        self._open = self._wakes = False

    def open(self) -> None:
        """Install the handler.

        Raises:
            ConfigurationError: There is no such signal, it cannot be handled, or this is not the main thread.
        """
        try:
            self._before = signal.signal(self._number, self._handle)
        except (ValueError, OSError) as error:
            accepted = f"a signal that can be handled, set up in the main thread ({error})"
            raise ConfigurationError("operator_stop.signal", self._number, accepted) from error
        self._open = True
        theirs = signal.set_wakeup_fd(self._pipe_fd, warn_on_full_buffer=False)
        self._wakes = theirs == -1
        if not self._wakes:
            signal.set_wakeup_fd(theirs)

    def close(self) -> None:
        """Put back what was there before; allowed twice.

        Raises:
            LifecycleError: This is not the main thread, which alone may do that.
        """
        if not self._open:
            return
        if threading.current_thread() is not threading.main_thread():
            raise LifecycleError("operator stop", "open", "close()", "call it in the main thread, as open()")
        self._open = False
        if self._wakes:
            signal.set_wakeup_fd(-1)
        # None: somebody's handler that is not Python's, which nobody could put back.
        signal.signal(self._number, signal.SIG_DFL if self._before is None else self._before)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self._act()
        if not self._wakes:
            with suppress(BlockingIOError):
                # A full pipe wakes as well.
                os.write(self._pipe_fd, bytes([self._number]))
