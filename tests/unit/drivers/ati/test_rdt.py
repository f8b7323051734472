"""RDT: golden bytes from ATI's manual and from a public client, and any bytes at all."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.ati.rdt import SATURATED, RdtCommand, RdtRecord, decode_records, encode_request, faults_in
from palpate.drivers.errors import RefusedError

WORD, COUNT = st.integers(0, 2**32 - 1), st.integers(-(2**31), 2**31 - 1)
RECORD = bytes.fromhex("0000000A 00004650 00000000 000F4240 FFF0BDC0 00000001 80000000 7FFFFFFF 00000000")


def test_golden_requests() -> None:
    # What the client netft 2.0.1 sends for startStreaming() and stopStreaming().
    assert encode_request(RdtCommand.REAL_TIME) == bytes.fromhex("1234 0002 00000000")
    assert encode_request(RdtCommand.STOP) == bytes.fromhex("1234 0000 00000000")
    assert encode_request(RdtCommand.REAL_TIME, 258) == bytes.fromhex("1234 0002 00000102")
    with pytest.raises(RefusedError):
        encode_request(RdtCommand.REAL_TIME, 2**32)


def test_golden_records_alone_and_together() -> None:
    counts = (1_000_000, -1_000_000, 1, -(2**31), 2**31 - 1, 0)
    record = RdtRecord(10, 18000, 0, counts)
    assert decode_records(RECORD) == [record]
    assert decode_records(RECORD * 3) == [record] * 3  # buffered mode


@given(st.lists(st.tuples(WORD, WORD, WORD, *[COUNT] * 6), max_size=40))
def test_any_records_are_read_as_they_were_packed(records: list[tuple[int, ...]]) -> None:
    found = decode_records(b"".join(struct.pack(">IIIiiiiii", *record) for record in records))
    assert [(r.rdt_sequence, r.ft_sequence, r.status, *r.counts) for r in found] == records


@given(st.binary(max_size=200))
def test_bytes_that_are_no_records_are_none(data: bytes) -> None:
    assert len(decode_records(data)) == (len(data) // 36 if len(data) % 36 == 0 else 0)


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (0, []),
        (SATURATED | 1 << 31, []),  # marks samples
        (0x8001_0000, []),  # a threshold of the box's own monitor, latched
        (0x8000_0000, ["bit 31"]),
        (0xC000_0000, ["CPU or RAM"]),
        (0x8000_0010, ["transducer unplugged"]),
        (0x8802_0400, ["serial link", "analog board watchdog"]),
        (0x0000_8000, ["unknown fault (bit 15)"]),
    ],
)
def test_a_status_word_names_its_faults(status: int, words: list[str]) -> None:
    faults = faults_in(status)
    assert len(faults) == len(words)
    assert all(word in fault for word, fault in zip(words, faults, strict=True))
