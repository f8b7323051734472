"""A damaged file is never misread: what lies before the damage is kept, and the damage is named in one line."""

import random
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from palpate.adapters.log import read_log
from palpate.adapters.log.container import read_messages
from palpate.core.errors import LogError
from tests.unit.adapters.log.crafted import complaint, log_bytes, messages, read

CONTENT = messages(range(60))
DATA = log_bytes(CONTENT)


def kept(data: bytes) -> int:
    """How many messages are read of a damaged log; each must be as it was. -1 for a log that is refused."""
    try:
        log = read(data)
    except LogError:
        return -1
    assert log.damage.startswith("offset ")
    assert "\n" not in log.damage
    count = sum(log.counts.values())
    found, _ = read_messages("x", data)
    assert found[:count] == CONTENT[:count]
    assert log.missing == ""
    return count


@pytest.mark.parametrize("path", [None, "a\0b"])
def test_what_names_no_file_is_refused(path: Any) -> None:
    with pytest.raises(LogError, match="cannot be read"):
        read_log(path)


def test_cut_anywhere_all_complete_chunks_are_kept() -> None:
    counts = [kept(DATA[:length]) for length in range(0, len(DATA), 7)]
    assert counts == sorted(counts)
    assert counts[-1] == len(CONTENT)
    assert set(counts) == {-1, *range(14, len(CONTENT), 14), len(CONTENT)}


def test_any_flipped_bit_is_found() -> None:
    counts = set()
    for bit in random.Random(1).sample(range(8 * len(DATA)), 2000):
        broken = bytearray(DATA)
        broken[bit // 8] ^= 1 << bit % 8
        counts.add(kept(bytes(broken)))
    assert counts == {-1, *range(14, len(CONTENT), 14), len(CONTENT)}


@given(st.binary(max_size=300))
def test_any_bytes_at_all_are_refused(noise: bytes) -> None:
    for data in (noise, MCAP0_MAGIC + noise, MCAP0_MAGIC + noise + MCAP0_MAGIC):
        with pytest.raises(LogError):
            read(data)


def chunk_at(number: int) -> int:
    """Where a chunk of the log begins."""
    at = len(MCAP0_MAGIC)
    for _ in range(1000):
        opcode, length = struct.unpack_from("<BQ", DATA, at)
        if opcode == Opcode.CHUNK:
            number -= 1
        if number < 0:
            return at
        at += 9 + length
    raise ValueError


@pytest.mark.parametrize("kind", range(16))
def test_a_chunk_that_looks_like_something_else_ends_what_is_kept(kind: int) -> None:
    broken = bytearray(DATA)
    broken[chunk_at(2)] = kind if kind != Opcode.CHUNK else 0x86
    assert kept(bytes(broken)) == 28


def test_the_damage_is_named_with_its_place() -> None:
    broken = bytearray(DATA)
    broken[chunk_at(1) + 80] ^= 1
    assert read(bytes(broken)).damage.startswith(f"offset {chunk_at(1)}: ")
    assert "the recording was cut short" in read(DATA[: len(DATA) // 2]).damage
    at = DATA.index(b"palpate.log/2")  # in the metadata, outside of all chunks
    assert "the checksum of the data section is wrong" in read(DATA[:at] + b"X" + DATA[at + 1 :]).damage
    assert "1 bytes follow the end of the log" in read(DATA + b"x").damage


def test_sizes_of_a_chunk_that_are_not_true_are_refused() -> None:
    for claimed in (3, 2**40):
        head = struct.pack("<QQQII", 0, 0, claimed, 0, 4) + b"zstd" + struct.pack("<Q", 3) + b"abc"
        assert "can be read" in complaint(MCAP0_MAGIC + struct.pack("<BQ", Opcode.CHUNK, len(head)) + head)
