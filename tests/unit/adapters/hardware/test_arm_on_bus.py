"""An arm on a bus that dies: told to stop by one thread, once, and soon over. Virtual time."""

import json
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from palpate.adapters.hardware.arm_on_bus import BusArm, OpenArm
from palpate.core.ports import JointCommand, Life
from palpate.drivers.device import Applied, ArmDriver, Measured
from palpate.drivers.errors import SilentError
from tests.contracts import test_cia402, test_jr3, test_zebra
from tests.virtual_time import VirtualTime

END_S = 2.0
"""Time from the fault within which everything is over."""


class SlowDriver(ArmDriver):
    """Its stops take half a second, and it fails on demand."""

    def __init__(self, clock: VirtualTime) -> None:
        self.clock, self.is_dead, self.hangs = clock, False, False
        self.stops: list[str] = []
        self.inside = 0

    def open(self) -> None: ...
    def enable(self) -> None: ...
    def disable(self) -> None: ...
    def acknowledge(self) -> None: ...
    def close(self) -> None: ...

    def preview(self, setpoint_rad: Sequence[float], /) -> Applied:
        return Applied(tuple(setpoint_rad))

    def cycle(self, setpoint_rad: Sequence[float] | None = None, /) -> Measured:
        while self.hangs:
            self.clock.sleep(0.1)
        if self.is_dead:
            raise SilentError("drive 3", "is dead", "bury it")
        return Measured(position_rad=(0.0,), is_fresh=(True,), applied=None, time_ns=self.clock.now_ns())

    def stop(self) -> None:
        self.inside += 1
        assert self.inside == 1, "two threads in one stop"
        self.stops.append(threading.current_thread().name)
        self.clock.sleep(0.5)
        self.inside -= 1


class Desk:
    """The slow arm, active."""

    def __init__(self) -> None:
        self.clock = VirtualTime()
        self.driver = SlowDriver(self.clock)
        self.closed = 0
        self.arm = BusArm(
            "slow arm", lambda: OpenArm(self.driver, self.close), self.clock, joints=1, divider=1, max_age_ns=10**8
        )
        self.arm.configure()
        self.arm.activate()

    def close(self) -> None:
        self.closed += 1
        self.driver.hangs = False


@pytest.fixture
def desk() -> Iterator[Desk]:
    made = Desk()
    yield made
    made.driver.hangs = False
    made.arm.close()
    for thread in threading.enumerate():
        if thread.name.endswith(" bus"):
            gone(made.clock, thread)


def seconds_since(clock: VirtualTime, begin_ns: int) -> float:
    return (clock.now_ns() - begin_ns) * 1e-9


def gone(clock: VirtualTime, thread: threading.Thread) -> None:
    """Let time go on until a thread has ended."""
    clock.wait_for(lambda: not thread.is_alive(), clock.now_ns() + 10**10)
    assert not thread.is_alive()


def test_a_dead_arm_is_told_once_by_its_own_thread_whoever_asks(desk: Desk) -> None:
    begin_ns = desk.clock.now_ns()
    desk.driver.is_dead = True
    # A watchdog, named so that virtual time waits for it, and the loop.
    watchdog = threading.Thread(target=desk.arm.stop, name="watchdog on the bus")
    watchdog.start()
    desk.arm.stop()
    desk.arm.stop()
    desk.arm.close()
    gone(desk.clock, watchdog)
    assert desk.driver.stops == ["slow arm bus"]
    assert seconds_since(desk.clock, begin_ns) < 0.7
    assert desk.arm.fault == "drive 3: is dead; bury it (the device's fault)"


def test_a_stop_of_an_arm_whose_thread_has_ended_is_one_thread_s(desk: Desk) -> None:
    desk.arm.deactivate()
    desk.arm.activate()
    desk.driver.stops.clear()
    desk.arm._end_thread()
    second = threading.Thread(target=desk.arm.stop, name="second bus")
    second.start()
    desk.arm.stop()
    gone(desk.clock, second)
    assert len(desk.driver.stops) == 1


def test_a_thread_that_hangs_keeps_its_driver_and_loses_its_port(desk: Desk) -> None:
    desk.driver.hangs = True
    desk.clock.sleep(0.05)
    begin_ns = desk.clock.now_ns()
    desk.arm.stop()
    assert seconds_since(desk.clock, begin_ns) < END_S
    assert desk.driver.stops == []
    desk.arm.close()
    assert (desk.closed, desk.arm.life) == (1, Life.CLOSED)


def test_after_a_stop_the_arm_can_be_activated_and_stopped_again(desk: Desk) -> None:
    for _ in range(2):
        desk.arm.stop()
        desk.arm.deactivate()
        desk.arm.activate()
        desk.arm.send(JointCommand((0.1,)))
    assert len(desk.driver.stops) == 2


def test_what_is_kept_of_an_arm_is_where_it_came_to_rest_and_not_where_it_swung(tmp_path: Path) -> None:
    counts = tmp_path / "counts.json"
    bench = test_zebra.Bench(counts_file=str(counts))
    with bench.desk:
        bench.arm.configure()
        bench.arm.activate()
        bench.arm.stop()
        swinging = json.loads(counts.read_text())
        bench.plant.jam(0)
        bench.plant.push(0, 50.0)
        bench.advance(5)
        bench.arm.close()
    assert json.loads(counts.read_text()) == [swinging[0] + 50, *swinging[1:]]


def test_a_stop_does_not_wait_for_the_next_cycle(desk: Desk) -> None:
    desk.arm.deactivate()
    desk.arm._divider = 14
    desk.arm.activate()
    desk.clock.sleep(0.01)
    begin_ns = desk.clock.now_ns()
    desk.driver.stops.clear()
    desk.arm.stop()
    # The driver's own half second, and no tenth of one before it.
    assert (len(desk.driver.stops), seconds_since(desk.clock, begin_ns) < 0.51) == (1, True)


@pytest.mark.parametrize("arm", ["zebra", "cia402"])
def test_a_line_that_goes_dead_under_a_moving_arm_is_over_in_time(arm: str) -> None:
    bench = test_zebra.Bench() if arm == "zebra" else test_cia402.Bench()
    clock, device = bench.clock, bench.arm
    try:
        device.configure()
        device.activate()
        pose = list(device.read().position_rad)
        for _ in range(10):
            pose[0] += 1e-3
            device.send(JointCommand(tuple(pose)))
            bench.advance(1)
        begin_ns = clock.now_ns()
        if isinstance(bench, test_zebra.Bench):
            bench.bus.set_power(powered=False)
        else:
            for drive in bench.drives:
                drive.faults.silent = True
        while device.life is Life.ACTIVE:
            device.send(JointCommand(tuple(pose)))
            bench.advance(1)
        device.stop()
        device.close()
        assert seconds_since(clock, begin_ns) < END_S
    finally:
        bench.desk.close()


def test_a_force_sensor_that_went_silent_is_closed_in_time() -> None:
    rig = test_jr3.can_rig()
    sensor, clock = rig.device, rig.clock
    try:
        sensor.configure()
        sensor.activate()
        rig.go_silent()
        rig.advance(140)
        begin_ns = clock.now_ns()
        sensor.close()
        assert seconds_since(clock, begin_ns) < 0.5
    finally:
        rig.dispose()
