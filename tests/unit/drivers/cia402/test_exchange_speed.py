"""A drive's speed as the host sees it: a host or an adapter that holds frames up makes no drive too fast."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from palpate.drivers.errors import DeviceFaultError
from palpate.simulation.emulators.motors import DirectMotors
from tests.support.cia402_bench import PERIOD_NS, SCALE, Bench

SYNC = 0x080
LIMIT_RAD_S = 1.0


def hold_up_syncs(bench: Bench, share_of_cycle: Callable[[int], float]) -> None:
    """Let some SYNCs reach the bus late, as after a host that lost its processor, or an adapter that was busy."""
    send, sent = bench.network.send_message, 0

    def late(identifier: int, data: bytes, remote: bool = False) -> None:
        nonlocal sent
        if identifier == SYNC:
            sent += 1
            bench.network.wait_until(bench.network.now_ns + round(share_of_cycle(sent) * PERIOD_NS))
        send(identifier, data, remote)

    bench.network.send_message = late  # type: ignore[method-assign]


def put_cell_before(bench: Bench, phase: float) -> None:
    """Motors that go on in steps of a control tick, as those of the emulated cell do."""
    motors, wait_until = DirectMotors((SCALE,) * 6, (0.0,) * 6), bench.network.wait_until
    for drive in bench.drives:
        drive._motors = drive._servo._motors = motors
    step_ns = round(phase * PERIOD_NS)

    def wait(end_ns: int) -> None:
        nonlocal step_ns
        while step_ns <= end_ns:
            wait_until(step_ns)
            motors.measured_rad(motors.targets_rad())
            step_ns += PERIOD_NS
        wait_until(end_ns)

    bench.network.wait_until = wait  # type: ignore[method-assign]


def fastest_rad_s(bench: Bench, cycles: int = 200) -> float:
    """Move at the limit, to and fro, and give the greatest speed that was seen."""
    fastest, goal_rad = 0.0, 0.9
    for _ in range(cycles):
        measured = bench.cycle(goal_rad)
        goal_rad = 0.9 if measured.position_rad[0] < -0.8 else -0.9 if measured.position_rad[0] > 0.8 else goal_rad
        fastest = max(fastest, *(view.speed_rad_per_s for view in bench.arm._exchange.views))
    return fastest


@pytest.mark.parametrize(
    "late",
    [
        lambda n: 0.45 * (n % 2),
        lambda n: 0.9 * (n % 7 == 0),
        lambda n: 0.9 * (n * 13 % 17) / 17,
        lambda n: 1.5 * (n % 7 == 0),
    ],
    ids=["every second", "hardly in time", "irregular", "longer than a cycle"],
)
def test_syncs_that_are_held_up_make_no_drive_too_fast(late: Callable[[int], float]) -> None:
    bench = Bench().enabled()
    hold_up_syncs(bench, late)
    assert fastest_rad_s(bench) < 1.4 * LIMIT_RAD_S


def test_answers_that_come_after_the_next_sync_make_no_drive_too_fast() -> None:
    bench = Bench().enabled()
    for _ in range(10):
        fastest_rad_s(bench, 10)
        bench.drives[1].faults.delay_tpdos_ns = PERIOD_NS * 12 // 10
        fastest_rad_s(bench, 1)
        # While the host waits for another drive, what comes from this one is taken for its answer to this SYNC.
        bench.drives[1].faults.delay_tpdos_ns, bench.drives[2].faults.delay_tpdos_ns = 0, PERIOD_NS * 6 // 10
        fastest_rad_s(bench, 1)
        bench.drives[2].faults.delay_tpdos_ns = 0


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.2, 0.3])
def test_motors_that_go_on_in_steps_are_not_too_fast_where_two_steps_fall_between_two_syncs(phase: float) -> None:
    bench = Bench()
    put_cell_before(bench, phase)
    bench.enabled()
    hold_up_syncs(bench, lambda n: 0.3 * (n * 7 % 11) / 11)
    assert fastest_rad_s(bench) < 1.4 * LIMIT_RAD_S


@pytest.mark.parametrize("late", [0.0, 0.45], ids=["in time", "held up"])
def test_a_drive_that_is_twice_too_fast_stops_the_arm_within_four_cycles(late: float) -> None:
    bench = Bench().enabled()
    bench.cycle(0.0, times=10)
    hold_up_syncs(bench, lambda n: late * (n % 2))

    def run_on(elapsed_ns: int, *, stopping: bool) -> None:
        bench.plant.push(1, 2.0 * LIMIT_RAD_S * SCALE * elapsed_ns * 1e-9)

    bench.drives[1]._servo.advance = run_on  # type: ignore[method-assign]
    with pytest.raises(DeviceFaultError, match="drive 2: moves at"):
        bench.cycle(times=4)


def test_a_drive_that_jumps_stops_the_arm_at_once() -> None:
    bench = Bench().enabled()
    bench.cycle(0.0, times=10)
    bench.plant.push(1, 0.04 * SCALE)
    bench.drives[1]._servo.engage()
    with pytest.raises(DeviceFaultError, match="drive 2: moves at"):
        bench.cycle()
