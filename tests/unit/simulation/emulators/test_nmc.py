"""The NMC chain: golden bytes, addresses, groups and rates; the servo of a module; its motion profile."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.simulation.emulators.nmc.motion import ONE_COUNT, Profile
from tests.support import nmc_vectors as golden
from tests.unit.simulation.emulators.nmc_host import Bench, command

MOVE_DONE, POWER, POSITION_ERROR = 0x01, 0x08, 0x10
SERVO_ON = 0x04


def test_golden_commands_have_golden_replies():
    bench = Bench(modules=1)
    for name, reply in golden.CONVERSATION:
        assert bench.raw(bytes.fromhex(golden.COMMANDS[name])).hex() == reply, name
        module = bench.bus.modules[0]
        if name == "gains":
            gains = module.servo.gains
            assert (gains.kp, gains.kd, gains.ki, gains.integration_limit) == (200, 1200, 150, 15)
            assert (gains.output_limit, gains.current_limit, gains.error_limit, gains.rate_divisor) == (75, 0, 4000, 5)
        if name == "one radian":
            buffer = module.servo.buffer
            assert (buffer.control, buffer.position_counts) == (0x97, 30_558)
            assert (buffer.velocity, buffer.acceleration) == (100_000, 10_000)
    assert (module.rejected, module.address, bench.bus.baud) == (0, 0, 19_200)


def test_golden_reply_of_mask_1f():
    bench = Bench(modules=1).addressed()
    bench.bus.modules[0].analog = 0x4F
    bench.bus.set_power(powered=False)
    bench.bus.modules[0].servo.home_counts = 0x5E0
    bench.plant.push(0, 0x2522)
    bench.wait(2)
    for _ in range(2):
        assert bench.raw(bytes.fromhex(golden.COMMANDS["define status"])).hex() == golden.REPLY_OF_MASK_1F


def test_wrong_checksum_is_reported_and_the_command_ignored():
    bench = Bench(modules=1).addressed()
    for code, data in ((0x2, b"\x01"), (0xF, b"")):
        wrong = bytearray(command(1, code, data))
        wrong[-1] ^= 0x40
        assert bench.raw(bytes(wrong)) == b"\x1b\x1b"
        assert (bench.bus.modules[0].mask, bench.bus.modules[0].address) == (0, 1)
        assert bench.status(1) == 0x19  # about the last command only


@pytest.mark.parametrize("cut", range(1, 17))
def test_zeros_end_a_partial_frame(cut):
    bench = Bench(modules=1).addressed()
    bench.raw(command(1, 0x4, bytes(range(1, 14)))[:cut])
    bench.raw(bytes(30))
    assert bench.raw(b"\x00\x55\x01\xff" + command(1, 0xE)) == b"\x19\x19"  # noise between frames is skipped


def bench_of_one():
    return Bench(modules=1).running()


def test_position_error_trips_at_the_limit_and_stays_until_cleared():
    bench = bench_of_one()
    bench.plant.jam(0)
    bench.ask(1, 0x7, b"\x11" + struct.pack("<i", 4_000))
    bench.wait(1)
    assert bench.auxiliary(1) & SERVO_ON
    assert struct.unpack("<h", bench.read(1, 0x40)) == (4_000,)
    assert bench.status(1) & POSITION_ERROR == 0
    bench.ask(1, 0x7, b"\x11" + struct.pack("<i", 4_001))
    bench.wait(1)
    assert bench.auxiliary(1) & SERVO_ON == 0
    bench.ask(1, 0xB)
    assert bench.status(1) & POSITION_ERROR
    bench.ask(1, 0x7, b"\x05")
    assert bench.status(1) & POSITION_ERROR  # sticky
    assert bench.ask(1, 0xB).status == MOVE_DONE | POWER


@settings(max_examples=60, deadline=None)
@given(
    target=st.integers(-3_000, 3_000),
    velocity=st.integers(1 << 14, 1 << 21),
    acceleration=st.integers(100, 1 << 18),
    change=st.integers(0, 400),
    second=st.integers(-3_000, 3_000),
)
def test_trapezoid_ends_on_its_target_within_its_limits(target, velocity, acceleration, change, second):
    profile = Profile()
    profile.start_trapezoid(target, velocity, acceleration)
    before = 0
    for tick in range(200_000):
        if tick == change:
            profile.start_trapezoid(second, velocity, acceleration)
        profile.tick()
        assert abs(profile.velocity) <= velocity
        assert abs(profile.velocity - before) <= acceleration
        before = profile.velocity
        if profile.done and tick > change:
            break
    assert profile.position == second * ONE_COUNT
    profile.tick()
    assert profile.position == second * ONE_COUNT
