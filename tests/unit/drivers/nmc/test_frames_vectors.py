"""Golden vectors: from the tests of PyLabRobot's NMC module, or calculated by hand from the protocol's tables."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.errors import RefusedError
from palpate.drivers.nmc import (
    Aux,
    NmcCommand,
    NmcStatus,
    StatusItem,
    StopControl,
    TrajectoryControl,
    acceleration_word,
    commands,
    velocity_word,
)
from palpate.drivers.nmc.frames import EVERYBODY, Code, checksum, find_frame
from palpate.drivers.nmc.replies import decode_reply, reply_size_bytes

GAINS = {
    "kp": 200,
    "kd": 1200,
    "ki": 150,
    "integration_limit": 15,
    "output_limit": 75,
    "current_limit": 0,
    "error_limit_counts": 4000,
    "servo_rate_divisor": 5,
    "deadband": 0,
}
NOW = TrajectoryControl.SERVO | TrajectoryControl.START_NOW
VECTORS = [
    ("set address 1", 0, commands.set_addr(1), "aa002101ff21"),
    ("read identity", 1, commands.read_stat(StatusItem.IDENTITY), "aa01132034"),
    ("define status", 1, commands.def_stat(StatusItem(0x1F)), "aa01121f32"),
    ("no operation", 1, commands.NOP, "aa010e0f"),
    ("reset all", EVERYBODY, commands.HARD_RESET, "aaff0f0e"),
    ("57600 baud", EVERYBODY, commands.set_baud(20), "aaff1a142d"),
    ("gains", 1, commands.set_gain(**GAINS), "aa01e6c800b00496000f004b00a00f050007"),
    ("motor off", 1, commands.stop_motor(StopControl.MOTOR_OFF), "aa0117021a"),
    ("clear bits", 1, commands.CLEAR_BITS, "aa010b0c"),
    ("reset position", 1, commands.RESET_POS, "aa010001"),
    (
        "trapezoid",
        1,
        commands.load_traj(NOW, position_counts=0, velocity_word=0x28F5C3, acceleration_word=0x1AD7),
        "aa01d49700000000c3f52800d71a00003d",
    ),
    (
        "velocity profile",
        1,
        commands.load_traj(NOW | TrajectoryControl.VELOCITY_PROFILE, velocity_word=0, acceleration_word=732),
        "aa0194b600000000dc02000029",
    ),
    ("stop abruptly", 1, commands.stop_motor(StopControl.AMP_ENABLE | StopControl.ABRUPT), "aa0117051d"),
    (
        "one radian",
        1,
        commands.load_traj(NOW, position_counts=30558, velocity_word=100_000, acceleration_word=10_000),
        "aa01d4975e770000a0860100102700009f",
    ),
]
COMMANDS = st.builds(NmcCommand, st.sampled_from(Code), st.binary(max_size=15))


@pytest.mark.parametrize(("address", "command", "frame"), [v[1:] for v in VECTORS], ids=[v[0] for v in VECTORS])
def test_vector_both_ways(address, command, frame):
    assert command.frame(address).hex() == frame
    assert find_frame(bytes.fromhex(frame)) == (address, command)
    assert command.size_bytes == len(frame) // 2


def test_captured_reply():
    reply = decode_reply(bytes.fromhex("11222500004f000018e0050000a4"), StatusItem(0x1F))
    assert reply.status == NmcStatus.MOVE_DONE | NmcStatus.POS_ERROR
    assert (reply.position_counts, reply.analog, reply.velocity_counts_per_tick) == (0x2522, 0x4F, 0)
    assert reply.aux == Aux.ACCEL_DONE | Aux.SLEW_DONE
    assert (reply.home_counts, reply.identity, reply.position_error_counts, reply.path_points) == (0x5E0, *[None] * 3)
    assert reply_size_bytes(StatusItem(0x1F)) == 14


def test_other_commands_have_their_codes_and_sizes():
    made = {
        commands.set_addr(3): (1, b"\x03\xff"),
        commands.stop_motor(StopControl.AMP_ENABLE | StopControl.HERE, -1): (7, b"\x11\xff\xff\xff\xff"),
        commands.set_gain(**GAINS, step_multiplier=2): (6, bytes.fromhex("c800b00496000f004b00a00f050002")),
    }
    for command, (code, data) in made.items():
        assert (command.code, command.data) == (code, data)


@pytest.mark.parametrize(
    "make",
    [
        lambda: NmcCommand(Code.NOP, bytes(16)),
        lambda: commands.NOP.frame(256),
        lambda: commands.set_addr(0),
        lambda: commands.set_addr(0x80),
        lambda: commands.load_traj(NOW, position_counts=1 << 31),
        lambda: commands.load_traj(NOW, velocity_word=-1),
        lambda: commands.stop_motor(StopControl.HERE),
        lambda: commands.stop_motor(StopControl.SMOOTH, 1),
        lambda: commands.set_gain(**{**GAINS, "servo_rate_divisor": 0}),
        lambda: commands.set_gain(**{**GAINS, "kp": 40_000}),
        lambda: velocity_word(float("nan")),
        lambda: velocity_word(-1.0),
        lambda: acceleration_word(float("inf")),
    ],
)
def test_what_does_not_fit_is_refused(make):
    with pytest.raises(RefusedError):
        make()


def test_scaling():
    assert velocity_word(1.0) == 34
    assert velocity_word(1e6) == 33_554_432
    assert acceleration_word(1e9) == 17_179_869
    assert velocity_word(30557.75) == 1_025_348
    assert acceleration_word(30557.75) == 525
    assert velocity_word(8000 / 60) == pytest.approx(4473.925, abs=0.5)
    assert acceleration_word(30557.75, 2) == 2100


@given(st.integers(0, 255), COMMANDS, st.binary(max_size=8).filter(lambda noise: 0xAA not in noise))
def test_codec_round_trip(address, command, noise):
    frame = command.frame(address)
    assert frame[0] == 0xAA
    assert frame[-1] == checksum(frame[1:-1])
    assert find_frame(noise + frame) == (address, command)


@given(st.binary(max_size=64))
def test_any_bytes_are_searched_without_error(data):
    find_frame(data)
