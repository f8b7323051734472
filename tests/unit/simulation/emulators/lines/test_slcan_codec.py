"""The adapter's side of the slcan line protocol."""

import pytest

from palpate.simulation.emulators.lines.can_bus import BusFrame
from palpate.simulation.emulators.lines.slcan import Adapter, ChannelMode, frame_line


def opened() -> Adapter:
    adapter = Adapter()
    assert adapter.take(b"S8\rO\r") == (b"\r\r", [])
    return adapter


def test_the_greeting_of_python_can() -> None:
    adapter = Adapter()
    # Close, set, an empty line, and open twice.
    assert adapter.take(b"C\rS8\r\rO\rO\r") == (b"\a\r\r\a", [])
    assert adapter.mode is ChannelMode.OPEN
    assert adapter.bit_rate_Hz == 1_000_000
    assert adapter.take(b"C\r") == (b"\r", [])
    assert adapter.mode is ChannelMode.CLOSED


def test_frames_of_the_host() -> None:
    adapter = opened()
    assert adapter.take(b"t2016C80010270000\r") == (b"z\r", [BusFrame(0x201, bytes.fromhex("C80010270000"))])
    assert adapter.take(b"t0800\r") == (b"z\r", [BusFrame(0x080, b"")])
    assert adapter.take(b"T000002016C80010270000\r") == (b"Z\r", [])
    assert adapter.take(b"r2010\rR000002010\r") == (b"z\rZ\r", [])


def test_a_line_may_come_in_pieces() -> None:
    adapter = opened()
    assert adapter.take(b"t08") == (b"", [])
    assert adapter.take(b"00\rt0") == (b"z\r", [BusFrame(0x080, b"")])


@pytest.mark.parametrize(
    "line",
    [
        b"t",
        b"t080",
        b"t0809",
        b"t08G0",
        b"t0801",
        b"t0801A",
        b"t08011G",
        b"t0801112",
        b"t8000",
        b"T200000000",
        b"r08000",
        b"S8",
        b"S9",
        b"s0014",
        b"O",
        b"L",
        b"X",
        b"V1",
        b"\xff\xfe",
        b"t" * 40,
    ],
)
def test_bad_lines_ring_the_bell(line: bytes) -> None:
    adapter = opened()
    assert adapter.take(line + b"\r") == (b"\a", [])
    assert adapter.take(b"t0800\r") == (b"z\r", [BusFrame(0x080, b"")])


def test_nothing_is_sent_while_closed_or_only_listening() -> None:
    adapter = Adapter()
    assert adapter.take(b"t0800\rL\rt0800\r") == (b"\a\r\a", [])
    assert adapter.mode is ChannelMode.LISTEN_ONLY


def test_version_serial_number_and_flags() -> None:
    adapter = Adapter()
    assert adapter.take(b"V\rN\rF\r") == (b"V1013\rNPALP\r\a", [])
    adapter = opened()
    adapter.overrun = True
    assert adapter.take(b"F\rF\r") == (b"F01\rF00\r", [])


def test_setting_the_registers_leaves_the_rate_unknown() -> None:
    adapter = Adapter()
    adapter.take(b"S8\r")
    assert adapter.take(b"s0014\r") == (b"\r", [])
    assert adapter.bit_rate_Hz is None


def test_frames_for_the_host() -> None:
    assert frame_line(BusFrame(0x601, bytes.fromhex("01AB"))) == b"t601201AB\r"
    assert frame_line(BusFrame(0x001, b"")) == b"t0010\r"
