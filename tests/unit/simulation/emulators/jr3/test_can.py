import struct
from typing import Any

import numpy as np
import pytest

from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.jr3.sensor import Jr3Config
from palpate.simulation.emulators.lines.can_bus import BusFrame

MS = 1_000_000
S = 1_000_000_000
FULL = (115.0, 111.0, 185.0, 5.6, 5.2, 6.1)


class Host:
    """Talks to a node and keeps the time."""

    def __init__(self, node_id: int = 1, booted: bool = True, **config: Any) -> None:
        quick = {"boot_ns": 0, "eeprom_ns": 0} if booted else {}
        self.node = Jr3CanNode(
            node_id, lambda _: FULL, Jr3Config(**(quick | config)), generator=np.random.default_rng(7)
        )
        self.now_ns = 0
        self.boot_frames = self.node.advance(0)

    def wait(self, ns: int) -> list[BusFrame]:
        self.now_ns += ns
        return self.node.advance(self.now_ns)

    def send(self, arbitration_id: int, data: bytes = b"", wait_ns: int = MS) -> list[BusFrame]:
        return self.node.feed(arbitration_id, data, self.now_ns) + self.wait(wait_ns)


@pytest.mark.parametrize("node_id", [0, 128])
def test_node_numbers_have_limits(node_id: int) -> None:
    with pytest.raises(ValueError, match="node_id"):
        Host(node_id)


def test_bootup_has_no_payload_and_comes_after_two_seconds() -> None:
    host = Host(booted=False)
    assert host.boot_frames == []
    assert host.send(0x401, wait_ns=2 * S) == []  # lost: nobody listens yet
    assert host.wait(33 * MS) == [BusFrame(0x701, b"")]


def test_commands_during_the_reading_of_the_calibration_are_answered_after_bootup() -> None:
    host = Host(booted=False)
    host.wait(2 * S + MS)
    assert host.send(0x401, wait_ns=40 * MS) == [BusFrame(0x701, b""), BusFrame(0x101, b"\x00")]


def test_the_golden_start_gives_a_pair_every_ten_milliseconds() -> None:
    host = Host()
    frames = host.send(0x201, bytes.fromhex("C80010270000"), wait_ns=101 * MS)
    assert frames[0] == BusFrame(0x101, b"\x00")
    assert [frame.arbitration_id for frame in frames[1:]] == [0x601, 0x681] * 10
    for forces, moments in zip(frames[1::2], frames[2::2], strict=True):
        assert len(forces.data) == len(moments.data) == 8
        assert forces.data[6:] == moments.data[6:]
    x, y, z, counter = struct.unpack("<3hH", frames[-2].data)
    assert (x, y, z) == (-y, z, y)
    assert counter == 1 + 90_000_000 // 128_500


def test_without_a_sensor_everything_is_acknowledged_with_one_and_full_scales_are_stale() -> None:
    host = Host(connected=False)
    assert host.boot_frames == []
    for operation in (0x180, 0x200, 0x280, 0x300, 0x380, 0x400):
        assert host.send(operation + 1, b"\x00" * 6) == [BusFrame(0x101, b"\x01")]
    (answer,) = host.send(0x481)
    assert len(answer.data) == 7
    assert answer.data[0] == 1
    assert answer.data[1:] != struct.pack("<3H", 115, 111, 185)
    assert host.wait(S) == []


def test_stale_full_scales_are_what_the_last_sync_left_behind() -> None:
    host = Host()
    host.send(0x181, b"\x00\x00", wait_ns=5 * MS)
    forces, moments = host.send(0x080)
    assert len(host.send(0x581)) == 1
    host.node.firmware.state = type(host.node.firmware.state).NOT_INITIALISED
    assert host.send(0x481) == [BusFrame(0x101, b"\x01" + forces.data[:6])]
    assert host.send(0x501) == [BusFrame(0x101, b"\x01" + moments.data[:6])]


def test_reset_acknowledges_after_reading_and_never_without_a_sensor() -> None:
    host = Host(eeprom_ns=33 * MS)
    host.wait(34 * MS)
    assert host.send(0x581, wait_ns=33 * MS) == []
    assert host.wait(2 * MS) == [BusFrame(0x101, b"\x00")]
    host.node.firmware.connected = False
    assert host.send(0x581, wait_ns=10 * S) == []
    assert host.send(0x401, wait_ns=10 * S) == []  # the main loop hangs


def test_zero_gives_one_zero_pair() -> None:
    host = Host()
    host.send(0x201, struct.pack("<HI", 1000, 10_000), wait_ns=20 * MS)
    frames = host.send(0x301, wait_ns=100 * MS)
    assert frames[0] == BusFrame(0x101, b"\x00")
    zeros = [frame.data[:6] == bytes(6) for frame in frames[1:]]
    assert zeros == [True, True] + [False] * (len(zeros) - 2)


def test_short_payloads_count_as_zero() -> None:
    host = Host(shortest_period_ns=MS)
    frames = host.send(0x201, b"\x01", wait_ns=11 * MS)
    assert len(frames) == 1 + 2 * 10
    assert struct.unpack("<3hH", frames[1].data)[2] == 16384  # unfiltered


def test_frames_do_not_depend_on_how_often_the_node_is_advanced() -> None:
    def run(step_ns: int) -> list[BusFrame]:
        host = Host()
        frames = host.send(0x201, struct.pack("<HI", 1000, 7_000), wait_ns=0)
        for _ in range(S // step_ns):
            frames += host.wait(step_ns)
        return frames

    assert run(S) == run(MS // 2)
