"""Golden bytes, the address chain, groups, line rates and resynchronisation."""

import pytest

from palpate.simulation.emulators.nmc.bus import NmcChain
from palpate.simulation.emulators.nmc.settings import ModuleSettings
from tests.support.ideal_motors import IdealPlant
from tests.unit.simulation.emulators.nmc_host import ALL, TICK_NS, Bench, command

SET_ADDRESS_1 = bytes.fromhex("aa002101ff21")


def golden(vector: str) -> bytes:
    return bytes.fromhex(vector)


def test_golden_start_up() -> None:
    bench = Bench(modules=1)
    # Supply on, servo off: move done, power on, position error.
    assert bench.raw(SET_ADDRESS_1) == golden("1919")
    assert bench.raw(golden("aa010e0f")) == golden("1919")
    assert bench.raw(golden("aa01132034")) == golden("19000a23")
    assert bench.raw(golden("aa010e0f")) == golden("1919")  # READ_STAT counts once
    assert bench.raw(golden("aa0117021a")) == golden("1919")
    assert bench.raw(golden("aa010b0c")) == golden("1919")  # the error bit returns while the servo is off
    assert bench.raw(golden("aaff0f0e")) == b""
    assert bench.bus.modules[0].address == 0


def test_golden_reply_for_mask_1f() -> None:
    bench = Bench(ModuleSettings(analog=0x4F), modules=1)
    bench.bus.set_power(powered=False)
    bench.raw(SET_ADDRESS_1)
    bench.plant.push(0, 0x5E0)
    bench.wait(1)
    bench.raw(command(1, 0xC))
    bench.plant.push(0, 0x2522 - 0x5E0)
    bench.wait(2)
    assert bench.raw(golden("aa01121f32")) == golden("11222500004f000018e0050000a4")
    assert bench.raw(golden("aa010e0f")) == golden("11222500004f000018e0050000a4")


def test_golden_gains() -> None:
    bench = Bench(modules=1)
    bench.raw(SET_ADDRESS_1)
    assert bench.raw(golden("aa01e6c800b00496000f004b00a00f050007")) == golden("1919")
    gains = bench.bus.modules[0].servo.gains
    assert (gains.kp, gains.kd, gains.ki, gains.integration_limit) == (200, 1200, 150, 15)
    assert (gains.output_limit, gains.current_limit, gains.error_limit, gains.rate_divisor) == (75, 0, 4000, 5)


def test_golden_trajectories() -> None:
    bench = Bench(modules=1).running()
    assert bench.raw(golden("aa01d4975e770000a0860100102700009f")) == golden("0808")
    buffer = bench.bus.modules[0].servo.buffer
    assert (buffer.control, buffer.position_counts, buffer.velocity, buffer.acceleration) == (
        0x97,
        30_558,
        100_000,
        10_000,
    )
    assert bench.raw(golden("aa0117051d")) == golden("0909")
    bench.raw(golden("aa01d49700000000c3f52800d71a00003d"))
    bench.raw(golden("aa0194b600000000dc02000029"))
    buffer = bench.bus.modules[0].servo.buffer
    assert (buffer.control, buffer.velocity, buffer.acceleration) == (0xB6, 0, 0x2DC)
    assert bench.bus.modules[0].rejected == 0
    assert bench.raw(golden("aa010001"))[0] & 0x02 == 0


def test_a_wrong_checksum_is_reported_and_the_command_ignored() -> None:
    bench = Bench(modules=1).addressed()
    wrong = bytearray(command(1, 0x2, b"\x01"))
    wrong[-1] ^= 0x40
    assert bench.raw(bytes(wrong)) == golden("1b1b")
    assert bench.bus.modules[0].mask == 0
    assert bench.status(1) == 0x19  # about the last command only
    wrong = bytearray(command(1, 0xF))
    wrong[-1] ^= 1
    assert bench.raw(bytes(wrong)) == golden("1b1b")


def test_reset_of_one_module_silences_it_at_the_higher_rate() -> None:
    bench = Bench().addressed()
    bench.tell(ALL, 0xA, bytes([10]))
    assert bench.bus.baud == 115_200
    bench.bus.modules[2].power_up()
    assert bench.raw(command(3, 0xE)) == b""
    assert bench.raw(command(0, 0xE)) == b""  # it listens at 19200
    assert len(bench.raw(command(4, 0xE))) == 2
    assert bench.bus.baud == 115_200
    bench.tell(ALL, 0xF)
    assert bench.bus.baud == 19_200
    bench.addressed()


def test_the_rate_changes_for_groups_only() -> None:
    bench = Bench().addressed()
    bench.ask(1, 0xA, bytes([10]))
    assert bench.bus.baud == 19_200
    assert bench.bus.modules[0].rejected == 1
    bench.tell(ALL, 0xA, bytes([20]))
    assert bench.bus.baud == 57_600


@pytest.mark.parametrize("cut", range(1, 17))
def test_zeros_end_a_partial_frame(cut: int) -> None:
    bench = Bench(modules=1).addressed()
    bench.raw(command(1, 0x4, bytes(range(1, 14)))[:cut])
    bench.raw(bytes(30))
    assert bench.raw(golden("aa010e0f")) == golden("1919")


def test_noise_between_frames_is_skipped() -> None:
    bench = Bench(modules=1).addressed()
    assert bench.raw(b"\x00\x55\x01\xff" + golden("aa010e0f")) == golden("1919")


def test_time_is_relative_and_never_goes_back() -> None:
    bus = NmcChain(IdealPlant())
    start = 10**18
    assert bus.advance(start) == b""
    assert bus.feed(SET_ADDRESS_1, start + TICK_NS) == golden("1919")
    assert bus.feed(golden("aa010e0f"), start) == golden("1919")


@pytest.mark.parametrize(
    ("code", "data"),
    [
        (0x0, b"\x07"),
        (0x1, b"\x01"),
        (0x2, b""),
        (0x3, b""),
        (0x4, b"\x01\x00"),
        (0x4, b""),
        (0x6, b"\x00"),
        (0x7, b"\x10"),
        (0x7, b"\x01\x00\x00\x00\x00"),
        (0xD, b"\x00\x00\x00"),
        (0xE, b"\x00"),
    ],
)
def test_misshapen_commands_change_nothing(code: int, data: bytes) -> None:
    bench = Bench(modules=1).addressed()
    assert bench.ask(1, code, data).status == 0x19
    assert bench.bus.modules[0].rejected == 1
