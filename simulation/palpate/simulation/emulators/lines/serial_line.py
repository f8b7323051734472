"""A serial line between a host and an emulated device, with byte timing and the effect of mismatched rates."""

from collections import deque
from collections.abc import Callable
from typing import Final, Generic, Protocol, TypeVar

import numpy as np

_NS: Final = 1_000_000_000
_BITS_PER_BYTE: Final = 10  # 8N1
_RX_GRAIN_NS: Final = 500_000
_LONGEST_BYTE: Final = 12  # a slow byte covers at most as many fast ones as a byte at 19200 baud covers at 230400
_POLL_NS: Final = 1_000_000
"""Maximum time between calls to `advance`."""
_RATE_TOLERANCE: Final = 0.04  # half a bit in ten is 5 %, shared by both ends (assumed)


class SerialEmulator(Protocol):
    """A device at the byte level. It reads no clock, because times are passed as `now_ns`.

    `now_ns` never decreases by more than the line's wake-up period. An emulator ignores a decrease.
    """

    @property
    def baud(self) -> int:
        """The device's current line rate, 8N1."""

    def feed(self, data: bytes, now_ns: int) -> bytes:
        """Receive bytes from the host, the last of which arrived at `now_ns`, and return the device's reply."""

    def advance(self, now_ns: int) -> bytes:
        """Advance the time and return the bytes that the device sends unprompted."""


Emulator = TypeVar("Emulator", bound=SerialEmulator)


class SerialLine(Generic[Emulator]):
    """A line without I/O or a clock. If ``paced``, a byte takes 10 bit times. The device also runs without a host."""

    def __init__(self, emulator: Emulator, *, paced: bool = True) -> None:
        self.emulator = emulator
        self._rng = np.random.default_rng(0)
        self._paced = paced
        self._host_baud: Callable[[], int] | None = None
        self._rx: deque[tuple[int, bytes]] = deque()
        self._tx: deque[tuple[int, bytes]] = deque()
        self._rx_clear_ns = self._tx_clear_ns = self._polled_ns = 0

    def connect(self, host_baud: Callable[[], int], now_ns: int) -> None:
        """Connect a host; `host_baud` returns its line rate."""
        self._host_baud = host_baud
        self._rx_clear_ns = self._tx_clear_ns = now_ns

    def disconnect(self) -> None:
        """Disconnect the host. Bytes on the line are lost."""
        self._host_baud = None
        self._rx.clear()
        self._tx.clear()

    def next_event_ns(self) -> int:
        """Return the time of the next event for `step`: a poll, a delivery, or the end of received bytes."""
        due_ns = self._polled_ns + _POLL_NS
        if self._tx:
            due_ns = min(due_ns, self._tx[0][0])
        if self._rx:
            # A wake-up for each byte would be too costly, so bytes are handled in groups.
            due_ns = min(due_ns, max(self._rx[0][0], min(self._rx[-1][0], self._rx[0][0] + _RX_GRAIN_NS)))
        return due_ns

    def receive(self, data: bytes, now_ns: int) -> None:
        """Accept bytes from the host and determine when each byte arrives at the other end of the line."""
        if not data or self._host_baud is None:
            return
        baud, host_baud = self.emulator.baud, self._host_baud()
        if not _same_rate(host_baud, baud):
            data = self._garbage(data, baud / host_baud)
        at_ns = max(self._rx_clear_ns, now_ns)
        if self._paced:
            for byte in data:
                at_ns += _BITS_PER_BYTE * _NS // baud
                self._rx.append((at_ns, bytes([byte])))
        else:
            self._rx.append((at_ns, data))
        self._rx_clear_ns = at_ns

    def step(self, now_ns: int) -> list[bytes]:
        """Deliver all bytes that are due, advance the device, and return the bytes for the host."""
        while self._rx and self._rx[0][0] <= now_ns:
            at_ns, data = self._rx.popleft()
            baud = self.emulator.baud
            # The reply to a change of the rate is still sent at the old rate.
            self._send(self.emulator.feed(data, at_ns), at_ns, baud)
        if data := self.emulator.advance(now_ns):
            self._send(data, now_ns, self.emulator.baud)
        self._polled_ns = now_ns
        arrived = []
        while self._tx and self._tx[0][0] <= now_ns:
            arrived.append(self._tx.popleft()[1])
        return arrived

    def _send(self, reply: bytes, start_ns: int, baud: int) -> None:
        """Send bytes to the host. They become readable when the last one has arrived."""
        if not reply or self._host_baud is None:
            return
        host_baud = self._host_baud()
        data = reply if _same_rate(host_baud, baud) else self._garbage(reply, host_baud / baud)
        line_ns = len(reply) * (_BITS_PER_BYTE * _NS // baud) if self._paced else 0
        self._tx_clear_ns = max(start_ns, self._tx_clear_ns) + line_ns
        self._tx.append((self._tx_clear_ns, data))

    def _garbage(self, data: bytes, stretch: float) -> bytes:
        """Return what a receiver at a different line rate reads: about `stretch` times as many bytes."""
        return self._rng.bytes(max(1, round(len(data) * min(stretch, _LONGEST_BYTE))))


def _same_rate(host_baud: int, device_baud: int) -> bool:
    return abs(host_baud - device_baud) <= _RATE_TOLERANCE * device_baud
