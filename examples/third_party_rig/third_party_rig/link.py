"""The connection to a device, which sends lines of text over TCP, and the clock of the device.

The device sends the greeting ``HELLO name channels``. After ``B`` it sends a sample immediately and then one per tick
until ``E``, as ``T number microseconds value value ...``. Its time starts when it is switched on. ``F text`` reports a
fault. An arm accepts ``G angle angle ...`` (go there) and ``S`` (hold the position until the next ``B``). It also holds
its position after ``E`` and when the connection ends.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass

CONNECT_S = 1.0
DRIFT = 1e-4
"""Maximum drift between two clocks, as a fraction of the elapsed time."""


@dataclass(frozen=True)
class Reading:
    """A sample as sent by the device."""

    number: int
    device_ns: int
    values: tuple[float, ...]


class DeviceClock:
    """Converter from device time to run time. The sample with the shortest delay so far determines the offset.

    A delay is never negative, so each sample gives an upper bound on the offset. Because clocks drift, the bound rises
    slowly with time. A converted time is never later than the receive time, and the order of samples is preserved.
    """

    def __init__(self) -> None:
        self._offset_ns: int | None = None
        self._device_ns = 0

    def run_ns(self, device_ns: int, receive_ns: int) -> int:
        """Convert a device time to run-clock time.

        Args:
            device_ns: Time on the device's clock.
            receive_ns: Run-clock time at which the sample was received.
        """
        bound = receive_ns - device_ns
        if self._offset_ns is not None:
            bound = min(bound, self._offset_ns + round(DRIFT * (device_ns - self._device_ns)))
        self._offset_ns, self._device_ns = bound, device_ns
        return device_ns + bound


class Link:
    """An open connection. Once it is open, no method except ``line`` blocks.

    Raises:
        OSError: There is no device, it is the wrong one, or the connection has ended; any method may raise this.
    """

    def __init__(self, host: str, port: int, kind: str, channels: int) -> None:
        self._rest = b""
        self._socket = socket.create_connection((host, port), CONNECT_S)
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            greeting = self.line()
            if greeting != f"HELLO {kind} {channels}":
                raise OSError(f"expected a {kind} with {channels} channels, found {greeting!r}")
        except OSError:
            self._socket.close()
            raise

    def line(self) -> str:
        """Return the next line, waiting for at most a second. Use it only while opening or activating a device."""
        self._socket.settimeout(CONNECT_S)
        try:
            while b"\n" not in self._rest:
                self._rest += self._received()
        finally:
            self._socket.settimeout(0.0)
        first, _, self._rest = self._rest.partition(b"\n")
        return first.decode("ascii", "replace")

    def lines(self) -> list[str]:
        """Return all complete lines received since the last call."""
        try:
            while True:
                self._rest += self._received()
        except BlockingIOError:
            *whole, self._rest = self._rest.split(b"\n")
        return [line.decode("ascii", "replace") for line in whole]

    def _received(self) -> bytes:
        news = self._socket.recv(65536)
        if not news:
            raise ConnectionResetError("the device has ended the connection")
        return news

    def write(self, line: str) -> None:
        """Send a line. Success does not mean that it arrives, and only missing data reveal an unplugged cable."""
        self._socket.send(line.encode("ascii") + b"\n")

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


def reading(line: str, channels: int) -> Reading:
    """Return the sample in a line ``T ...``.

    Raises:
        OSError: The line is not a sample; the text of an ``F ...`` line is included.
    """
    word, _, text = line.partition(" ")
    if word == "F":
        raise OSError(f"the device reports a fault: {text}")
    fields = text.split()
    if word != "T" or len(fields) != 2 + channels:
        raise OSError(f"not a sample of {channels} channels: {line!r}")
    try:
        return Reading(int(fields[0]), 1000 * int(fields[1]), tuple(map(float, fields[2:])))
    except ValueError as error:
        raise OSError(f"not a sample: {line!r}") from error
