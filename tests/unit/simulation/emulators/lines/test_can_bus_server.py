"""Emulated nodes on python-can's virtual bus, in real time."""

from __future__ import annotations

import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from uuid import uuid4

import can
import numpy as np
import pytest

from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.jr3.config import Jr3Config, Jr3Faults
from palpate.simulation.emulators.lines.can_bus_server import VirtualBusServer
from palpate.simulation.emulators.lines.can_wire import CanWire

FULL = (115.0, 111.0, 185.0, 5.6, 5.2, 6.1)


def jr3(node_id: int = 1) -> Jr3CanNode:
    config = Jr3Config(boot_ns=50_000_000, eeprom_ns=0)
    return Jr3CanNode(node_id, lambda _: FULL, config, generator=np.random.default_rng(node_id))


@contextmanager
def served(*nodes: Jr3CanNode) -> Iterator[tuple[VirtualBusServer, can.BusABC]]:
    wire = CanWire(nodes, generator=np.random.default_rng(0))
    channel = f"jr3-{uuid4()}"
    with can.Bus(interface="virtual", channel=channel) as bus, VirtualBusServer(wire, channel) as server:
        yield server, bus


def expect(bus: can.BusABC, arbitration_id: int, timeout_s: float = 2.0) -> bytes:
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        message = bus.recv(0.1)
        if message is not None and message.arbitration_id == arbitration_id:
            return bytes(message.data)
    raise AssertionError(f"0x{arbitration_id:03X} did not come")


def send(bus: can.BusABC, arbitration_id: int, data: bytes = b"") -> None:
    bus.send(can.Message(arbitration_id=arbitration_id, data=data, is_extended_id=False))


def test_several_nodes_boot_answer_and_stream() -> None:
    with served(jr3(1), jr3(2)) as (_, bus):
        expect(bus, 0x701)
        expect(bus, 0x702)
        send(bus, 0x482)
        assert expect(bus, 0x102) == b"\x00" + struct.pack("<3H", 115, 111, 185)
        send(bus, 0x201, struct.pack("<HI", 0, 5_000))
        assert expect(bus, 0x101) == b"\x00"
        forces, moments = expect(bus, 0x601), expect(bus, 0x681)
        assert forces[6:] == moments[6:]
        assert struct.unpack("<3h", forces[:6]) == (-16384, 16384, 16384)


def test_the_stream_keeps_its_rate() -> None:
    with served(jr3()) as (_, bus):
        expect(bus, 0x701)
        send(bus, 0x201, struct.pack("<HI", 0, 5_000))
        first = struct.unpack("<H", expect(bus, 0x601)[6:])[0]
        for _ in range(100):
            last = struct.unpack("<H", expect(bus, 0x601)[6:])[0]
        assert (last - first) * 128.5e-6 == pytest.approx(0.5, rel=0.02)


def test_nodes_can_be_acted_on_while_they_run() -> None:
    node = jr3()
    with served(node) as (server, bus):
        expect(bus, 0x701)
        server.do(node.reboot)
        expect(bus, 0x701)

        def hush(_: int) -> None:
            node.firmware.faults = Jr3Faults(silent=True)

        server.do(hush)
        send(bus, 0x401)
        assert bus.recv(0.1) is None


def test_remote_and_extended_frames_reach_no_node() -> None:
    with served(jr3()) as (_, bus):
        expect(bus, 0x701)
        bus.send(can.Message(arbitration_id=0x401, is_extended_id=True))
        bus.send(can.Message(arbitration_id=0x401, is_extended_id=False, is_remote_frame=True))
        assert bus.recv(0.05) is None


def test_closing_ends_the_thread_and_may_be_repeated() -> None:
    before = threading.active_count()
    with served(jr3()) as (server, _):
        assert threading.active_count() == before + 1
    assert threading.active_count() == before
    server.close()
    with pytest.raises(TimeoutError, match="did not respond"):
        server.do(lambda _: None, timeout_s=0.01)
