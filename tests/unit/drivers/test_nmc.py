"""The NMC codec: golden bytes, replies and how much damage is found, scaling and settings."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.nmc import (
    Aux,
    NmcCommand,
    NmcStatus,
    Reply,
    StatusItem,
    StopControl,
    TrajectoryControl,
    acceleration_word,
    commands,
    load_traj,
    stop_motor,
    velocity_word,
)
from palpate.drivers.nmc.frames import EVERYBODY, Code, checksum
from palpate.drivers.nmc.replies import Discarded, decode_reply, reply_size_bytes
from palpate.drivers.nmc.settings import BAUD_DIVISORS
from tests.support import nmc_vectors as golden

NOW = TrajectoryControl.SERVO | TrajectoryControl.START_NOW
MADE = {
    "set address 1": (0, commands.set_addr(1)),
    "read identity": (1, commands.read_stat(StatusItem.IDENTITY)),
    "define status": (1, commands.def_stat(StatusItem(0x1F))),
    "no operation": (1, commands.NOP),
    "reset all": (EVERYBODY, commands.HARD_RESET),
    "57600 baud": (EVERYBODY, commands.set_baud(20)),
    "gains": (1, commands.set_gain(200, 1200, 150, 15, 75, 0, 4000, 5, 0)),
    "motor off": (1, stop_motor(StopControl.MOTOR_OFF)),
    "clear bits": (1, commands.CLEAR_BITS),
    "reset position": (1, commands.RESET_POS),
    "trapezoid": (1, load_traj(NOW, 0, 0x28F5C3, 0x1AD7)),
    "stop abruptly": (1, stop_motor(StopControl.AMP_ENABLE | StopControl.ABRUPT)),
    "one radian": (1, load_traj(NOW, 30558, 100_000, 10_000)),
}


@pytest.mark.parametrize("name", MADE)
def test_command_becomes_golden_bytes(name):
    address, command = MADE[name]
    assert command.frame(address).hex() == golden.COMMANDS[name]
    assert command.size_bytes == len(golden.COMMANDS[name]) // 2


def test_golden_reply_is_decoded():
    reply = decode_reply(bytes.fromhex(golden.REPLY_OF_MASK_1F), StatusItem(0x1F))
    assert reply.status == NmcStatus.MOVE_DONE | NmcStatus.POS_ERROR
    assert (reply.position_counts, reply.aux, reply.identity) == (0x2522, Aux(0x18), None)


def test_words_are_scaled():
    assert velocity_word(1.0) == 34
    assert velocity_word(1e6) == 33_554_432
    assert acceleration_word(1e9) == 17_179_869
    assert velocity_word(30557.75) == 1_025_348
    assert acceleration_word(30557.75) == 525
    assert velocity_word(8000 / 60) == pytest.approx(4473.925, abs=0.5)


@given(st.integers(0, 255), st.builds(NmcCommand, st.sampled_from(Code), st.binary(max_size=15)))
def test_frame_has_header_length_and_sum(address, command):
    frame = command.frame(address)
    assert frame[:2] == bytes((0xAA, address))
    assert frame[2] == len(command.data) << 4 | command.code
    assert frame[-1] == checksum(frame[1:-1])


MASKS = st.integers(0, 255).map(StatusItem)
SIZES = {0x01: 4, 0x02: 1, 0x04: 2, 0x08: 1, 0x10: 4, 0x20: 2, 0x40: 2, 0x80: 1}


def with_sum(body):
    return body + bytes((sum(body) % 256,))


@st.composite
def good_replies(draw):
    mask = draw(MASKS)
    status = draw(st.integers(1, 255).filter(lambda byte: not byte & NmcStatus.CKSUM_ERROR))
    size = sum(size for bit, size in SIZES.items() if mask & bit)
    return mask, with_sum(bytes((status,)) + draw(st.binary(min_size=size, max_size=size)))


@given(good_replies())
def test_good_reply_is_accepted_and_read_back(case):
    mask, raw = case
    reply = decode_reply(raw, mask)
    assert isinstance(reply, Reply)
    assert len(raw) == reply_size_bytes(mask)
    identity = reply.identity and bytes((reply.identity.type_code, reply.identity.version))
    position = reply.position_counts
    found = {
        StatusItem.POSITION: None if position is None else position.to_bytes(4, "little", signed=True),
        StatusItem.AUX: None if reply.aux is None else bytes((reply.aux,)),
        StatusItem.IDENTITY: identity,
    }
    at = 1
    for item, size in SIZES.items():
        there = raw[at : at + size] if mask & item else None
        assert found.get(StatusItem(item), there) == there
        at += size if mask & item else 0


@given(good_replies(), st.data())
def test_damaged_or_cut_reply_is_never_accepted(case, data):
    mask, raw = case
    index = data.draw(st.integers(0, len(raw) - 1))
    damaged = bytearray(raw)
    damaged[index] ^= data.draw(st.integers(1, 255))
    assert isinstance(decode_reply(bytes(damaged), mask), Discarded)
    assert decode_reply(raw[:index], mask) in (Discarded.MISSING, Discarded.SHORT)


@given(st.binary(max_size=40), MASKS)
def test_any_bytes_are_decoded_without_error(raw, mask):
    assert isinstance(decode_reply(raw, mask), Reply | Discarded)


def test_zeros_and_a_reply_to_a_damaged_command_are_not_believed():
    for mask in (StatusItem(0), StatusItem.POSITION, StatusItem(0xFF)):
        assert decode_reply(bytes(reply_size_bytes(mask)), mask) is Discarded.BLANK
    raw = with_sum(bytes((NmcStatus.CKSUM_ERROR | NmcStatus.POWER_ON, 1, 2, 3, 4)))
    assert decode_reply(raw, StatusItem.POSITION) is Discarded.REJECTED


def test_divisors_are_the_documented_ones():
    assert [BAUD_DIVISORS[baud] for baud in (19_200, 57_600, 115_200, 230_400)] == [63, 20, 10, 5]
    error = {baud: 1.25e6 / (divisor + 1) / baud - 1 for baud, divisor in BAUD_DIVISORS.items()}
    assert max(abs(error[baud]) for baud in (19_200, 57_600, 115_200)) < 0.035
    assert error[230_400] == pytest.approx(-0.096, abs=0.001)
    assert error[250_000] == 0.0
