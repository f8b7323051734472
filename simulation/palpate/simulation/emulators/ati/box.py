"""An emulated Net F/T box with a transducer, and a server that provides its RDT stream and settings page."""

import select
import socket
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final, Self

_NS: Final = 1_000_000_000
_STOP, _STREAM = (struct.pack(">HH", 0x1234, command) for command in (0, 2))
_RECORD: Final = struct.Struct(">3I6i")
_COUNTS_PER_UNIT: Final = 1_000_000
_INTERNAL_HZ: Final = 7000
_LOOK_S: Final = 0.02


class EmulatedBox:
    """A box that receives requests and sends records at its own rate. It uses neither sockets nor a clock.

    Args:
        wrench: Function that returns force and torque on the transducer at a time in ns, (6,), in the box's units.
        rate_Hz: Records per second, at most 7000.

    Attributes:
        network: Filter for outgoing datagrams; set it to drop, repeat or reorder datagrams.
    """

    def __init__(self, wrench: Callable[[int], tuple[float, ...]], rate_Hz: int = 1000) -> None:
        self.status, self.streams = 0, False
        self.network: Callable[[list[bytes]], list[bytes]] = lambda datagrams: datagrams
        self._wrench, self._rate_Hz = wrench, rate_Hz
        self._begin_ns = self._sent = self._wanted = 0

    def receive(self, request: bytes, now_ns: int) -> None:
        """Execute a request; other datagrams are ignored."""
        if len(request) == 8 and request[:4] in (_STOP, _STREAM):
            self.streams, self._begin_ns, self._sent = request.startswith(_STREAM), now_ns, 0
            self._wanted = int.from_bytes(request[4:])

    def next_event_ns(self) -> int:
        """Return the time of the next datagram, or a distant time if there is none."""
        return self._begin_ns + (self._sent + 1) * _NS // self._rate_Hz if self.streams else 1 << 62

    def step(self, now_ns: int) -> list[bytes]:
        """Return the datagrams that are due."""
        datagrams = []
        while self.next_event_ns() <= now_ns:
            datagrams.append(self._record())
            self.streams = not self._wanted or self._sent < self._wanted
        return self.network(datagrams)

    def page(self) -> bytes:
        """Return the settings page, ``/netftapi2.xml``."""
        fields = {
            "runrate": _INTERNAL_HZ, "cfgcalsn": "FT00000", "scfgfu": "N", "scfgtu": "Nm",
            "cfgcpf": _COUNTS_PER_UNIT, "cfgcpt": _COUNTS_PER_UNIT, "cfgmr": "330;330;990;30;30;30",
            "comrdte": "Enabled", "comrdtrate": self._rate_Hz, "mfgdigver": "2.2.59",
        }  # fmt: skip
        text = "".join(f"<{name}>{value}</{name}>\n" for name, value in fields.items())
        return f'<?xml version="1.0"?><netft>\n{text}</netft>\n'.encode()

    def _record(self) -> bytes:
        self._sent += 1
        time_ns = self._begin_ns + self._sent * _NS // self._rate_Hz
        scaled = (round(value * _COUNTS_PER_UNIT) for value in self._wrench(time_ns))
        counts = (max(-(1 << 31), min(count, (1 << 31) - 1)) for count in scaled)
        words = (self._sent % (1 << 32), time_ns * _INTERNAL_HZ // _NS % (1 << 32), self.status)
        return _RECORD.pack(*words, *counts)


class NetFtServer:
    """Thread that serves a box on this computer. Like a real box, it sends to the most recent requester."""

    host = "127.0.0.1"

    def __init__(self, box: EmulatedBox, clock_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._box, self._clock_ns, self._ended = box, clock_ns, threading.Event()
        self._client: tuple[str, int] | None = None

    def __enter__(self) -> Self:
        self._rdt = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._rdt.bind((self.host, 0))
        self._rdt.setblocking(False)
        self._web = socket.create_server((self.host, 0))
        self.port, self.http_port = self._rdt.getsockname()[1], self._web.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, name="Net F/T emulator", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._rdt.close()
        self._web.close()

    def _serve(self) -> None:
        while not self._ended.is_set():
            wait_s = (self._box.next_event_ns() - self._clock_ns()) * 1e-9
            ready, _, _ = select.select([self._rdt, self._web], [], [], max(0.0, min(wait_s, _LOOK_S)))
            # A client that is gone causes an error in the next call; the box continues.
            with suppress(OSError):
                if self._web in ready:
                    self._answer()
                if self._rdt in ready:
                    request, self._client = self._rdt.recvfrom(64)
                    self._box.receive(request, self._clock_ns())
                for datagram in self._box.step(self._clock_ns()):
                    if self._client is not None:
                        self._rdt.sendto(datagram, self._client)

    def _answer(self) -> None:
        line, _ = self._web.accept()
        with line:
            line.settimeout(0.5)
            line.recv(1024)
            line.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n" + self._box.page())
