"""A CAN server that a test turns by hand, without a thread: time goes on by what the test says, however late it is."""

from __future__ import annotations

import select
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from uuid import uuid4

import can
import numpy as np

from palpate.simulation.emulators.jr3 import Jr3CanNode, Jr3Config
from palpate.simulation.emulators.lines import EmulatedCanBus, SlcanServer
from palpate.simulation.emulators.lines.can_bus_server import CanBusServer
from palpate.simulation.emulators.lines.slcan import ChannelMode
from tests.virtual_can import VirtualBusServer

FULL = (115.0, 111.0, 185.0, 5.6, 5.2, 6.1)
MILLISECOND = 1_000_000


def jr3(node_id: int = 1) -> Jr3CanNode:
    config = Jr3Config(boot_ns=50 * MILLISECOND, eeprom_ns=0)
    return Jr3CanNode(node_id, lambda _: FULL, config, generator=np.random.default_rng(node_id))


class Turned:
    """A host's view of the bus."""

    def __init__(self, server: CanBusServer, bus: can.BusABC, clock: Clock) -> None:
        self.server, self.bus, self._clock = server, bus, clock

    def turn(self, milliseconds: float = 1.0) -> None:
        for _ in range(round(2 * milliseconds)):
            self._clock.now_ns += MILLISECOND // 2
            self.server.turn()

    def send(self, arbitration_id: int, data: bytes = b"") -> None:
        self.bus.send(can.Message(arbitration_id=arbitration_id, data=data, is_extended_id=False))
        if isinstance(self.server, TurnedSlcan):
            self.server.await_host()

    def receive(self, within_ms: int = 100) -> can.Message | None:
        """The next frame that the host hears."""
        for _ in range(within_ms):
            message = self.bus.recv(0.0)
            if message is not None:
                return message
            self.turn()
        return None

    def expect(self, arbitration_id: int) -> bytes:
        """The data of the next frame with that identifier."""
        while (message := self.receive()) is not None:
            if message.arbitration_id == arbitration_id:
                return bytes(message.data)
        raise AssertionError(f"0x{arbitration_id:03X} did not come")

    def start_stream(self, period_us: int = 1_000) -> None:
        self.expect(0x701)
        self.send(0x201, struct.pack("<HI", 0, period_us))
        assert self.expect(0x101) == b"\x00"


class Clock:
    def __init__(self) -> None:
        self.now_ns = MILLISECOND

    def __call__(self) -> int:
        return self.now_ns


def wire_of(*nodes: Jr3CanNode) -> EmulatedCanBus:
    return EmulatedCanBus(nodes)


class TurnedSlcan(SlcanServer):
    """What is written has come to the other end before time goes on: the kernel passes it on when it comes to it."""

    def await_host(self) -> None:
        """Wait for what the host has written."""
        assert select.select([self._master], [], [], 30.0)[0]

    def _write(self) -> None:
        wrote = bool(self._backlog)
        super()._write()
        if wrote:
            assert select.select([self._line._slave], [], [], 30.0)[0]


@contextmanager
def turned_slcan(*nodes: Jr3CanNode, bitrate: int = 1_000_000) -> Iterator[Turned]:
    clock = Clock()
    server = TurnedSlcan(wire_of(*nodes), clock_ns=clock)
    host = Turned(server, open_slcan(server, bitrate), clock)
    try:
        yield host
    finally:
        host.bus.shutdown()
        server.close()


def open_slcan(server: TurnedSlcan, bitrate: int = 1_000_000) -> can.BusABC:
    bus = can.Bus(interface="slcan", channel=server.channel, bitrate=bitrate, sleep_after_open=0.0, timeout=0.0)
    while server.adapter.mode is ChannelMode.CLOSED:
        server.await_host()
        server.turn()
    return bus


@contextmanager
def turned_virtual(*nodes: Jr3CanNode) -> Iterator[Turned]:
    clock, channel = Clock(), f"jr3-{uuid4()}"
    with can.Bus(interface="virtual", channel=channel) as bus:
        server = VirtualBusServer(wire_of(*nodes), channel, clock_ns=clock)
        try:
            yield Turned(server, bus, clock)
        finally:
            server.close()
