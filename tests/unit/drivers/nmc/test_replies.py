"""What the decoder accepts, and how much it lets through that is wrong."""

import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.nmc.frames import NmcStatus, StatusItem
from palpate.drivers.nmc.replies import Discarded, Reply, decode_reply, reply_size_bytes

MASKS = st.integers(0, 255).map(StatusItem)
SIZES = {0x01: 4, 0x02: 1, 0x04: 2, 0x08: 1, 0x10: 4, 0x20: 2, 0x40: 2, 0x80: 1}
TRIALS = 60_000


def with_sum(body):
    return body + bytes((sum(body) % 256,))


@st.composite
def good_replies(draw):
    mask = draw(MASKS)
    status = draw(st.integers(1, 255).filter(lambda byte: not byte & NmcStatus.CKSUM_ERROR))
    items = draw(st.binary(min_size=sum(size for bit, size in SIZES.items() if mask & bit)).map(bytes))
    items = items[: sum(size for bit, size in SIZES.items() if mask & bit)]
    return mask, with_sum(bytes((status,)) + items)


@given(good_replies())
def test_good_reply_is_accepted_and_read_back(case):
    mask, raw = case
    reply = decode_reply(raw, mask)
    assert isinstance(reply, Reply)
    assert len(raw) == reply_size_bytes(mask)
    items = b""
    if mask & StatusItem.POSITION:
        items += struct.pack("<i", reply.position_counts)
    if mask & StatusItem.ANALOG:
        items += bytes((reply.analog,))
    if mask & StatusItem.VELOCITY:
        items += struct.pack("<h", reply.velocity_counts_per_tick)
    if mask & StatusItem.AUX:
        items += bytes((reply.aux,))
    if mask & StatusItem.HOME:
        items += struct.pack("<i", reply.home_counts)
    if mask & StatusItem.IDENTITY:
        items += bytes((reply.identity.type_code, reply.identity.version))
    if mask & StatusItem.POSITION_ERROR:
        items += struct.pack("<h", reply.position_error_counts)
    if mask & StatusItem.PATH_POINTS:
        items += bytes((reply.path_points,))
    assert with_sum(bytes((reply.status,)) + items) == raw


@given(good_replies(), st.data())
def test_one_corrupted_byte_is_always_found(case, data):
    mask, raw = case
    index = data.draw(st.integers(0, len(raw) - 1))
    raw = bytearray(raw)
    raw[index] ^= data.draw(st.integers(1, 255))
    assert isinstance(decode_reply(bytes(raw), mask), Discarded)


@given(good_replies(), st.data())
def test_cut_reply_is_never_accepted(case, data):
    mask, raw = case
    kept = raw[: data.draw(st.integers(0, len(raw) - 1))]
    assert decode_reply(kept, mask) in (Discarded.MISSING, Discarded.SHORT)


@given(st.binary(max_size=40), MASKS)
def test_any_bytes_are_decoded_without_error(raw, mask):
    assert isinstance(decode_reply(raw, mask), Reply | Discarded)


def test_share_of_random_corruptions_that_pass():
    """1 in 256 by theory; CKSUM_ERROR halves it for noise, where that bit is set in half of all status bytes."""
    draw = random.Random(1)
    mask = StatusItem.POSITION | StatusItem.AUX
    size = reply_size_bytes(mask)
    noise = sum(isinstance(decode_reply(draw.randbytes(size), mask), Reply) for _ in range(TRIALS))
    assert noise / TRIALS == pytest.approx(1 / 512, rel=0.25)
    good = with_sum(bytes((9, 1, 2, 3, 0, 4)))
    passed = 0
    for _ in range(TRIALS):
        raw = bytearray(good)
        for index in draw.sample(range(size), 2):
            raw[index] ^= draw.randrange(1, 256)
        passed += isinstance(decode_reply(bytes(raw), mask), Reply)
    assert passed / TRIALS == pytest.approx(1 / 256, rel=0.25)


def test_zeros_of_a_stuck_line_are_not_a_reply():
    for mask in (StatusItem(0), StatusItem.POSITION, StatusItem(0xFF)):
        assert decode_reply(bytes(reply_size_bytes(mask)), mask) is Discarded.BLANK


def test_a_module_that_received_a_damaged_command_is_not_believed():
    raw = with_sum(bytes((NmcStatus.CKSUM_ERROR | NmcStatus.POWER_ON, 1, 2, 3, 4)))
    assert decode_reply(raw, StatusItem.POSITION) is Discarded.REJECTED
