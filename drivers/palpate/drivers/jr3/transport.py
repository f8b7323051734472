"""Ways to the board: a CAN bus or a serial port, each with its codec. Neither starts a thread."""

import termios
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final, Protocol

from palpate.drivers.can import CanLink
from palpate.drivers.errors import SilentError
from palpate.drivers.jr3.codec_can import CanDecoder, Reassembly, encode_can
from palpate.drivers.jr3.codec_uart import UartParser, encode_uart, nudged
from palpate.drivers.jr3.messages import SCALES_IN_REPLY, Forces, Message, Moments, Op, Request, TransportCounts
from palpate.drivers.jr3.settings import check_node
from palpate.drivers.serial_port import WRITE_TIMEOUT_S, ByteStream

_GONE: Final = (OSError, TypeError, termios.error)
"""What pyserial lets through when an adapter is unplugged."""
MAX_BYTES = 4096
"""Bytes taken per call, 0.36 s of a line at 115200 baud (CALC)."""


class UartLink:
    """Bytes of a serial port, opened with ``serial.serial_for_url`` by whoever closes it.

    Args:
        port: An open port at 115200 baud, 8N1. It is set to non-blocking here, once.

    Attributes:
        send_failures: Frames that the port did not take in time.
    """

    def __init__(self, port: ByteStream) -> None:
        self.send_failures = 0
        port.timeout = 0.0
        port.write_timeout = WRITE_TIMEOUT_S
        self._port = port

    def receive(self) -> bytes:
        """Bytes that have arrived.

        Raises:
            SilentError: The port is gone.
        """
        data = b""
        try:
            # Network ports may give one byte per call; only an empty answer means that nothing waits.
            while len(data) < MAX_BYTES and (chunk := self._port.read(MAX_BYTES - len(data))):
                data += chunk
        except _GONE as error:
            raise self._gone(error) from error
        return data

    def send(self, frame: bytes) -> bool:
        """Write a frame in one call; the board takes one frame per read and drops what follows it (FACT).

        Raises:
            SilentError: The port is gone, or has not taken the frame in time.
        """
        try:
            self._port.write(frame)
        except _GONE as error:
            self.send_failures += 1
            raise self._gone(error) from error
        return True

    @staticmethod
    def _gone(error: Exception) -> SilentError:
        remedy = "check the cable and the board's power, then connect again"
        return SilentError("JR3 on a serial line", f"the port fails ({error})", remedy)


@dataclass(frozen=True, slots=True)
class TransportTiming:
    """How long to wait on a wire.

    Attributes:
        ping_attempts: The same for the first one, in which the board may still be booting.
    """

    ack_timeout_ns: int
    attempts: int
    ping_attempts: int
    min_period_us: int


CAN_TIMING = TransportTiming(ack_timeout_ns=250_000_000, attempts=3, ping_attempts=16, min_period_us=540)
"""FACT: yarp-devices waits 0.25 s; the board boots in 2 s. CALC: two frames last 0.27 ms; half the bus is left free."""

UART_TIMING = TransportTiming(ack_timeout_ns=2_500_000_000, attempts=3, ping_attempts=5, min_period_us=1563)
"""FACT: the firmware sleeps 1 s after each command and boots in more than 5 s. CALC: 18 bytes last 1.5625 ms."""


class Transport(Protocol):
    """What the conversation needs. ``receive`` and ``send`` raise SilentError when the way to the board is gone."""

    name: str
    timing: TransportTiming
    scale_ops: tuple[Op, ...]
    is_checked: bool
    """Whether a damaged reading is noticed, by a checksum."""

    def receive(self) -> list[Message]:
        """Messages that have arrived."""

    def send(self, request: Request) -> bool:
        """Send a request; False when it was not taken."""

    def feasible(self, cutoff_cHz: int, period_us: int) -> tuple[int, int]:
        """The nearest cut-off and period that the wire can carry."""

    def forget(self) -> None:
        """Drop what has arrived in part."""

    def counts(self) -> TransportCounts:
        """What was seen so far."""


class CanTransport:
    """The board on a CAN bus.

    Raises:
        SettingError: The node number cannot work (:func:`palpate.drivers.jr3.settings.check_node`).
    """

    def __init__(self, link: CanLink, node: int = 1, canopen_nodes: Iterable[int] = ()) -> None:
        check_node(node, canopen_nodes)
        self.name = f"JR3 on CAN, node {node}"
        self.timing, self.is_checked = CAN_TIMING, True
        self.scale_ops: tuple[Op, ...] = (Op.GET_FORCE_SCALES, Op.GET_MOMENT_SCALES)
        self._link, self._node = link, node
        self._decoder, self._joiner = CanDecoder(node), Reassembly()

    def receive(self) -> list[Message]:
        """Messages that have arrived; halves of readings are joined."""
        messages: list[Message] = []
        for frame in self._link.receive():
            message = self._decoder.decode(frame)
            whole = self._joiner.add(message) if isinstance(message, (Forces, Moments)) else message
            if whole is not None:
                messages.append(whole)
        return messages

    def send(self, request: Request) -> bool:
        """Send a request; False when the interface did not take it."""
        return self._link.send(encode_can(request, self._node))

    def feasible(self, cutoff_cHz: int, period_us: int) -> tuple[int, int]:
        """CAN carries any value."""
        return cutoff_cHz, period_us

    def forget(self) -> None:
        """Drop halves of readings."""
        self._joiner.clear()

    def counts(self) -> TransportCounts:
        """What was seen so far."""
        seen, link = self._decoder.counts, self._link
        return replace(
            seen,
            garbage=seen.garbage + link.garbled,
            orphans=self._joiner.orphans,
            duplicates=self._joiner.duplicates,
            send_failures=link.send_failures,
            bus_offs=link.bus_offs,
        )


class UartTransport:
    """The board on a serial line."""

    def __init__(self, link: UartLink) -> None:
        self.name = "JR3 on a serial line"
        self.timing, self.is_checked = UART_TIMING, False
        self.scale_ops: tuple[Op, ...] = (Op.GET_SCALES,)
        self._link, self._parser = link, UartParser()

    def receive(self) -> list[Message]:
        """Messages that have arrived."""
        data = self._link.receive()
        return self._parser.feed(data) if data else []

    def send(self, request: Request) -> bool:
        """Send a request; False when the port did not take it."""
        self._parser.expect_scales = request.op in SCALES_IN_REPLY
        return self._link.send(encode_uart(request))

    def feasible(self, cutoff_cHz: int, period_us: int) -> tuple[int, int]:
        """The nearest values without delimiters in their bytes; see :func:`palpate.drivers.jr3.codec_uart.nudged`."""
        return nudged(cutoff_cHz, 2), nudged(period_us, 4)

    def forget(self) -> None:
        """Drop a frame that has begun."""
        self._parser.clear()

    def counts(self) -> TransportCounts:
        """What was seen so far."""
        return replace(self._parser.counts, send_failures=self._link.send_failures)
