"""python-can's slcan interface talks to emulated nodes over a pseudo-terminal."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import can
import numpy as np
import pytest
import serial

from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.lines.can_faults import BusFaults
from palpate.simulation.emulators.lines.can_wire import CanWire
from palpate.simulation.emulators.lines.slcan_faults import LineFaults
from palpate.simulation.emulators.lines.slcan_server import BACKLOG_BYTES, SlcanServer
from tests.unit.simulation.emulators.lines.test_can_bus_server import expect, jr3, send


def server_of(*nodes: Jr3CanNode) -> SlcanServer:
    return SlcanServer(CanWire(nodes, generator=np.random.default_rng(0)), generator=np.random.default_rng(0))


def open_bus(server: SlcanServer, bitrate: int = 1_000_000) -> can.BusABC:
    return can.Bus(interface="slcan", channel=server.channel, bitrate=bitrate, sleep_after_open=0.0)


@contextmanager
def served(*nodes: Jr3CanNode) -> Iterator[tuple[SlcanServer, can.BusABC]]:
    with server_of(*nodes) as server, open_bus(server) as bus:
        yield server, bus


def listen(bus: can.BusABC, messages: int = 200) -> None:
    for _ in range(messages):
        bus.recv(0.1)


def start_stream(bus: can.BusABC, period_us: int = 1_000) -> None:
    expect(bus, 0x701)
    send(bus, 0x201, struct.pack("<HI", 0, period_us))
    expect(bus, 0x101)


def test_frames_go_both_ways_between_host_and_several_nodes() -> None:
    with served(jr3(1), jr3(2)) as (_, bus):
        expect(bus, 0x701)
        send(bus, 0x482)
        assert expect(bus, 0x102) == b"\x00" + struct.pack("<3H", 115, 111, 185)
        send(bus, 0x201, struct.pack("<HI", 0, 5_000))
        assert expect(bus, 0x101) == b"\x00"
        forces, moments = expect(bus, 0x601), expect(bus, 0x681)
        assert forces[6:] == moments[6:]
        assert struct.unpack("<3h", forces[:6]) == (-16384, 16384, 16384)


def test_version_and_serial_number() -> None:
    with served() as (_, bus):
        assert isinstance(bus, can.interfaces.slcan.slcanBus)
        assert bus.get_version(1.0) == (10, 13)
        assert bus.get_serial_number(1.0) == "PALP"


def test_a_stream_of_a_thousand_pairs_a_second_arrives_whole() -> None:
    with served(jr3()) as (server, bus):
        start_stream(bus)
        counters = []
        while len(counters) < 1000:
            counters.append(struct.unpack("<H", expect(bus, 0x601)[6:])[0])
        steps = np.diff(counters) & 0xFFFF
        assert set(steps.tolist()) <= {7, 8}
        assert server.frames_lost == 0


def test_another_process_talks_to_the_node() -> None:
    program = """
import struct, sys
import can
with can.Bus(interface="slcan", channel=sys.argv[1], bitrate=1000000, sleep_after_open=0.0) as bus:
    def expect(identifier):
        for _ in range(200):
            message = bus.recv(0.1)
            if message is not None and message.arbitration_id == identifier:
                return bytes(message.data)
        raise SystemExit("silence")
    bus.send(can.Message(arbitration_id=0x401, is_extended_id=False))
    expect(0x101)
    bus.send(can.Message(arbitration_id=0x201, data=struct.pack("<HI", 0, 2000), is_extended_id=False))
    expect(0x101)
    for _ in range(50):
        assert expect(0x601)[6:] == expect(0x681)[6:]
"""
    with server_of(jr3()) as server:
        time.sleep(0.1)  # boot
        done = subprocess.run([sys.executable, "-c", program, server.channel], capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr.decode()


def test_a_second_host_may_come_after_the_first() -> None:
    with server_of(jr3()) as server:
        with open_bus(server) as first:
            expect(first, 0x701)
        with open_bus(server) as second:
            send(second, 0x401)
            assert expect(second, 0x101) == b"\x00"


def test_the_wrong_bit_rate_hears_nothing() -> None:
    with server_of(jr3()) as server, open_bus(server, bitrate=500_000) as bus:
        send(bus, 0x401)
        assert bus.recv(0.2) is None


def test_a_host_that_does_not_read_loses_frames_and_is_told() -> None:
    with server_of(jr3()) as server, serial.Serial(server.channel, timeout=0.5) as port:
        port.write(b"S8\rO\r")
        time.sleep(0.1)  # boot
        port.write(b"t2016" + struct.pack("<HI", 0, 222).hex().encode() + b"\r")
        deadline_s = time.monotonic() + 10.0
        while server.frames_lost == 0 and time.monotonic() < deadline_s:
            time.sleep(0.05)
        assert server.frames_lost > 0
        assert server.adapter.overrun
        assert len(server._backlog) <= BACKLOG_BYTES + 64


def test_frames_get_lost_or_doubled_on_demand() -> None:
    with served(jr3()) as (server, bus):
        start_stream(bus)
        server.wire.trouble.faults = BusFaults(drop=0.3, duplicate=0.3)
        counters = [struct.unpack("<H", expect(bus, 0x601)[6:])[0] for _ in range(300)]
        steps = np.diff(counters) & 0xFFFF
        assert (steps == 0).sum() > 20
        assert (steps > 12).sum() > 20


@pytest.mark.parametrize("faults", [LineFaults(bad_hex=1.0), LineFaults(truncated=1.0), LineFaults(not_text=1.0)])
def test_a_malformed_line_upsets_python_can(faults: LineFaults) -> None:
    with served(jr3()) as (server, bus):
        start_stream(bus)
        server.lines.faults = faults
        # Depending on where it is hurt, a line may also make another frame.
        with pytest.raises((ValueError, IndexError, can.CanError)):
            listen(bus, 2000)


@pytest.mark.parametrize("line", [b"t6018ZZ\r", b"t60\r", b"t601\xff\r"])
def test_any_bytes_can_be_injected(line: bytes) -> None:
    with served(jr3()) as (server, bus):
        expect(bus, 0x701)
        server.inject(line)
        with pytest.raises((ValueError, IndexError, can.CanError)):
            listen(bus, 20)


def test_pulling_the_cable_hangs_up_and_wakes_a_waiting_host() -> None:
    server = server_of(jr3()).start()
    bus = open_bus(server)
    expect(bus, 0x701)
    server.unplug()
    assert not server.plugged
    with pytest.raises((can.CanError, OSError)):
        listen(bus, 20)
    with pytest.raises((can.CanError, OSError)):
        bus.shutdown()
    bus._is_shutdown = True
    bus.serialPortOrig.close()  # type: ignore[attr-defined]
    server.close()


def test_nothing_is_left_behind() -> None:
    threads, files = threading.active_count(), len(os.listdir("/proc/self/fd"))
    for _ in range(3):
        with served(jr3()) as (server, bus):
            expect(bus, 0x701)
        server.close()
    assert threading.active_count() == threads
    assert len(os.listdir("/proc/self/fd")) == files
