"""Our own devices, each against its emulator in this process."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

from palpate.adapters.hardware.arm_on_bus import BusArm
from palpate.adapters.hardware.cia402 import Cia402Driver, make_cia402
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.doctor.cia402 import examine_cia402
from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.jr3 import examine_jr3
from palpate.adapters.hardware.doctor.zebra import examine_zebra, tell_modules
from palpate.adapters.hardware.jr3 import Jr3ForceSensor, make_jr3_can
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.zebra_zero import ZebraDriver, make_zebra_nmc
from palpate.core.errors import DeviceError, LifecycleError
from palpate.core.motion.arm import arm_named
from palpate.drivers.errors import DriverError
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.jr3.config import Jr3Config
from palpate.simulation.emulators.lines.can_bus_server import VirtualBusServer
from palpate.simulation.emulators.lines.can_wire import CanWire
from palpate.simulation.emulators.lines.pty_server import PtyServer
from palpate.simulation.emulators.motors.plant import IdealPlant
from palpate.simulation.emulators.nmc.bus import NmcBus
from tests.unit.adapters.hardware.doctor.notebook import facts, told

pytestmark = [pytest.mark.xdist_group("real time"), pytest.mark.usefixtures("real_time")]
CHANNELS = count()
LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
SECONDS = 0.4


@pytest.fixture
def context() -> RigContext:
    return RigContext(MonotonicClock(), arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)


@pytest.fixture
def notes() -> Notebook:
    return Notebook("device")


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def zebra(opened: ExitStack, context: RigContext, **settings: Any) -> tuple[PtyServer[NmcBus], BusArm, ZebraDriver]:
    server: PtyServer[NmcBus] = PtyServer(NmcBus(IdealPlant()))
    port = server.start()
    opened.callback(server.stop)
    # So slow that a busy machine does not disturb it.
    table = {
        "port": port,
        "baud": 230_400,
        "adapter_latency_ms": 8.0,
        "divider": 10,
        "at_home": True,
        "reset_wait_ms": 40.0,
        **settings,
    }
    arm = make_zebra_nmc(table, context).arm
    assert isinstance(arm, BusArm)
    driver = arm.driver
    assert isinstance(driver, ZebraDriver)
    opened.callback(arm.close)
    return server, arm, driver


def test_zebra(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    server, arm, driver = zebra(opened, context)
    arm.configure()
    tell_modules(driver, notes)
    examine_zebra(driver, context.clock, SECONDS, notes)
    assert facts(notes)["modules"].startswith("6, addresses 1 to 6: servo, firmware 10")
    assert facts(notes)["line"] == "230400 baud"
    assert "divider = " in facts(notes)["budget"]
    assert "no axis reports a fault, and every joint is within its limits -> " in told(notes, Level.OK)
    assert "counts_file" in told(notes, Level.NOTE)[0]
    (table,) = notes.section().tables
    assert [row[2] for row in table.rows] == ["off"] * 6
    with server.exclusive() as bus:
        assert not any(module.servo.overcurrent for module in bus.modules)


def test_zebra_of_which_nobody_knows_where_it_is(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    _, arm, driver = zebra(opened, context, at_home=False)
    driver.connect()
    tell_modules(driver, notes)
    assert facts(notes)["modules"].startswith("6, ")
    with pytest.raises(LifecycleError, match="at_home=True"):
        arm.configure()


def test_zebra_with_a_fault(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    server, arm, driver = zebra(opened, context)
    arm.configure()
    with server.exclusive() as bus:
        bus.modules[2].servo.overcurrent = True
    examine_zebra(driver, context.clock, SECONDS, notes)
    assert "motor 3: overcurrent -> see what holds the arm up, then acknowledge" in told(notes, Level.WRONG)


def test_zebra_unplugged_in_mid_run(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    server, arm, driver = zebra(opened, context)
    arm.configure()
    server.stop()
    with pytest.raises(DriverError):
        examine_zebra(driver, context.clock, SECONDS, notes)
    assert "replies" in facts(notes)


def test_a_driver_that_is_not_open_says_so(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    _, _, driver = zebra(opened, context)
    with pytest.raises(DeviceError, match="is not open"):
        tell_modules(driver, notes)


def drives(opened: ExitStack, context: RigContext) -> tuple[VirtualBusServer, list[CanopenDrive], Cia402Driver]:
    channel, plant = f"doctor-{next(CHANNELS)}", IdealPlant()
    nodes = [CanopenDrive(axis + 1, plant, axis) for axis in range(6)]
    server = VirtualBusServer(CanWire(nodes, generator=np.random.default_rng(1)), channel)
    opened.enter_context(server)
    settings = {"interface": "virtual", "channel": channel, "divider": 4, "counts_per_rad": [30_557.75] * 6}
    arm = make_cia402(settings, context).arm
    assert isinstance(arm, BusArm)
    assert isinstance(arm.driver, Cia402Driver)
    opened.callback(arm.close)
    # What is asked of a drive that still boots is lost.
    time.sleep(0.1)
    arm.configure()
    return server, nodes, arm.driver


def test_cia402(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    _, _, driver = drives(opened, context)
    examine_cia402(driver, context.clock, SECONDS, notes)
    states, traffic = notes.section().tables
    assert [row[0] for row in states.rows] == list("123456")
    assert {row[6] for row in states.rows} == {"switch on disabled"}
    assert len(traffic.rows) == 6
    assert "divider = " in facts(notes)["budget"]
    assert facts(notes)["state"] == "configured"


def test_cia402_unplugged_in_mid_run(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    server, _, driver = drives(opened, context)
    server.close()
    with pytest.raises(DriverError):
        examine_cia402(driver, context.clock, SECONDS, notes)
    assert facts(notes)["state"].startswith("faulted")
    assert "answers missing" in " ".join(told(notes, Level.WRONG))


def jr3(
    opened: ExitStack, context: RigContext, wrench: Callable[[int], tuple[float, ...]]
) -> tuple[Jr3CanNode, Jr3ForceSensor]:
    channel = f"doctor-{next(CHANNELS)}"
    node = Jr3CanNode(1, wrench, replace(Jr3Config(), boot_ns=1_000_000), generator=np.random.default_rng(0))
    server = VirtualBusServer(CanWire([node], generator=np.random.default_rng(1)), channel)
    opened.enter_context(server)
    sensor = make_jr3_can({"interface": "virtual", "channel": channel, "max_age_ms": 500.0}, context)
    opened.callback(sensor.close)
    sensor.configure()
    sensor.activate()
    return node, sensor


def test_jr3(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    _, sensor = jr3(opened, context, lambda now_ns: (0.0, 0.0, 5.0 + (now_ns // 7) % 2, 0.0, 0.0, 0.0))
    examine_jr3(sensor, context.clock, SECONDS, notes)
    assert "node 1" in facts(notes)["identity"]
    assert facts(notes)["full scales"].endswith("N m")
    assert "asked for 200.0 Hz" in facts(notes)["rate"]
    (table,) = notes.section().tables
    assert table.columns[-1] == "peak of it"


def test_jr3_that_is_overloaded(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    _, sensor = jr3(opened, context, lambda now_ns: (0.0, 0.0, 2000.0, 0.0, 0.0, 0.0))
    examine_jr3(sensor, context.clock, SECONDS, notes)
    assert "saturation" in " ".join(told(notes, Level.WRONG))


def test_jr3_that_falls_silent(opened: ExitStack, context: RigContext, notes: Notebook) -> None:
    node, sensor = jr3(opened, context, lambda now_ns: (0.0, 0.0, 5.0 + (now_ns // 7) % 2, 0.0, 0.0, 0.0))
    node.firmware.faults = replace(node.firmware.faults, silent=True)
    time.sleep(0.05)
    examine_jr3(sensor, context.clock, SECONDS, notes)
    wrong = " ".join(told(notes, Level.WRONG))
    assert "the sensor was silent for" in wrong
    assert "only 0 readings" in wrong
