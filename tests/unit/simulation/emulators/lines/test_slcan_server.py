"""What only a serial CAN adapter has: its own commands, malformed lines, a cable to pull."""

import os
import select
import struct
import threading

import can
import numpy as np
import serial

from palpate.simulation.emulators.lines.slcan import BACKLOG_BYTES, SlcanServer
from tests.unit.simulation.emulators.lines.turned import (
    MILLISECOND,
    Clock,
    TurnedSlcan,
    jr3,
    open_slcan,
    turned_slcan,
    wire_of,
)


def test_a_stream_of_a_thousand_pairs_a_second_arrives_whole() -> None:
    with turned_slcan(jr3()) as host:
        host.start_stream()
        counters = [struct.unpack("<H", host.expect(0x601)[6:])[0] for _ in range(1000)]
        assert set((np.diff(counters) & 0xFFFF).tolist()) <= {7, 8}
        assert isinstance(host.server, SlcanServer)
        assert host.server.frames_lost == 0


def test_a_second_host_may_come_after_the_first() -> None:
    with turned_slcan(jr3()) as host:
        host.expect(0x701)
        assert isinstance(host.server, TurnedSlcan)
        host.bus.shutdown()
        host.server.await_host()
        host.turn()
        host.bus = open_slcan(host.server)
        host.send(0x401)
        assert host.expect(0x101) == b"\x00"


def test_the_wrong_bit_rate_hears_nothing() -> None:
    with turned_slcan(jr3(), bitrate=500_000) as host:
        host.turn(100)
        host.send(0x401)
        assert host.receive() is None


def test_a_host_that_does_not_read_loses_frames_and_is_told() -> None:
    clock = Clock()
    server = SlcanServer(wire_of(jr3()), clock_ns=clock)
    with serial.Serial(server.channel, timeout=0.5) as port:
        for words in (b"S8\rO\r", b"t2016" + struct.pack("<HI", 0, 222).hex().encode() + b"\r", b""):
            port.write(words)
            assert not words or select.select([server._master], [], [], 30.0)[0]
            for _ in range(1000):
                clock.now_ns += MILLISECOND // 2
                server.turn()
        assert server.frames_lost > 0
        assert server.adapter.overrun
        assert len(server._backlog) <= BACKLOG_BYTES + 64
    server.close()


def test_nothing_is_left_behind() -> None:
    threads, files = threading.active_count(), len(os.listdir("/proc/self/fd"))
    for _ in range(3):
        with SlcanServer(wire_of(jr3())) as server:
            can.Bus(interface="slcan", channel=server.channel, bitrate=1_000_000, sleep_after_open=0.0).shutdown()
        server.close()
    assert threading.active_count() == threads
    assert len(os.listdir("/proc/self/fd")) == files
