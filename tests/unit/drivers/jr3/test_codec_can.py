"""CAN frames: golden ones, every field of every message, and anything at all."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.can.link import CanFrame, FrameKind
from palpate.drivers.errors import RefusedError
from palpate.drivers.jr3.codec_can import CanDecoder, encode_can
from palpate.drivers.jr3.messages import Ack, Bootup, Forces, Moments, Op, Request

COUNTS = st.tuples(*[st.integers(-32768, 32767)] * 3)
U16 = st.integers(0, 0xFFFF)


def test_the_start_of_the_firmwares_readme() -> None:
    # cansend can0 201#C80010270000: node 1, asynchronous, 2 Hz, 10 ms.
    frame = encode_can(Request(Op.START, cutoff_cHz=200, period_us=10_000), 1)
    assert frame == CanFrame(0x201, bytes.fromhex("C80010270000"))


@pytest.mark.parametrize(
    ("request_", "can_id", "data"),
    [
        (Request(Op.STOP), 0x282, ""),
        (Request(Op.GET_STATE), 0x402, ""),
        (Request(Op.GET_FORCE_SCALES), 0x482, ""),
        (Request(Op.GET_MOMENT_SCALES), 0x502, ""),
    ],
)
def test_every_command(request_: Request, can_id: int, data: str) -> None:
    assert encode_can(request_, 2) == CanFrame(can_id, bytes.fromhex(data))


@pytest.mark.parametrize(
    ("request_", "node"),
    [
        (Request(Op.STOP), 0),
        (Request(Op.STOP), 128),
        (Request(Op.START, cutoff_cHz=65536), 1),
        (Request(Op.START, period_us=-1), 1),
    ],
)
def test_what_no_board_may_get(request_: Request, node: int) -> None:
    with pytest.raises(RefusedError):
        encode_can(request_, node)


def test_golden_answers() -> None:
    decoder = CanDecoder(1)
    assert decoder.decode(CanFrame(0x101, b"\0")) == Ack(True)
    assert decoder.decode(CanFrame(0x101, b"\1")) == Ack(False)
    assert decoder.decode(CanFrame(0x101, bytes.fromhex("0073006F00B900"))) == Ack(True, (115, 111, 185))
    assert decoder.decode(CanFrame(0x601, bytes.fromhex("0100FFFF0080FFFF"))) == Forces((1, -1, -32768), 65535)
    assert decoder.decode(CanFrame(0x681, bytes.fromhex("FF7F000001000200"))) == Moments((32767, 0, 1), 2)
    assert decoder.decode(CanFrame(0x701)) == Bootup()
    assert decoder.counts.good == 6


@given(COUNTS, COUNTS, U16, st.integers(1, 127))
def test_readings_come_back(force: tuple[int, ...], moment: tuple[int, ...], counter: int, node: int) -> None:
    decoder = CanDecoder(node)
    assert decoder.decode(CanFrame(0x600 + node, struct.pack("<3hH", *force, counter))) == Forces(force, counter)
    assert decoder.decode(CanFrame(0x680 + node, struct.pack("<3hH", *moment, counter))) == Moments(moment, counter)


@pytest.mark.parametrize(
    ("frame", "counted"),
    [
        (CanFrame(0x701, b"\x05"), "garbage"),  # a CANopen heartbeat
        (CanFrame(0x601, bytes(7)), "garbage"),
        (CanFrame(0x681, b""), "garbage"),
        (CanFrame(0x101, bytes(2)), "garbage"),
        (CanFrame(0x101, b"\x02"), "garbage"),
        (CanFrame(0x602, bytes(8)), "foreign"),
        (CanFrame(0x080), "foreign"),
        (CanFrame(0x281), "foreign"),
        (CanFrame(0x601, bytes(8), FrameKind.ERROR), "garbage"),
        (CanFrame(0x601, bytes(8), FrameKind.EXTENDED), "garbage"),
        (CanFrame(0x601, b"", FrameKind.REMOTE), "garbage"),
        (CanFrame(0x601, bytes(8), FrameKind.FD), "garbage"),
        (CanFrame(0x801 + 0x600, bytes(8)), "garbage"),
    ],
)
def test_what_is_not_ours_is_counted(frame: CanFrame, counted: str) -> None:
    decoder = CanDecoder(1)
    assert decoder.decode(frame) is None
    assert getattr(decoder.counts, counted) == 1
    assert decoder.counts.good == 0


@given(st.integers(-1, 1 << 29), st.binary(max_size=64), st.sampled_from(FrameKind))
def test_no_frame_raises_and_each_is_counted_once(can_id: int, data: bytes, kind: FrameKind) -> None:
    decoder = CanDecoder(1)
    decoder.decode(CanFrame(can_id, data, kind))
    counts = decoder.counts
    assert counts.good + counts.foreign + counts.garbage == 1
