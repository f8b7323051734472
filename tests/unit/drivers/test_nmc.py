"""The NMC codec: golden bytes, replies and how much damage is found, scaling and settings."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.errors import RefusedError
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

GAINS = {
    "kp": 200, "kd": 1200, "ki": 150, "integration_limit": 15, "output_limit": 75, "current_limit": 0,
    "error_limit_counts": 4000, "servo_rate_divisor": 5, "deadband": 0,
}  # fmt: skip
NOW = TrajectoryControl.SERVO | TrajectoryControl.START_NOW
FAST = NOW | TrajectoryControl.VELOCITY_PROFILE
MADE = {
    "set address 1": (0, commands.set_addr(1)),
    "read identity": (1, commands.read_stat(StatusItem.IDENTITY)),
    "define status": (1, commands.def_stat(StatusItem(0x1F))),
    "no operation": (1, commands.NOP),
    "reset all": (EVERYBODY, commands.HARD_RESET),
    "57600 baud": (EVERYBODY, commands.set_baud(20)),
    "gains": (1, commands.set_gain(**GAINS)),
    "motor off": (1, stop_motor(StopControl.MOTOR_OFF)),
    "clear bits": (1, commands.CLEAR_BITS),
    "reset position": (1, commands.RESET_POS),
    "trapezoid": (1, load_traj(NOW, position_counts=0, velocity_word=0x28F5C3, acceleration_word=0x1AD7)),
    "velocity profile": (1, load_traj(FAST, velocity_word=0, acceleration_word=732)),
    "stop abruptly": (1, stop_motor(StopControl.AMP_ENABLE | StopControl.ABRUPT)),
    "one radian": (1, load_traj(NOW, position_counts=30558, velocity_word=100_000, acceleration_word=10_000)),
}
HERE = stop_motor(StopControl.AMP_ENABLE | StopControl.HERE, -1)


@pytest.mark.parametrize("name", golden.COMMANDS)
def test_command_becomes_golden_bytes(name):
    address, command = MADE[name]
    assert command.frame(address).hex() == golden.COMMANDS[name]
    assert command.size_bytes == len(golden.COMMANDS[name]) // 2


def test_golden_reply_is_decoded():
    reply = decode_reply(bytes.fromhex(golden.REPLY_OF_MASK_1F), StatusItem(0x1F))
    assert reply.status == NmcStatus.MOVE_DONE | NmcStatus.POS_ERROR
    assert (reply.position_counts, reply.analog, reply.velocity_counts_per_tick) == (0x2522, 0x4F, 0)
    assert reply.aux == Aux.ACCEL_DONE | Aux.SLEW_DONE
    assert (reply.home_counts, reply.identity, reply.position_error_counts, reply.path_points) == (0x5E0, *[None] * 3)


@pytest.mark.parametrize(
    "make",
    [
        lambda: NmcCommand(Code.NOP, bytes(16)),
        lambda: commands.NOP.frame(256),
        lambda: commands.set_addr(0),
        lambda: commands.set_addr(0x80),
        lambda: load_traj(NOW, position_counts=1 << 31),
        lambda: load_traj(NOW, velocity_word=-1),
        lambda: stop_motor(StopControl.HERE),
        lambda: stop_motor(StopControl.SMOOTH, 1),
        lambda: commands.set_gain(**{**GAINS, "servo_rate_divisor": 0}),
        lambda: commands.set_gain(**{**GAINS, "kp": 40_000}),
        lambda: velocity_word(float("nan")),
        lambda: velocity_word(-1.0),
        lambda: acceleration_word(float("inf")),
    ],
)
def test_command_that_does_not_fit_is_refused(make):
    with pytest.raises(RefusedError):
        make()


def test_words_are_scaled():
    assert velocity_word(1.0) == 34
    assert velocity_word(1e6) == 33_554_432
    assert acceleration_word(1e9) == 17_179_869
    assert velocity_word(30557.75) == 1_025_348
    assert acceleration_word(30557.75) == 525
    assert velocity_word(8000 / 60) == pytest.approx(4473.925, abs=0.5)
    assert acceleration_word(30557.75, 2) == 2100


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
    identity = reply.identity and (reply.identity.type_code, reply.identity.version)
    values = (
        (StatusItem.POSITION, "<i", (reply.position_counts,)),
        (StatusItem.ANALOG, "B", (reply.analog,)),
        (StatusItem.VELOCITY, "<h", (reply.velocity_counts_per_tick,)),
        (StatusItem.AUX, "B", (reply.aux,)),
        (StatusItem.HOME, "<i", (reply.home_counts,)),
        (StatusItem.IDENTITY, "BB", identity),
        (StatusItem.POSITION_ERROR, "<h", (reply.position_error_counts,)),
        (StatusItem.PATH_POINTS, "B", (reply.path_points,)),
    )
    items = b"".join(struct.pack(layout, *value) for item, layout, value in values if mask & item)
    assert with_sum(bytes((reply.status,)) + items) == raw


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


POS_VEL = StatusItem.POSITION | StatusItem.VELOCITY


def test_divisors_are_the_documented_ones():
    assert [BAUD_DIVISORS[baud] for baud in (19_200, 57_600, 115_200, 230_400)] == [63, 20, 10, 5]
    error = {baud: 1.25e6 / (divisor + 1) / baud - 1 for baud, divisor in BAUD_DIVISORS.items()}
    assert max(abs(error[baud]) for baud in (19_200, 57_600, 115_200)) < 0.035
    assert error[230_400] == pytest.approx(-0.096, abs=0.001)
    assert error[250_000] == 0.0
