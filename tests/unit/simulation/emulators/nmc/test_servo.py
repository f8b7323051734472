import struct

import pytest

from tests.unit.simulation.emulators.nmc_host import ALL, GAINS, TICK_NS, Bench, command, trajectory

MOVE_DONE, OVERCURRENT, POWER, POSITION_ERROR, LIMIT1 = 0x01, 0x04, 0x08, 0x10, 0x20
WRAP, SERVO_ON, ACCELERATED, SLEWED, OVERRUN = 0x02, 0x04, 0x08, 0x10, 0x20
VELOCITY, ACCELERATION = 1_025_348, 5_250  # 1 rad/s and 10 rad/s^2 on joint 1


def bench_of_one() -> Bench:
    return Bench(modules=1).running()


def moving(bench: Bench, target: int = 30_558, control: int = 0x97) -> Bench:
    bench.ask(1, 0x4, trajectory(control, target, VELOCITY, ACCELERATION))
    bench.wait(200)
    return bench


def test_a_trapezoid_tells_its_phases() -> None:
    bench = bench_of_one()
    assert bench.status(1) == MOVE_DONE | POWER
    bench.ask(1, 0x4, trajectory(0x97, 30_558, VELOCITY, ACCELERATION))
    assert bench.status(1) == POWER
    bench.wait(100)
    assert bench.auxiliary(1) & (SERVO_ON | ACCELERATED | SLEWED) == SERVO_ON
    bench.wait(300)
    assert bench.auxiliary(1) & (ACCELERATED | SLEWED) == ACCELERATED
    assert struct.unpack("<h", bench.read(1, 0x04))[0] in (15, 16)
    assert bench.read(1, 0x40) == b"\x00\x00"
    ticks = 400 + bench.ticks_until(lambda: bool(bench.status(1) & MOVE_DONE))
    # 1 rad at 1 rad/s with ramps of 0.1 s
    assert ticks * TICK_NS * 1e-9 == pytest.approx(1.1, abs=0.005)
    assert bench.position(1) == 30_558
    assert bench.plant.motor_counts(0) == 30_558
    assert bench.auxiliary(1) & (ACCELERATED | SLEWED) == ACCELERATED | SLEWED


def test_a_buffered_move_waits_for_the_group() -> None:
    bench = Bench(modules=3).running()
    for address, target in ((1, 500), (2, -700), (3, 900)):
        bench.ask(address, 0x4, trajectory(0x17, target, VELOCITY, ACCELERATION))
    bench.wait(500)
    assert [bench.position(address) for address in (1, 2, 3)] == [0, 0, 0]
    bench.tell(ALL, 0x5)
    bench.wait(2_000)
    assert [bench.position(address) for address in (1, 2, 3)] == [500, -700, 900]


def test_fields_not_sent_keep_their_values() -> None:
    bench = moving(bench_of_one(), 1_000)
    bench.wait(2_000)
    bench.ask(1, 0x4, trajectory(0x91, -250))
    bench.wait(2_000)
    assert bench.position(1) == -250
    bench.ask(1, 0x4, trajectory(0xD1, 100))  # relative
    bench.wait(2_000)
    assert bench.position(1) == -150


def test_velocity_profile_in_both_directions() -> None:
    bench = bench_of_one()
    bench.ask(1, 0x4, trajectory(0xB6, 16 << 16, 1 << 16))
    assert not bench.status(1) & MOVE_DONE
    bench.wait(20)
    assert bench.status(1) & MOVE_DONE
    assert struct.unpack("<h", bench.read(1, 0x04)) == (16,)
    bench.ask(1, 0x4, trajectory(0xF6, 16 << 16, 1 << 16))
    bench.wait(40)
    assert struct.unpack("<h", bench.read(1, 0x04)) == (-16,)
    bench.ask(1, 0x7, b"\x09")  # smooth, with the acceleration in use
    assert not bench.status(1) & MOVE_DONE
    assert bench.ticks_until(lambda: bool(bench.status(1) & MOVE_DONE)) == 16
    assert bench.auxiliary(1) & SERVO_ON


def test_abrupt_stop_holds_where_it_is() -> None:
    bench = moving(bench_of_one())
    here = bench.position(1)
    assert bench.ask(1, 0x7, b"\x05").status & MOVE_DONE
    bench.wait(100)
    assert bench.position(1) == here > 0


def test_motor_off_releases_and_tells() -> None:
    bench = moving(bench_of_one())
    here = bench.position(1)
    assert bench.ask(1, 0x7, b"\x02").status == MOVE_DONE | POWER | POSITION_ERROR
    assert bench.auxiliary(1) & SERVO_ON == 0
    bench.plant.push(0, 50.0)
    bench.wait(10)
    assert bench.position(1) == here + 50


def test_without_amplifier_or_gains_the_motor_stays_and_the_error_trips() -> None:
    for preparation in ([(0x6, GAINS), (0x7, b"\x04")], [(0x7, b"\x05")]):
        bench = Bench(modules=1).addressed()
        for code, data in preparation:
            bench.ask(1, code, data)
        moving(bench)
        bench.wait(1_000)
        assert bench.position(1) == 0
        assert bench.status(1) & POSITION_ERROR
        assert bench.auxiliary(1) & SERVO_ON == 0


def test_position_error_trips_at_the_limit_and_stays_until_cleared() -> None:
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


def test_sticky_bits_stay_until_cleared() -> None:
    bench = bench_of_one()
    servo = bench.bus.modules[0].servo
    servo.overcurrent = servo.overrun = True
    bench.wait(5)
    assert bench.status(1) & OVERCURRENT
    assert bench.auxiliary(1) & OVERRUN
    bench.ask(1, 0xB)
    assert bench.status(1) & OVERCURRENT == 0
    assert bench.auxiliary(1) & OVERRUN == 0


def test_the_register_wraps() -> None:
    bench = bench_of_one()
    bench.ask(1, 0x0, b"\x02" + struct.pack("<i", (1 << 31) - 2))
    bench.ask(1, 0x7, b"\x11" + struct.pack("<i", (1 << 31) - 1))
    bench.wait(1)
    bench.plant.push(0, 0.0)
    bench.ask(1, 0x4, trajectory(0xB6, 4 << 16, 4 << 16))
    bench.wait(3)
    assert bench.position(1) < 0
    assert bench.auxiliary(1) & (WRAP | SERVO_ON) == WRAP | SERVO_ON
    bench.ask(1, 0xB)
    assert bench.auxiliary(1) & WRAP == 0


def test_positions_can_be_reset_to_zero_to_home_and_to_a_value() -> None:
    bench = moving(bench_of_one(), 1_000)
    bench.wait(2_000)
    bench.ask(1, 0xC)
    assert struct.unpack("<i", bench.read(1, 0x10)) == (1_000,)
    bench.ask(1, 0x4, trajectory(0x91, 1_600))
    bench.wait(2_000)
    bench.ask(1, 0x0, b"\x01")
    assert bench.position(1) == 600
    bench.wait(10)
    assert bench.position(1) == 600  # the set-point has moved along
    bench.ask(1, 0x0)
    assert bench.position(1) == 0
    assert bench.plant.motor_counts(0) == 1_600


def test_open_loop_duty_leaves_the_motor_free() -> None:
    bench = moving(bench_of_one())
    bench.ask(1, 0x4, bytes([0x88, 255]))
    here = bench.position(1)
    bench.wait(100)
    assert bench.auxiliary(1) & SERVO_ON == 0
    assert bench.position(1) == here


def test_power_loss_switches_the_servo_off_for_good() -> None:
    bench = moving(bench_of_one())
    bench.bus.set_power(powered=False)
    assert bench.status(1) == MOVE_DONE | POSITION_ERROR
    bench.ask(1, 0x7, b"\x05")
    assert bench.auxiliary(1) & SERVO_ON == 0
    bench.ask(1, 0x4, trajectory(0x97, 10, VELOCITY, ACCELERATION))
    assert bench.status(1) == MOVE_DONE | POSITION_ERROR
    bench.bus.set_power(powered=True)
    assert bench.status(1) == MOVE_DONE | POSITION_ERROR | POWER
    bench.ask(1, 0x7, b"\x05")
    assert bench.auxiliary(1) & SERVO_ON


def test_the_rate_divisor_slows_the_servo() -> None:
    bench = bench_of_one()
    bench.ask(1, 0x6, GAINS[:-2] + b"\x04\x00")
    bench.ask(1, 0x4, trajectory(0xB6, 1 << 16, 1 << 16))
    bench.wait(400)
    assert bench.position(1) == 100


def test_hard_reset_of_a_moving_module() -> None:
    bench = moving(Bench(modules=2).running())
    here = bench.plant.motor_counts(0)
    bench.tell(1, 0xF)
    module = bench.bus.modules[0]
    assert (module.address, module.servo.on, module.servo.measured_counts) == (0, False, 0)
    bench.wait(100)
    assert bench.plant.motor_counts(0) == here
    assert bench.raw(command(2, 0xE)) != b""
    assert len(bench.raw(command(0, 0x1, bytes([1, ALL])))) == 2


def test_a_limit_switch_that_is_pressed_is_told_and_stays_pressed_over_a_reset() -> None:
    bench = bench_of_one()
    bench.bus.modules[0].set_limits(True, False)
    bench.wait(1)
    assert bench.status(1) & LIMIT1
    bench.tell(ALL, 0xF)
    bench.addressed()
    assert bench.status(1) & LIMIT1
