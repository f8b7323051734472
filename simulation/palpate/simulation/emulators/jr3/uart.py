"""A JR3 node on a serial line: '<', two digits of operation, payload, '>', without length, escape or checksum."""

import struct
from collections import deque
from dataclasses import replace
from enum import IntEnum

import numpy as np

from palpate.simulation.emulators.jr3.node import Jr3Node, Notice, Sample, WrenchSource, unsigned
from palpate.simulation.emulators.jr3.sensor import Jr3Config

UART_CONFIG = replace(Jr3Config(), boot_ns=5_000_000_000, shortest_period_ns=1_562_500)
"""A sensor on the UART board: boots for 5 s (FACT: jr3-mbed-firmware-uart main.cpp), and a sample of 18 bytes of ten
bits at 115200 baud takes 1.5625 ms, which limits it to 640 a second (CALC)."""

BAUD = 115200
"""Line speed, 8N1. FACT: jr3-mbed-firmware-uart mbed_app.json5."""

READ_BYTES = 32
"""Most the main loop reads at once. FACT: jr3-mbed-firmware-uart mbed_app.json5."""

PAUSE_ns = 1_000_000_000
"""Sleep of the main loop after each read. FACT: jr3-mbed-firmware-uart main.cpp."""

GATHER_ns = 2_000_000
"""Time an idle node leaves a command to come in before it reads. assumed; a frame of 23 bytes fits."""

RECEIVE_BUFFER_BYTES = 256
"""Bytes the line keeps for a sleeping node, further ones are lost. assumed: default of Mbed OS."""

_DATA_BYTES = 14


class UartOperation(IntEnum):
    """Operation numbers. FACT: jr3-mbed-firmware-uart main.cpp."""

    ACK = 1
    START = 2
    STOP = 3
    ZERO_OFFSETS = 4
    SET_FILTER = 5
    GET_STATE = 6
    GET_FULL_SCALES = 7
    RESET = 8
    READ = 9
    BOOTUP = 10


def parse_command(buffer: bytes) -> tuple[int, bytes]:
    """Number of one command, which need not be a known one, and its payload, read as the firmware does.

    FACT (jr3-mbed-firmware-uart main.cpp): every '<' is skipped wherever it is, also inside a payload; the first '>'
    ends the command; the first two other bytes count as digits whatever they are; all else is payload. That reading
    ends with the buffer and that the payload is cut at 14 bytes is assumed: the firmware would run on.
    """
    body = buffer.partition(b">")[0].replace(b"<", b"")
    if len(body) < 2:
        return 0, b""
    return (body[0] - ord("0")) * 10 + body[1] - ord("0"), body[2 : 2 + _DATA_BYTES]


class Jr3UartNode:
    """A `SerialEmulator` that behaves like the UART firmware.

    The sampling threads go on streaming while the main loop sleeps (INFERENCE from the threads of jr3-mbed-firmware
    Jr3Controller.cpp). An acknowledgement and a sample never mix on the line (assumed: in the firmware two threads
    write to one buffer without a lock).
    """

    def __init__(
        self, wrench: WrenchSource, config: Jr3Config = UART_CONFIG, *, generator: np.random.Generator
    ) -> None:
        self.baud = BAUD
        """Speed of the line, bit/s."""
        self.firmware = Jr3Node(config, wrench, generator=generator)
        self._received: deque[int] = deque()
        self._buffer = bytearray(READ_BYTES)
        self._now_ns = 0
        self._awake_ns = 0
        self._read_ns: int | None = None

    def feed(self, data: bytes, now_ns: int) -> bytes:
        """Take bytes from the host; those that come during boot, or find the buffer full, are lost."""
        sent = self.advance(now_ns)
        if self.firmware.listening:
            self._received.extend(data[: RECEIVE_BUFFER_BYTES - len(self._received)])
            self._plan_read(self._now_ns + GATHER_ns)
        return sent

    def advance(self, now_ns: int) -> bytes:
        """Let time pass and return what the node wrote to the line meanwhile."""
        # A server that spreads bytes over the line may report an arrival a little late.
        self._now_ns = now_ns = max(self._now_ns, now_ns)
        sent = b""
        while self._read_ns is not None and self._read_ns <= now_ns:
            read_ns = self._read_ns
            sent += self._run_until(read_ns)
            self._read_ns = None
            if self.firmware.serving:
                sent += self._serve(read_ns)
                self._awake_ns = read_ns + PAUSE_ns
                self._plan_read(self._awake_ns)
            else:
                self._plan_read(read_ns + GATHER_ns)
        sent += self._run_until(now_ns)
        return b"" if self.firmware.faults.silent else sent

    def reboot(self, now_ns: int) -> None:
        """Cut the power for a moment; BOOTUP follows after the boot time."""
        self._received.clear()
        self._buffer = bytearray(READ_BYTES)
        self._read_ns = None
        self._awake_ns = now_ns
        self.firmware.reboot(now_ns)

    def _plan_read(self, earliest_ns: int) -> None:
        if self._received and self._read_ns is None:
            self._read_ns = max(earliest_ns, self._awake_ns)

    def _run_until(self, now_ns: int) -> bytes:
        sent = b""
        for event in self.firmware.advance(now_ns):
            if event is Notice.BOOTED:
                sent += self._frame(UartOperation.BOOTUP)
            elif event is Notice.RESET_DONE:
                # The main loop waited for the calibration and sleeps only now.
                self._awake_ns = now_ns + PAUSE_ns
                if self._read_ns is not None:
                    self._read_ns = max(self._read_ns, self._awake_ns)
                sent += self._acknowledgement()
            elif isinstance(event, Sample):
                sent += self._frame(UartOperation.READ, struct.pack("<6hH", *event.counts, event.counter))
        return sent

    def _serve(self, now_ns: int) -> bytes:
        size = min(READ_BYTES, len(self._received))
        self._buffer[:size] = bytes(self._received.popleft() for _ in range(size))
        operation, data = parse_command(bytes(self._buffer))
        match operation:
            case UartOperation.START:
                self.firmware.start(unsigned(data, 0, 2), now_ns, period_us=unsigned(data, 2, 4))
            case UartOperation.STOP:
                self.firmware.stop()
            case UartOperation.ZERO_OFFSETS:
                self.firmware.zero()
            case UartOperation.SET_FILTER:
                self.firmware.set_filter(unsigned(data, 0, 2))
            case UartOperation.GET_STATE:
                pass
            case UartOperation.GET_FULL_SCALES:
                return self._acknowledgement(*self.firmware.full_scale_words())
            case UartOperation.RESET:
                self.firmware.reset(now_ns)
                return b""
            case _:
                return b""
        return self._acknowledgement()

    def _acknowledgement(self, *words: int) -> bytes:
        return self._frame(UartOperation.ACK, struct.pack(f"<B{len(words)}H", self.firmware.state, *words))

    def _frame(self, operation: UartOperation, data: bytes = b"") -> bytes:
        return b"<%02d" % operation + data + b">"
