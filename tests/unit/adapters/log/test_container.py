"""A damaged file is never misread: cut, flipped, made up or lying about its sizes, it is refused in one line."""

import random
import re
import struct
from typing import Any

import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from palpate.adapters.log import container, read_log
from palpate.adapters.log.container import outer_records
from palpate.core.errors import LogError
from tests.unit.adapters.log.crafted import SMALL, complaint, log_bytes, read


@pytest.mark.parametrize("path", [None, "a\0b"])
def test_what_names_no_file_is_refused(path: Any) -> None:
    with pytest.raises(LogError, match="cannot be read"):
        read_log(path)


def test_cut_at_any_byte_it_is_noticed() -> None:
    data = log_bytes(SMALL)
    for length in range(0, len(data), 5):
        assert "footer" in complaint(data[:length]) or "offset" in complaint(data[:length]) or not length


def test_with_any_bit_flipped_it_is_noticed() -> None:
    data = log_bytes(SMALL)
    for bit in random.Random(1).sample(range(8 * len(data)), 3000):
        broken = bytearray(data)
        broken[bit // 8] ^= 1 << bit % 8
        assert "x.mcap: " in complaint(bytes(broken)), bit


@given(st.binary(max_size=300))
def test_any_bytes_at_all_are_refused(noise: bytes) -> None:
    for data in (noise, MCAP0_MAGIC + noise, MCAP0_MAGIC + noise + MCAP0_MAGIC):
        with pytest.raises(LogError):
            read(data)


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def file_of(*records: bytes) -> bytes:
    """A file without checksums of its own."""
    end = record(Opcode.DATA_END, bytes(4)) + record(Opcode.FOOTER, bytes(20))
    return MCAP0_MAGIC + b"".join(records) + end + MCAP0_MAGIC


def chunk(compression: str, data: bytes, claimed: int, crc: int = 0) -> bytes:
    name = compression.encode()
    head = struct.pack("<QQQII", 0, 0, claimed, crc, len(name)) + name
    return record(Opcode.CHUNK, head + struct.pack("<Q", len(data)) + data)


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ([chunk("zstd", zstandard.compress(bytes(10**7)), 100)], "a chunk is not as long as it claims"),
        ([chunk("zstd", zstandard.compress(b"abc"), 100)], "a chunk is not as long as it claims"),
        ([chunk("zstd", b"abc", 3)], "a chunk cannot be unpacked"),
        ([chunk("lz4", b"abc", 3)], "a chunk is not as long as it claims"),
        ([chunk("lz4", bytes(30), 3)], "a chunk cannot be unpacked"),
        ([chunk("brotli", b"abc", 3)], "a chunk cannot be unpacked (unknown compression 'brotli')"),
        ([chunk("", b"abc", 3)], "a chunk ends within a record"),
        ([chunk("", b"abc", 3, crc=1)], "the checksum of a chunk is wrong"),
        ([chunk("zstd", zstandard.compress(b"abc"), 2**40)], "claims 1099511627776 bytes, more than any log of ours"),
        ([chunk("", record(Opcode.MESSAGE, b""), 9)], "a chunk ends within a record"),
        ([record(Opcode.MESSAGE, b"abc")], "a message is shorter than its head"),
        ([record(Opcode.CHANNEL, b"abc")], "a Channel record cannot be read"),
        ([record(Opcode.CHUNK, b"abc")], "a Chunk record cannot be read"),
        ([struct.pack("<BQ", Opcode.CHUNK, 2**63)], "the file ends within a record"),
    ],
)
def test_lengths_and_sizes_that_lie_are_refused(records: list[bytes], expected: str) -> None:
    assert expected in complaint(file_of(*records))


def test_many_chunks_cannot_claim_more_than_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(container, "_MOST_BYTES", 1000)
    filler = record(0x80, bytes(391))
    assert "more than any log of ours" in complaint(file_of(*[chunk("", filler, 400)] * 3))


def test_offsets_in_complaints_are_those_of_the_file() -> None:
    data = log_bytes(SMALL)
    chunks = [(at, body) for opcode, at, body in outer_records("x", data, 8) if opcode == Opcode.CHUNK]
    at, body = chunks[1]
    broken = bytearray(data)
    broken[at + 9 + len(body) // 2] ^= 1
    found = re.search(r"offset (\d+)", complaint(bytes(broken)))
    assert found is not None
    assert int(found[1]) == at


def test_a_checksum_of_the_data_covers_what_lies_between_chunks() -> None:
    data = log_bytes(SMALL)
    at = data.index(b"palpate.log/2")  # in the metadata, which no chunk's checksum covers
    assert "the checksum of the data section is wrong" in complaint(data[:at] + b"X" + data[at + 1 :])
