"""Serves an emulated box on sockets of this computer: RDT over UDP, its page over HTTP."""

import select
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Self

from palpate.simulation.emulators.ati.box import EmulatedBox

_LOOK_S = 0.02


class NetFtServer:
    """A thread that serves a box. A context manager: inside, it is there.

    The box sends to whoever asked last, as a real one does.
    """

    host = "127.0.0.1"

    def __init__(self, box: EmulatedBox) -> None:
        self.port = self.http_port = 0
        self._box, self._lock, self._end = box, threading.Lock(), False
        self._client: tuple[str, int] | None = None
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        self._rdt = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._rdt.bind((self.host, 0))
        self._rdt.setblocking(False)
        self._web = socket.create_server((self.host, 0))
        self.port, self.http_port = self._rdt.getsockname()[1], self._web.getsockname()[1]
        self._end = False
        self._thread = threading.Thread(target=self._serve, name="Net F/T emulator", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end = True
        if self._thread is not None:
            self._thread.join()
        self._rdt.close()
        self._web.close()

    @contextmanager
    def exclusive(self) -> Iterator[EmulatedBox]:
        """The box, while the server's thread keeps its hands off it."""
        with self._lock:
            yield self._box

    def _serve(self) -> None:
        while not self._end:
            with self._lock:
                wait_s = (self._box.next_event_ns() - time.monotonic_ns()) * 1e-9
            ready, _, _ = select.select([self._rdt, self._web], [], [], max(0.0, min(wait_s, _LOOK_S)))
            if self._web in ready:
                self._answer()
            with self._lock:
                if self._rdt in ready:
                    # A client that is gone shows as an error of the next call; the box does not mind.
                    with suppress(OSError):
                        request, self._client = self._rdt.recvfrom(64)
                        self._box.receive(request, time.monotonic_ns())
                for datagram in self._box.step(time.monotonic_ns()):
                    if self._client is not None:
                        with suppress(OSError):
                            self._rdt.sendto(datagram, self._client)

    def _answer(self) -> None:
        with suppress(OSError):
            line, _ = self._web.accept()
            with line:
                line.settimeout(0.5)
                path = line.recv(1024).split(b" ")[1:2]
                page = self._box.page()
                if path == [b"/netftapi2.xml"]:
                    line.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n" + page)
                else:
                    line.sendall(b"HTTP/1.0 404 Not Found\r\n\r\n")
