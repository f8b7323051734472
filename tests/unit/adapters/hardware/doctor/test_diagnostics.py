"""What our own drivers report of themselves, each against its emulator in virtual time."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from palpate.adapters.hardware.plugins import RigContext, force_sensor_maker
from palpate.adapters.hardware.served_arm import DriverArm
from palpate.core.motion.arm import arm_named
from palpate.drivers.device import ArmDriver
from palpate.drivers.errors import DriverError
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.jr3 import Jr3CanNode, Jr3Config
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.arms import driver_arm
from tests.support.ideal_motors import IdealPlant
from tests.virtual_lines import VirtualDesk, VirtualPort

LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)

CONFIG = replace(Jr3Config(), boot_ns=1_000_000)


@pytest.fixture
def desk() -> Iterator[VirtualDesk]:
    with VirtualDesk() as desk:
        yield desk


def context(desk: VirtualDesk) -> RigContext:
    return RigContext(desk.clock, arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)


def driver_of(arm: DriverArm) -> ArmDriver:
    """The open driver, cycled by the test instead of by a thread."""
    arm.open()
    return arm.driver


def zebra(desk: VirtualDesk, **settings: Any) -> tuple[VirtualPort[NmcChain], DriverArm]:
    port = desk.serial("arm", NmcChain(IdealPlant()))
    table = {"port": "arm", "baud": 230_400, "divider": 2, "at_home": True, "reset_wait_ms": 40.0, **settings}
    arm = driver_arm("zebra-nmc", table, context(desk))
    return port, arm


def test_zebra(desk: VirtualDesk) -> None:
    port, arm = zebra(desk)
    assert arm.diagnostics() == {}
    driver = driver_of(arm)
    driver.cycle()
    found = arm.diagnostics()
    assert found["fault"] == ""
    assert found["modules"].startswith("6, servo, firmware 10")
    assert found["line"].startswith("230400 baud")
    assert "counts_file" in found["counters"]
    assert not any(module.servo.overcurrent for module in port.line.emulator.modules)


def test_zebra_with_a_fault(desk: VirtualDesk) -> None:
    port, arm = zebra(desk)
    driver = driver_of(arm)
    port.line.emulator.modules[2].servo.overcurrent = True
    driver.cycle()
    assert "motor 3: overcurrent; see what holds the arm up" in arm.diagnostics()["fault"]


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ({}, "require_power"),
        ({"require_power": False}, "use_limit_inputs"),
        ({"require_power": False, "use_limit_inputs": False}, ""),
    ],
)
def test_what_a_zebra_lacks_is_no_fault_where_the_rig_file_says_so(
    desk: VirtualDesk, table: dict[str, Any], word: str
) -> None:
    port, arm = zebra(desk, **table)
    driver = driver_of(arm)
    port.line.emulator.modules[0].servo.set_power(powered=False)
    port.line.emulator.modules[1].set_limits(True, True)
    driver.cycle()
    fault = arm.diagnostics()["fault"]
    assert word in fault
    assert bool(word) == bool(fault)


def drives(desk: VirtualDesk) -> tuple[list[CanopenDrive], DriverArm]:
    plant = IdealPlant()
    nodes = [CanopenDrive(axis + 1, plant, axis) for axis in range(6)]
    desk.can("can0", *nodes)
    settings = {"interface": "virtual", "channel": "can0", "counts_per_rad": [30_557.75] * 6}
    arm = driver_arm("cia402", settings, context(desk))
    # What is asked of a drive that still boots is lost.
    desk.clock.sleep(0.1)
    return nodes, arm


def test_cia402(desk: VirtualDesk) -> None:
    _, arm = drives(desk)
    driver_of(arm).cycle()
    found = arm.diagnostics()
    assert (found["fault"], found["state"]) == ("", "configured")
    assert found["drives"].startswith("1 EMU1")
    assert found["answers"].endswith(" cycles, 0 answers missing")


def test_cia402_unplugged_in_mid_run(desk: VirtualDesk) -> None:
    nodes, arm = drives(desk)
    driver = driver_of(arm)
    for node in nodes:
        node.faults.silent = True

    def cycled() -> None:
        for _ in range(100):
            driver.cycle()

    with pytest.raises(DriverError):
        cycled()
    assert "unanswered" in arm.diagnostics()["fault"]


def test_jr3(desk: VirtualDesk) -> None:
    node = Jr3CanNode(1, lambda now_ns: (0.0,) * 6, CONFIG, generator=np.random.default_rng(0))
    desk.can("can0", node)
    sensor = force_sensor_maker("jr3-can")({"interface": "virtual", "channel": "can0"}, context(desk))
    assert sensor.diagnostics() == {}
    sensor.configure()
    sensor.activate()
    found = sensor.diagnostics()
    assert found["fault"] == ""
    assert "node 1" in found["board"]
    assert "0 missed" in found["readings"]
