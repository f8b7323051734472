"""Server for an emulated controller on this computer's sockets, at Universal Robots' standard ports."""

import select
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final, Self

from palpate.simulation.emulators.ur.controller import CYCLE_NS, UrController
from palpate.simulation.emulators.ur.session import RtdeSession

DASHBOARD_PORT, SCRIPT_PORT, RTDE_PORT = 29999, 30003, 30004
_GREETING: Final = b"Connected: Universal Robots Dashboard Server\n"
_ADDRESSES: Final = 60
_QUIET_NS: Final = 20_000_000
"""Time without data after which a script counts as complete."""
_HOPELESS: Final = 1 << 20
"""Number of unread bytes above which the server disconnects a client, as the controller does."""


class _Connection:
    """A connection with its received bytes and its outgoing bytes."""

    def __init__(self, connection: socket.socket, session: RtdeSession | None = None) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket, self.session = connection, session
        self.arrived, self.waiting, self.heard_ns, self.is_over = b"", b"", 0, False

    def receive(self, now_ns: int) -> None:
        try:
            data = self.socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self.is_over |= not data
        self.arrived, self.heard_ns = self.arrived + data, now_ns

    def send(self, data: bytes) -> None:
        self.waiting += data
        try:
            self.waiting = self.waiting[self.socket.send(self.waiting) :] if self.waiting else b""
        except BlockingIOError:
            self.is_over |= len(self.waiting) > _HOPELESS
        except OSError:
            self.is_over = True

    def close(self) -> None:
        self.socket.close()
        if self.session is not None:
            self.session.close()


class UrServer:
    """Context manager with a thread that serves and steps a controller.

    Attributes:
        host: First address from 127.0.0.1 to 127.0.0.60 whose ports are free.
        network: Filter for data packages; set it to drop, truncate or repeat packages.
        is_unplugged: True to break existing connections and refuse new ones.
    """

    def __init__(self, controller: UrController, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.host, self.is_unplugged = "", False
        self.network: Callable[[bytes], bytes] = lambda data: data
        self._controller, self._clock_ns, self._lock, self._end = controller, clock_ns, threading.Lock(), False
        self._listeners: dict[int, socket.socket] = {}
        self._lines: dict[int, list[_Connection]] = {}
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        candidates = [f"127.0.0.{i}" for i in range(1, _ADDRESSES + 1)]
        for host in candidates:
            with suppress(OSError):
                self._listen(host)
                break
        if not self._listeners:
            raise OSError(f"ports {DASHBOARD_PORT}, {SCRIPT_PORT} and {RTDE_PORT} are taken at {', '.join(candidates)}")
        self._end = False
        self._thread = threading.Thread(target=self._serve, name="UR emulator", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end = True
        if self._thread is not None:
            self._thread.join()
        self._hang_up()

    @contextmanager
    def exclusive(self) -> Iterator[UrController]:
        """Yield the controller. The server's thread does not access it in this context."""
        with self._lock:
            yield self._controller

    def cut(self) -> None:
        """Break all connections."""
        with self._lock:
            self._cut()

    def _cut(self) -> None:
        for lines in self._lines.values():
            for line in lines:
                line.close()
            lines.clear()

    def _listen(self, host: str) -> None:
        opened: dict[int, socket.socket] = {}
        try:
            for port in (DASHBOARD_PORT, SCRIPT_PORT, RTDE_PORT):
                opened[port] = socket.create_server((host, port))
        except OSError:
            for listener in opened.values():
                listener.close()
            raise
        self.host, self._listeners = host, opened
        self._lines = {port: [] for port in opened}

    def _hang_up(self) -> None:
        self._cut()
        for listener in self._listeners.values():
            listener.close()
        self._listeners = {}

    def _serve(self) -> None:
        due_ns = self._clock_ns()
        while not self._end:
            self._talk(max(0.0, (due_ns - self._clock_ns()) * 1e-9))
            now_ns = self._clock_ns()
            if now_ns >= due_ns:
                # Late cycles keep their own times; otherwise the joints would seem to jump.
                cycle_ns, due_ns = due_ns, max(due_ns + CYCLE_NS, now_ns - 10 * CYCLE_NS)
                with self._lock:
                    self._controller.step(cycle_ns)
                    self._notify(cycle_ns)

    def _talk(self, wait_s: float) -> None:
        with self._lock:
            if self.is_unplugged:
                self._hang_up()
            elif not self._listeners:
                with suppress(OSError):
                    self._listen(self.host)
            lines = {line.socket: (port, line) for port, each in self._lines.items() for line in each}
        sources = [*self._listeners.values(), *lines]
        if not sources:
            time.sleep(wait_s)
            return
        try:
            ready, _, _ = select.select(sources, [], [], wait_s)
        except (OSError, ValueError):
            # A connection has been cut meanwhile.
            return
        with self._lock:
            for port, listener in self._listeners.items():
                if listener in ready:
                    self._welcome(port, listener)
            for source in ready:
                if source in lines and lines[source][1] in self._lines[lines[source][0]]:
                    self._hear(*lines[source])

    def _welcome(self, port: int, listener: socket.socket) -> None:
        with suppress(OSError):
            connection, _ = listener.accept()
            line = _Connection(connection, RtdeSession(self._controller) if port == RTDE_PORT else None)
            self._lines[port].append(line)
            if port == DASHBOARD_PORT:
                line.send(_GREETING)

    def _hear(self, port: int, line: _Connection) -> None:
        line.receive(self._clock_ns())
        if line.session is not None:
            line.send(line.session.receive(line.arrived))
            line.arrived, line.is_over = b"", line.is_over or line.session.is_broken
        elif port == DASHBOARD_PORT:
            *requests, line.arrived = line.arrived.split(b"\n")
            for words in requests:
                line.send(self._controller.dashboard(words.decode("latin-1").strip()).encode() + b"\n")
        line.is_over |= len(line.arrived) > _HOPELESS

    def _notify(self, now_ns: int) -> None:
        """Run complete scripts, send data packages, and remove connections that have ended."""
        for line in self._lines.get(SCRIPT_PORT, ()):
            if line.arrived and now_ns - line.heard_ns > _QUIET_NS:
                self._controller.run_script(line.arrived)
                line.arrived = b""
        for line in self._lines.get(RTDE_PORT, ()):
            data = b"" if line.session is None else line.session.due(now_ns)
            line.send(self.network(data) if data else b"")
        for lines in self._lines.values():
            for line in [line for line in lines if line.is_over]:
                line.close()
                lines.remove(line)
