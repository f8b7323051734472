"""The JR3 adapter keeps the contract of a force sensor, over CAN and over a serial line, against emulated boards."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.jr3 import Jr3ForceSensor, make_jr3_can, make_jr3_uart
from palpate.adapters.hardware.plugins import RigContext
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.motion.arm import arm_named
from palpate.core.ports.contracts import ForceSensorContract, ForceSensorRig
from palpate.core.ports.devices import ForceSensor
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import Validity
from palpate.simulation.emulators.jr3 import uart as jr3_uart
from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.jr3.config import Jr3Config
from palpate.simulation.emulators.jr3.uart import UART_CONFIG, Jr3UartNode
from palpate.simulation.emulators.lines.can_bus_server import VirtualBusServer
from palpate.simulation.emulators.lines.can_wire import CanWire
from palpate.simulation.emulators.lines.pty_server import PtyServer

pytestmark = [pytest.mark.xdist_group("real time"), pytest.mark.usefixtures("real_time")]
CHANNELS = count()
TICK_NS = 10**9 // 140
MAX_AGE_MS = 200.0
BOOT_NS = 1_000_000


def context() -> RigContext:
    return RigContext(MonotonicClock(), arm_named("zebra-zero"), (), (), ())


class Load:
    """What presses on the emulated sensor."""

    def __init__(self) -> None:
        self.wrench = (0.0,) * 6

    def __call__(self, now_ns: int) -> tuple[float, ...]:
        return self.wrench

    def push_N(self, fx: float, fy: float, fz: float) -> None:
        self.wrench = (fx, fy, fz, 0.0, 0.0, 0.0)


def rig(sensor: Jr3ForceSensor, clock: Any, load: Load, firmware: Any, end: Callable[[], None]) -> ForceSensorRig:
    def fall_silent() -> None:
        firmware.faults = replace(firmware.faults, silent=True)

    def advance(ticks: int) -> None:
        time.sleep(ticks / 140)

    return ForceSensorRig(
        device=sensor,
        clock=clock,
        advance=advance,
        max_age_ns=round(MAX_AGE_MS * 1e6) + TICK_NS,
        push_N=load.push_N,
        load_N=20.0,
        tolerance_N=0.05,
        settle_ticks=14,
        go_silent=fall_silent,
        is_open=lambda: sensor.device is not None,
        provoke_fault=lambda: sensor._latch("fault on demand"),
        dispose=end,
        runs_by_itself=True,
    )


def can_rig() -> ForceSensorRig:
    load, made = Load(), context()
    node = Jr3CanNode(1, load, replace(Jr3Config(), boot_ns=BOOT_NS), generator=np.random.default_rng(0))
    channel = f"jr3-contract-{next(CHANNELS)}"
    server = VirtualBusServer(CanWire([node], generator=np.random.default_rng(1)), channel)
    server.start()
    settings = {"interface": "virtual", "channel": channel, "max_age_ms": MAX_AGE_MS, "period_us": 2000}
    return rig(make_jr3_can(settings, made), made.clock, load, node.firmware, server.close)


def uart_rig() -> ForceSensorRig:
    load, made = Load(), context()
    node = Jr3UartNode(load, replace(UART_CONFIG, boot_ns=BOOT_NS), generator=np.random.default_rng(0))
    server = PtyServer(node)
    settings = {"port": server.start(), "max_age_ms": MAX_AGE_MS, "period_us": 4000}
    return rig(make_jr3_uart(settings, made), made.clock, load, node.firmware, server.stop)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The firmware sleeps a second after each command; with hundreds of them that is a long test."""
    monkeypatch.setattr(jr3_uart, "PAUSE_ns", 50_000_000)


class TestJr3Can(ForceSensorContract):
    def make(self) -> ForceSensorRig:
        return can_rig()


@pytest.mark.usefixtures("impatient")
class TestJr3Uart(ForceSensorContract):
    def make(self) -> ForceSensorRig:
        return uart_rig()


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("make", [can_rig, uart_rig])
def test_after_a_long_pause_a_living_sensor_gives_what_it_feels_now(make: Callable[[], ForceSensorRig]) -> None:
    made = make()
    try:
        with made.device as sensor:
            before = sensor.read()
            time.sleep(1.5e-3 * MAX_AGE_MS)
            made.push_N(0.0, 0.0, made.load_N)
            made.advance(made.settle_ticks)
            after = sensor.read()
            assert after.validity is Validity.VALID
            assert after.sequence > before.sequence
            assert abs(after.force_N[2] - before.force_N[2]) == pytest.approx(made.load_N, abs=2 * made.tolerance_N)
    finally:
        made.dispose()


def test_the_adapter_is_its_port() -> None:
    assert isinstance(make_jr3_can({}, context()), ForceSensor)


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        ({"chanel": "can0"}, "force_sensor.chanel"),
        ({"axes": "upside down"}, "force_sensor.axes"),
        ({"max_age_ms": 0.0}, "force_sensor.max_age_ms"),
        ({"node": "one"}, "force_sensor.node"),
        ({"cutoff_Hz": -1.0}, "force_sensor"),
    ],
)
def test_settings_that_cannot_work_are_refused_before_anything_is_opened(settings: dict[str, Any], field: str) -> None:
    with pytest.raises(ConfigurationError) as told:
        make_jr3_can(settings, context())
    assert told.value.field == field


@pytest.mark.parametrize(
    ("maker", "settings"),
    [
        (make_jr3_can, {"interface": "slcan", "channel": "/dev/no-such-port"}),
        (make_jr3_can, {"interface": "no such interface"}),
        (make_jr3_uart, {"port": "/dev/no-such-port"}),
    ],
)
def test_a_port_that_is_not_there_is_the_operator_s_to_mend(maker: Any, settings: dict[str, Any]) -> None:
    sensor = maker(settings, context())
    with pytest.raises(DeviceError, match=r"cannot be opened.*the operator's fault"):
        sensor.configure()
    assert sensor.life is Life.CONSTRUCTED
    sensor.close()


def test_a_board_that_restarts_in_mid_run_latches_a_fault() -> None:
    load, made = Load(), context()
    node = Jr3CanNode(1, load, replace(Jr3Config(), boot_ns=BOOT_NS), generator=np.random.default_rng(0))
    with VirtualBusServer(CanWire([node], generator=np.random.default_rng(1)), "jr3-reboot") as server:
        with make_jr3_can({"interface": "virtual", "channel": "jr3-reboot"}, made) as sensor:
            assert sensor.read().validity is Validity.VALID
            server.do(node.reboot)
            deadline = time.monotonic() + 10.0
            while sensor.life is Life.ACTIVE and time.monotonic() < deadline:
                time.sleep(0.01)
                try:
                    sensor.read()
                except DeviceError as error:
                    told = str(error)
            assert sensor.life is Life.FAULTED
            assert "restarted in mid-run" in told
            sensor.acknowledge_fault()
            sensor.activate()
            time.sleep(0.1)
            assert sensor.read().validity is Validity.VALID
