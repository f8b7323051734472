"""The JR3 node on a serial line, byte by byte, and over a pseudo-terminal."""

import struct
from typing import Any

import numpy as np
import pytest

from palpate.simulation.emulators.jr3.sensor import Jr3Config, Jr3Faults
from palpate.simulation.emulators.jr3.uart import UART_CONFIG, Jr3UartNode, parse_command

MS = 1_000_000
S = 1_000_000_000
FULL = (115.0, 111.0, 185.0, 5.6, 5.2, 6.1)
READY = b"<01\x00>"


class Host:
    """Talks to a node and keeps the time."""

    def __init__(self, booted: bool = True, wrench: Any = FULL, **config: Any) -> None:
        quick: dict[str, Any] = {"boot_ns": 0, "eeprom_ns": 0, "shortest_period_ns": 1_562_500} | config
        self.node = Jr3UartNode(
            lambda _: wrench, Jr3Config(**quick) if booted else UART_CONFIG, generator=np.random.default_rng(7)
        )
        self.now_ns = 0
        self.boot_bytes = self.node.advance(0)

    def wait(self, ns: int) -> bytes:
        self.now_ns += ns
        return self.node.advance(self.now_ns)

    def send(self, data: bytes, wait_ns: int = 2 * S) -> bytes:
        return self.node.feed(data, self.now_ns) + self.wait(wait_ns)


@pytest.mark.parametrize(
    ("buffer", "command"),
    [
        (b"<06>", (6, b"")),
        (b"<05\xc8\x00>", (5, b"\xc8\x00")),
        (b"<05\x3c\x01\x02>", (5, b"\x01\x02")),  # '<' in a payload is skipped
        (b"<05\x3e\x01>", (5, b"")),  # '>' in a payload ends it
        (b"<06><03>", (6, b"")),
        (b"junk>", (649, b"nk")),
        (b"<>", (0, b"")),
    ],
)
def test_parsing_is_as_careless_as_the_firmware(buffer: bytes, command: tuple[int, bytes]) -> None:
    assert parse_command(buffer) == command


def test_bootup_after_five_seconds() -> None:
    host = Host(booted=False)
    assert host.send(b"<06>", wait_ns=5 * S) == b""
    assert host.wait(33 * MS) == b"<10>"
    assert host.wait(S) == b""  # what came during boot is lost


def test_acknowledgements_are_one_or_thirteen_bytes() -> None:
    host = Host()
    assert host.boot_bytes == b"<10>"
    assert host.send(b"<06>") == READY
    assert host.send(b"<07>") == b"<01\x00" + struct.pack("<6H", 115, 111, 185, 56, 52, 61) + b">"
    assert host.send(b"<05\xc8\x00>") == READY
    assert host.send(b"<03>") == READY
    assert host.send(b"<08>") == READY
    assert host.send(b"<99>") == b""


def test_reads_come_at_the_period_asked_for() -> None:
    host = Host()
    sent = host.send(b"<02" + struct.pack("<HI", 0, 10_000) + b">", wait_ns=1002 * MS)
    assert sent.startswith(READY + b"<09")
    stream = sent[len(READY) :]
    assert len(stream) == 100 * 18
    frames = [stream[at : at + 18] for at in range(0, len(stream), 18)]
    assert {(frame[:3], frame[17:]) for frame in frames} == {(b"<09", b">")}
    *counts, counter = struct.unpack("<6hH", frames[-1][3:17])
    assert counts == [-16384, 16384, 16384, -16384, 16384, 16384]
    assert counter == 1 + 990_000_000 // 128_500


def test_at_most_640_reads_a_second() -> None:
    host = Host()
    sent = host.send(b"<02" + struct.pack("<HI", 0, 0) + b">", wait_ns=1002 * MS)
    assert (len(sent) - len(READY)) // 18 == 640


def test_the_main_loop_sleeps_a_second_while_the_stream_goes_on() -> None:
    host = Host()
    host.send(b"<02" + struct.pack("<HI", 0, 100_000) + b">", wait_ns=10 * MS)
    meanwhile = host.send(b"<04>", wait_ns=980 * MS)
    assert READY not in meanwhile
    assert meanwhile.count(b"<09") == 9
    assert READY in host.wait(20 * MS)


def test_only_the_first_command_of_a_read_is_obeyed() -> None:
    host = Host()
    assert host.send(b"<06><06><06>", wait_ns=10 * S) == READY
    # Nine commands are 36 bytes: one of the first 32, then the last one.
    assert host.send(b"<06>" * 9, wait_ns=10 * S) == READY * 2


def test_an_incomplete_command_runs_into_what_the_buffer_held_before() -> None:
    host = Host()
    assert host.send(b"<05\xc8\x00>") == READY
    assert host.send(b"<06") == READY  # its end is that of the old command
    fresh = Host()
    assert fresh.send(b"<") == b""


def test_bytes_fed_one_by_one_with_time_that_goes_back_a_little() -> None:
    host = Host()
    host.wait(MS)
    sent = b"".join(host.node.feed(bytes([byte]), 500_000 + 87_000 * i) for i, byte in enumerate(b"<05\xc8\x00>"))
    assert sent + host.wait(5 * MS) == READY


def test_without_a_sensor_state_one_stale_full_scales_and_no_bootup() -> None:
    host = Host(connected=False)
    assert host.boot_bytes == b""
    assert host.send(b"<02" + struct.pack("<HI", 0, 1000) + b">") == b"<01\x01>"
    answer = host.send(b"<07>")
    assert len(answer) == 17
    assert answer[3] == 1
    assert host.send(b"<08>", wait_ns=60 * S) == b""
    assert host.send(b"<06>", wait_ns=60 * S) == b""


def test_a_command_after_a_reset_waits_for_the_reading_and_the_sleep() -> None:
    host = Host(eeprom_ns=33 * MS)
    host.wait(40 * MS)
    assert host.send(b"<08>", wait_ns=10 * MS) == b""
    assert host.send(b"<06>", wait_ns=50 * MS) == READY
    assert host.wait(900 * MS) == b""
    assert host.wait(200 * MS) == READY


def test_a_payload_may_hold_delimiters() -> None:
    fz_N = 185.0 * 0x3E3C / 16384  # both bytes of the count are delimiters
    host = Host(wrench=(0.0, 0.0, fz_N, 0.0, 0.0, 0.0))
    sent = host.send(b"<02" + struct.pack("<HI", 0, 100_000) + b">", wait_ns=100 * MS)
    assert b"\x3c\x3e" in sent


def test_zero_silence_and_reboot() -> None:
    host = Host()
    host.send(b"<02" + struct.pack("<HI", 1000, 10_000) + b">", wait_ns=1003 * MS)
    host.send(b"<04>", wait_ns=2 * MS)
    stream = host.wait(S)
    assert stream[3:15] == bytes(12)
    host.node.firmware.faults = Jr3Faults(silent=True)
    assert host.wait(S) == b""
    host.node.firmware.faults = Jr3Faults()
    host.node.reboot(host.now_ns)
    assert host.wait(S) == b"<10>"
