"""The serial parser: golden frames, any chunking, delimiters inside payloads, garbage between, bounded memory."""

import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from palpate.drivers.errors import RefusedError
from palpate.drivers.jr3.codec_uart import MAX_FRAME, UartParser, encode_uart, nudged
from palpate.drivers.jr3.messages import Ack, Bootup, Message, Op, Reading, Request

COUNT = st.integers(-32768, 32767)
READINGS = st.builds(Reading, st.tuples(COUNT, COUNT, COUNT), st.tuples(COUNT, COUNT, COUNT), st.integers(0, 0xFFFF))
SHORT_ACKS = st.builds(Ack, st.booleans())
SCALES = st.integers(1, 9999)
LONG_ACKS = st.builds(Ack, st.booleans(), st.tuples(*[SCALES] * 6))
QUIET_BYTES = st.binary(max_size=40).map(lambda data: data.replace(b"<", b"-"))


def frame_of(message: Message) -> bytes:
    if isinstance(message, Reading):
        return b"<09" + struct.pack("<6hH", *message.forces, *message.moments, message.counter) + b">"
    if isinstance(message, Bootup):
        return b"<10>"
    return b"<01" + bytes([not message.ready]) + struct.pack(f"<{len(message.scales)}H", *message.scales) + b">"


def test_golden_commands() -> None:
    assert (
        encode_uart(Request(Op.START, cutoff_cHz=200, period_us=10_000))
        == b"<02" + bytes.fromhex("C80010270000") + b">"
    )
    assert encode_uart(Request(Op.STOP)) == b"<03>"
    assert encode_uart(Request(Op.GET_STATE)) == b"<06>"
    assert encode_uart(Request(Op.GET_SCALES)) == b"<07>"


@pytest.mark.parametrize(
    "request_", [Request(Op.GET_FORCE_SCALES), Request(Op.START, 0x3C, 200), Request(Op.START, 200, 0x3E00)]
)
def test_what_this_board_would_misread_is_refused(request_: Request) -> None:
    with pytest.raises(RefusedError):
        encode_uart(request_)


def test_golden_answers() -> None:
    parser = UartParser()
    stream = b"<10><01\x00>" + bytes.fromhex("3C3039 0100FFFF0080 FF7F00000100 FFFF 3E")
    assert parser.feed(stream) == [Bootup(), Ack(True), Reading((1, -1, -32768), (32767, 0, 1), 65535)]
    parser.expect_scales = True
    scales = bytes.fromhex("3C3031 00 7300 6F00 B900 3800 3400 3D00 3E")
    assert parser.feed(scales) == [Ack(True, (115, 111, 185, 56, 52, 61))]
    assert (parser.counts.good, parser.counts.garbage, parser.pending) == (4, 0, 0)


def test_a_full_scale_of_62_N_does_not_end_the_acknowledgement() -> None:
    # 62 is '>': where a short acknowledgement would end.
    parser = UartParser()
    parser.expect_scales = True
    long = Ack(True, (62, 62, 62, 62, 62, 62))
    assert parser.feed(frame_of(long)) == [long]
    assert parser.feed(frame_of(Ack(True)) + frame_of(long)) == [Ack(True), long]


def test_a_short_answer_where_full_scales_are_expected_waits_for_what_follows() -> None:
    parser = UartParser()
    parser.expect_scales = True
    assert parser.feed(b"<01\x01>") == []
    assert parser.feed(b"<10>") == [Ack(False), Bootup()]


@given(st.lists(READINGS | SHORT_ACKS | st.just(Bootup()), max_size=12), QUIET_BYTES, st.data())
def test_the_chunking_does_not_matter_and_garbage_between_costs_nothing(
    messages: list[Message], garbage: bytes, data: st.DataObject
) -> None:
    stream = b"".join(garbage + frame_of(message) for message in messages)
    whole, split = UartParser(), UartParser()
    assert whole.feed(stream) == messages
    heard: list[Message] = []
    rest = stream
    while rest:
        size = data.draw(st.integers(1, 25))
        heard += split.feed(rest[:size])
        rest = rest[size:]
        assert split.pending < MAX_FRAME
    assert heard == messages
    assert split.counts == whole.counts
    assert whole.counts.garbage == len(garbage) * len(messages)


@given(st.binary(max_size=300), st.lists(st.integers(1, 40), max_size=60), st.booleans())
@example(b"<01\x00><01\x01>>", [1] * 20, True)
def test_any_bytes_in_any_chunks_say_the_same_and_are_accounted_for(
    stream: bytes, sizes: list[int], expect_scales: bool
) -> None:
    whole, split = UartParser(), UartParser()
    whole.expect_scales = split.expect_scales = expect_scales
    messages = whole.feed(stream)
    heard: list[Message] = []
    for size in sizes:
        heard += split.feed(stream[:size])
        stream_left = stream[size:]
        assert split.pending < MAX_FRAME
        stream = stream_left
    heard += split.feed(stream)
    assert heard == messages
    assert split.counts == whole.counts
    assert split.pending == whole.pending < MAX_FRAME


@given(LONG_ACKS.filter(lambda ack: b"<" not in frame_of(ack)[1:]))
def test_full_scales_come_back(ack: Ack) -> None:
    parser = UartParser()
    parser.expect_scales = True
    assert parser.feed(frame_of(ack)) == [ack]


@given(st.binary(max_size=60), st.lists(READINGS.filter(lambda r: b"<" not in frame_of(r)[1:]), min_size=2, max_size=5))
@example(b"<09", [Reading((0, 0, 0), (0x3E00, 0x3E3E, 0), 1), Reading((1, 2, 3), (4, 5, 6), 2)])
def test_after_any_garbage_at_most_one_frame_is_lost(garbage: bytes, readings: list[Reading]) -> None:
    heard = UartParser().feed(garbage + b"".join(frame_of(reading) for reading in readings))
    assert heard[-len(readings) + 1 :] == readings[1:]


def test_share_of_single_bit_errors_that_pass_as_good() -> None:
    # No checksum: what hits the 14 payload bytes passes, and of what hits the frame around them nothing does.
    original = Reading((100, -200, 300), (10, -20, 30), 4711)
    frame = frame_of(original)
    passed = 0
    for bit in range(8 * len(frame)):
        damaged = bytearray(frame)
        damaged[bit // 8] ^= 1 << bit % 8
        passed += len(UartParser().feed(bytes(damaged))) > 0
    assert passed / (8 * len(frame)) == pytest.approx(14 / 18)


@pytest.mark.parametrize(("wanted", "size", "nearest"), [(60, 2, 59), (62, 2, 61), (0x3C7F, 2, 0x3BFF), (0, 2, 0)])
def test_nudges(wanted: int, size: int, nearest: int) -> None:
    assert nudged(wanted, size) == nearest


def test_no_cutoff_and_no_period_is_nudged_far() -> None:
    distances = [abs(nudged(value, 2) - value) for value in range(0x10000)]
    assert max(distances) == 128
    periods = [value for high in range(0, 1_000_000, 0x10000) for value in range(high + 0x3B00, high + 0x4000, 7)]
    assert max(abs(nudged(value, 4) - value) / value for value in periods) < 0.0084
    for value in (*range(0x10000), *periods):
        size = 2 if value < 0x10000 else 4
        assert not {0x3C, 0x3E} & set(nudged(value, size).to_bytes(size, "little"))


def test_a_value_that_does_not_fit_is_refused() -> None:
    with pytest.raises(RefusedError):
        nudged(1 << 20, 1)
