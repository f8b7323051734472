"""Our own devices, each against its emulator in virtual time."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from palpate.adapters.hardware.arm_on_bus import BusArm
from palpate.adapters.hardware.cia402 import make_cia402
from palpate.adapters.hardware.doctor.cia402 import examine_cia402
from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.force_sensors import examine_jr3
from palpate.adapters.hardware.doctor.zebra import examine_zebra, tell_modules
from palpate.adapters.hardware.jr3 import Jr3ForceSensor, make_jr3_can
from palpate.adapters.hardware.plugins import RigContext
from palpate.adapters.hardware.zebra_zero import make_zebra_nmc
from palpate.core.errors import LifecycleError
from palpate.core.motion.arm import arm_named
from palpate.drivers.cia402.arm import Cia402Arm
from palpate.drivers.errors import DriverError
from palpate.drivers.zebra_zero.arm import ZebraZero
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.jr3 import Jr3CanNode, Jr3Config
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.ideal_motors import IdealPlant
from tests.unit.adapters.hardware.doctor.notebook import facts, told
from tests.virtual_lines import VirtualDesk, VirtualPort

LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)
SECONDS = 0.4


@pytest.fixture
def desk() -> Iterator[VirtualDesk]:
    with VirtualDesk() as desk:
        yield desk


@pytest.fixture
def notes() -> Notebook:
    return Notebook("device")


def context(desk: VirtualDesk) -> RigContext:
    return RigContext(desk.clock, arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)


def zebra(desk: VirtualDesk, **settings: Any) -> tuple[VirtualPort[NmcChain], BusArm]:
    port = desk.serial("arm", NmcChain(IdealPlant()))
    table = {"port": "arm", "baud": 230_400, "divider": 2, "at_home": True, "reset_wait_ms": 40.0, **settings}
    arm = make_zebra_nmc(table, context(desk)).arm
    assert isinstance(arm, BusArm)
    return port, arm


def zebra_driver(arm: BusArm) -> ZebraZero:
    driver = arm.connect()
    assert isinstance(driver, ZebraZero)
    return driver


def test_zebra(desk: VirtualDesk, notes: Notebook) -> None:
    port, arm = zebra(desk)
    arm.configure()
    driver = zebra_driver(arm)
    tell_modules(driver, notes)
    examine_zebra(driver, desk.clock, SECONDS, notes)
    assert told(notes, Level.WRONG) == []
    assert facts(notes)["modules"].startswith("6, addresses 1 to 6: servo, firmware 10")
    assert facts(notes)["line"] == "230400 baud"
    assert "divider = " in facts(notes)["budget"]
    assert "no axis reports a fault, and every joint is within its limits -> " in told(notes, Level.OK)
    assert "counts_file" in told(notes, Level.NOTE)[0]
    (table,) = notes.section().tables
    assert [row[2] for row in table.rows] == ["off"] * 6
    assert not any(module.servo.overcurrent for module in port.line.emulator.modules)


def test_zebra_of_which_nobody_knows_where_it_is(desk: VirtualDesk, notes: Notebook) -> None:
    _, arm = zebra(desk, at_home=False)
    driver = zebra_driver(arm)
    driver.connect()
    tell_modules(driver, notes)
    assert facts(notes)["modules"].startswith("6, ")
    with pytest.raises(LifecycleError, match="at_home=True"):
        arm.configure()


def test_zebra_with_a_fault(desk: VirtualDesk, notes: Notebook) -> None:
    port, arm = zebra(desk)
    arm.configure()
    driver = zebra_driver(arm)
    port.line.emulator.modules[2].servo.overcurrent = True
    examine_zebra(driver, desk.clock, SECONDS, notes)
    assert "motor 3: overcurrent -> see what holds the arm up, then acknowledge" in told(notes, Level.WRONG)


OTHER_ZEBRA = {"wrist_factor": 1.38488, "require_power": False, "use_limit_inputs": False}
"""One with the other wrist gears, whose amplifiers report no supply, and with nothing wired to limit inputs."""


@pytest.mark.parametrize(("table", "wrong"), [(OTHER_ZEBRA, []), ({}, ["require_power", "use_limit_inputs"])])
def test_what_a_zebra_lacks_is_no_fault_where_the_rig_file_says_so(
    desk: VirtualDesk, notes: Notebook, table: dict[str, Any], wrong: list[str]
) -> None:
    port, arm = zebra(desk, **table)
    arm.configure()
    driver = zebra_driver(arm)
    port.line.emulator.modules[0].servo.set_power(powered=False)
    port.line.emulator.modules[1].set_limits(True, True)
    examine_zebra(driver, desk.clock, SECONDS, notes)
    assert [setting for setting in OTHER_ZEBRA if any(setting in line for line in told(notes, Level.WRONG))] == wrong
    assert driver.settings.transmission.wrist_factor == table.get("wrist_factor", 1.0)


def test_zebra_unplugged_in_mid_run(desk: VirtualDesk, notes: Notebook) -> None:
    port, arm = zebra(desk)
    arm.configure()
    driver = zebra_driver(arm)
    port.unplug()
    with pytest.raises(DriverError):
        examine_zebra(driver, desk.clock, SECONDS, notes)
    assert "replies" in facts(notes)


def drives(desk: VirtualDesk) -> tuple[list[CanopenDrive], Cia402Arm]:
    plant = IdealPlant()
    nodes = [CanopenDrive(axis + 1, plant, axis) for axis in range(6)]
    desk.can("can0", *nodes)
    settings = {"interface": "virtual", "channel": "can0", "counts_per_rad": [30_557.75] * 6}
    arm = make_cia402(settings, context(desk)).arm
    assert isinstance(arm, BusArm)
    # What is asked of a drive that still boots is lost.
    desk.clock.sleep(0.1)
    arm.configure()
    driver = arm.connect()
    assert isinstance(driver, Cia402Arm)
    return nodes, driver


def test_cia402(desk: VirtualDesk, notes: Notebook) -> None:
    _, driver = drives(desk)
    examine_cia402(driver, desk.clock, SECONDS, notes)
    assert told(notes, Level.WRONG) == []
    states, traffic = notes.section().tables
    assert [row[0] for row in states.rows] == list("123456")
    assert {row[6] for row in states.rows} == {"switch on disabled"}
    assert len(traffic.rows) == 6
    assert "divider = " in facts(notes)["budget"]
    assert facts(notes)["state"] == "configured"


def test_cia402_unplugged_in_mid_run(desk: VirtualDesk, notes: Notebook) -> None:
    nodes, driver = drives(desk)
    for node in nodes:
        node.faults.silent = True
    with pytest.raises(DriverError):
        examine_cia402(driver, desk.clock, SECONDS, notes)
    assert facts(notes)["state"].startswith("faulted")
    assert "answers missing" in " ".join(told(notes, Level.WRONG))


def test_cia402_whose_answers_come_a_cycle_late(desk: VirtualDesk, notes: Notebook) -> None:
    """It was told to look for a second node of the same number, and at the cable, where a computer was busy."""
    nodes, driver = drives(desk)
    period_ns = driver.settings.period_ns
    asked = driver._exchange.run

    def run(*words: Any) -> Any:
        late = {0: 0.7, 9: 1.2}.get(desk.clock.now_ns() // period_ns % 20, 0.0)
        for node in nodes:
            node.faults.delay_tpdos_ns = round(late * period_ns)
        return asked(*words)

    driver._exchange.run = run  # type: ignore[method-assign]
    examine_cia402(driver, desk.clock, SECONDS, notes)
    wrong = " ".join(told(notes, Level.WRONG))
    assert "of them came late" in wrong
    assert "twice" not in wrong
    assert "end other work on this computer" in str(notes.section())


def jr3(desk: VirtualDesk, wrench: Callable[[int], tuple[float, ...]]) -> tuple[Jr3CanNode, Jr3ForceSensor]:
    node = Jr3CanNode(1, wrench, replace(Jr3Config(), boot_ns=1_000_000), generator=np.random.default_rng(0))
    desk.can("can0", node)
    sensor = make_jr3_can({"interface": "virtual", "channel": "can0"}, context(desk))
    sensor.configure()
    sensor.activate()
    return node, sensor


def test_jr3(desk: VirtualDesk, notes: Notebook) -> None:
    _, sensor = jr3(desk, lambda now_ns: (0.0, 0.0, 5.0 + (now_ns // 7) % 2, 0.0, 0.0, 0.0))
    examine_jr3(sensor, desk.clock, SECONDS, notes)
    assert told(notes, Level.WRONG) == []
    assert "node 1" in facts(notes)["identity"]
    assert facts(notes)["full scales"].endswith("N m")
    assert "asked for 200.0 Hz" in facts(notes)["rate"]
    (table,) = notes.section().tables
    assert table.columns[-1] == "peak of it"


def test_jr3_that_is_overloaded(desk: VirtualDesk, notes: Notebook) -> None:
    _, sensor = jr3(desk, lambda now_ns: (0.0, 0.0, 2000.0, 0.0, 0.0, 0.0))
    examine_jr3(sensor, desk.clock, SECONDS, notes)
    assert "saturation" in " ".join(told(notes, Level.WRONG))


def test_jr3_whose_readings_this_computer_held_up(desk: VirtualDesk, notes: Notebook) -> None:
    _, sensor = jr3(desk, lambda now_ns: (0.0, 0.0, 5.0 + (now_ns // 7) % 2, 0.0, 0.0, 0.0))
    asleep, times = desk.clock.sleep_until, 0

    def oversleep(deadline_ns: int) -> None:
        nonlocal times
        times += 1
        asleep(deadline_ns + (200_000_000 if times == 100 else 0))

    with patch.object(desk.clock, "sleep_until", oversleep):
        examine_jr3(sensor, desk.clock, SECONDS, notes)
    assert "this computer or its adapter held readings up for 2" in " ".join(told(notes, Level.WRONG))
    assert "check cable and power" not in str(notes.section())


def test_jr3_that_falls_silent(desk: VirtualDesk, notes: Notebook) -> None:
    node, sensor = jr3(desk, lambda now_ns: (0.0, 0.0, 5.0 + (now_ns // 7) % 2, 0.0, 0.0, 0.0))
    node.firmware.silent = True
    desk.clock.sleep(0.05)
    examine_jr3(sensor, desk.clock, SECONDS, notes)
    wrong = " ".join(told(notes, Level.WRONG))
    assert "the sensor was silent for" in wrong
    assert "only 0 readings" in wrong
