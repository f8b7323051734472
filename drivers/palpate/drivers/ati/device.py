"""Polled reception of RDT, ATI's UDP stream of force/torque records."""

import socket
from contextlib import suppress
from typing import Final

from typing_extensions import override

from palpate.drivers.ati.codec import RECORD, SATURATED, START, STOP, faults_in
from palpate.drivers.ati.settings import CHECK, NAME, NetFtBox
from palpate.drivers.device import ForceSample, PolledSensor
from palpate.drivers.errors import DeviceFaultError, WiringError

RDT_PORT: Final = 49152
_ASK_AGAIN_NS: Final = 100_000_000
"""Time after which a stream that has not started is requested again; at least two periods."""
_WRAP: Final = 1 << 32
_MAX_DATAGRAMS: Final = 4096
"""Maximum number of datagrams per call. It exceeds the capacity of a socket buffer, but limits fast streams."""


class UdpWire:
    """UDP connection to a box; it raises OSError on system errors.

    Attributes:
        address: The box's IPv4 address, since a name may resolve to several.

    Raises:
        WiringError: The box's address cannot be found.
    """

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.connect((host, port))
        except OSError as error:
            self.close()
            raise WiringError(NAME, f"{host}, UDP port {port} cannot be reached ({error})", CHECK) from error
        self.address: str = self._socket.getpeername()[0]

    def send(self, datagram: bytes) -> None:
        """Send a request."""
        self._socket.send(datagram)

    def receive(self) -> list[bytes]:
        """Return the datagrams that have been received."""
        datagrams: list[bytes] = []
        with suppress(BlockingIOError):
            while len(datagrams) < _MAX_DATAGRAMS:
                datagrams.append(self._socket.recv(2048))
        return datagrams

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class NetFt(PolledSensor):
    """Driver for a streaming box; ``errors`` counts lost, old and malformed records."""

    def __init__(self, wire: UdpWire, box: NetFtBox) -> None:
        super().__init__(NAME, "check its power, cable and network, and that no other program has its stream")
        self.box = box
        self.received = 0
        self._wire = wire
        self._ask_again_ns = max(_ASK_AGAIN_NS, round(2e9 / box.rate_Hz))
        self._number: int | None = None
        self._count: int | None = None
        self._requested_ns: int | None = None
        self._sequence = 0

    def start(self, now_ns: int) -> None:
        """Request the stream, and drop records left over from an earlier stream."""
        self._number = self._count = None
        self._requested_ns = now_ns
        self._receive()
        self._send(START)

    def stop(self) -> None:
        """Request the end of the stream; the box does not confirm it."""
        self._requested_ns = None
        self._send(STOP)

    @override
    def diagnostics(self) -> dict[str, str]:
        box = self.box
        found = {"calibration": str(box.calibration), "range": f"{box.range_N} N, {box.range_Nm} N m"}
        return {**found, "records": str(self.received), **super().diagnostics()}

    @override
    def poll(self, now_ns: int) -> list[ForceSample]:
        if (
            self._requested_ns is not None
            and self._number is None
            and now_ns - self._requested_ns >= self._ask_again_ns
        ):
            self._requested_ns = now_ns
            self._send(START)
        samples: list[ForceSample] = []
        self._polled_ns = now_ns
        for datagram in self._receive():
            if not datagram or len(datagram) % RECORD.size:
                self.errors["malformed datagrams"] += 1
                continue
            for number, count, status, *counts in RECORD.iter_unpack(datagram):
                if self._is_new(number, count):
                    samples.append(self._sample(status, counts, now_ns))
        if samples:
            self.latest = samples[-1]
            self._is_news()
        return samples

    def _receive(self) -> list[bytes]:
        try:
            return self._wire.receive()
        except OSError as error:
            self._lose(error)
            return []

    def _send(self, request: bytes) -> None:
        try:
            self._wire.send(request)
        except OSError as error:
            self._lose(error)

    def _lose(self, error: OSError) -> None:
        self.failure = self.failure or WiringError(NAME, f"the box cannot be reached ({error})", CHECK)

    def _is_new(self, number: int, count: int) -> bool:
        """Return True if a record is newer than all previous ones. A new stream numbers its records from 1."""
        if self._count is not None and not 0 < (count - self._count) % _WRAP < _WRAP // 2:
            self.errors["old records"] += 1
            return False
        ahead = 1 if self._number is None else (number - self._number) % _WRAP
        ahead = ahead if 0 < ahead < _WRAP // 2 else 1
        self.received += 1
        self.errors["lost records"] += ahead - 1
        self._sequence += ahead
        self._number, self._count = number, count
        return True

    def _sample(self, status: int, counts: list[int], now_ns: int) -> ForceSample:
        faults = faults_in(status)
        if faults and self.failure is None:
            remedy = "look at the box's page System Information, then acknowledge"
            self.failure = DeviceFaultError(NAME, f"it reports {'; '.join(faults)}", remedy)
        x, y, z, tx, ty, tz = counts
        box = self.box
        force = x / box.counts_per_N, y / box.counts_per_N, z / box.counts_per_N
        torque = tx / box.counts_per_Nm, ty / box.counts_per_Nm, tz / box.counts_per_Nm
        return ForceSample(force, torque, self._sequence, now_ns, saturated=bool(status & SATURATED))
