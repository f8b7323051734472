"""The way to a device: a TCP connection with lines of text, and the device's clock.

The device greets with ``HELLO name channels``. After ``B`` it sends a sample at once and one each tick from then on,
``T number microseconds value value ...``, until ``E``; time is since it was switched on. ``F text`` is a fault.
An arm takes ``G angle angle ...`` (go there) and ``S`` (hold where you are until the next ``B``); it holds, too, at
``E`` and when the connection ends.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass

CONNECT_S = 1.0
DRIFT = 1e-4
"""How far two clocks may drift apart, as a share of the time."""


@dataclass(frozen=True)
class Reading:
    """A sample as the device sent it."""

    number: int
    device_ns: int
    values: tuple[float, ...]


class DeviceClock:
    """Time of a device in the run's: the quickest passage so far tells how the clocks stand to each other.

    A passage is never negative, so each sample gives an upper bound of the offset. It is let rise a little as time goes
    on, for clocks drift. What is stamped is never later than its receipt, and order stays order.
    """

    def __init__(self) -> None:
        self._offset_ns: int | None = None
        self._device_ns = 0

    def run_ns(self, device_ns: int, receive_ns: int) -> int:
        """When, by the run's clock, the device had this time.

        Args:
            device_ns: Its own time.
            receive_ns: When the run had the sample.
        """
        bound = receive_ns - device_ns
        if self._offset_ns is not None:
            bound = min(bound, self._offset_ns + round(DRIFT * (device_ns - self._device_ns)))
        self._offset_ns, self._device_ns = bound, device_ns
        return device_ns + bound


class Link:
    """A connection that is open. Nothing here waits, once it is.

    Raises:
        OSError: Nobody is there, it is another device, or the connection has ended; from any method.
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
        """The next line; the only thing that waits, for a second, and only while a device is opened or activated."""
        self._socket.settimeout(CONNECT_S)
        try:
            while b"\n" not in self._rest:
                self._rest += self._received()
        finally:
            self._socket.settimeout(0.0)
        first, _, self._rest = self._rest.partition(b"\n")
        return first.decode("ascii", "replace")

    def lines(self) -> list[str]:
        """What has come since."""
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
        """Send a line. That it went means nothing: a cable that was pulled shows only in what no longer comes."""
        self._socket.send(line.encode("ascii") + b"\n")

    def close(self) -> None:
        """End it."""
        self._socket.close()


def reading(line: str, channels: int) -> Reading:
    """The sample of a line ``T ...``.

    Raises:
        OSError: It is none; an ``F ...`` says why.
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
