"""What our own drivers report of themselves, each against its emulator in virtual time."""

import pytest

from palpate.adapters.hardware.plugins import RigContext, force_sensor_maker
from palpate.core.motion.arm import arm_named
from palpate.simulation.emulators.jr3 import Jr3CanNode
from palpate.simulation.emulators.nmc.bus import NmcChain
from tests.support.arms import driver_arm
from tests.support.ideal_motors import IdealPlant
from tests.virtual_lines import VirtualDesk

LOWER = (-3.14, -1.07, -1.70, -3.14, -3.14, -3.14)
UPPER = (3.14, 1.70, 1.07, 3.14, 3.14, 3.14)

BOOT_NS = 1_000_000


@pytest.fixture
def desk():
    with VirtualDesk() as desk:
        yield desk


def context(desk):
    return RigContext(desk.clock, arm_named("zebra-zero"), LOWER, UPPER, (1.0,) * 6)


@pytest.fixture
def zebra(desk):
    """The emulated modules and the arm, open and cycled by the test instead of by a thread."""

    def make(**settings):
        chain = NmcChain(IdealPlant())
        desk.serial("arm", chain)
        table = {"port": "arm", "baud": 230_400, "divider": 2, "at_home": True, "reset_wait_ms": 40.0, **settings}
        arm = driver_arm("zebra-nmc", table, context(desk))
        assert arm.diagnostics() == {}
        arm.open()
        return chain, arm

    return make


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ({}, "require_power"),
        ({"require_power": False}, "use_limit_inputs"),
        ({"require_power": False, "use_limit_inputs": False}, ""),
    ],
)
def test_inputs_that_a_zebra_lacks_are_no_fault_where_the_rig_file_says_so(zebra, table, word):
    chain, arm = zebra(**table)
    chain.modules[0].servo.set_power(powered=False)
    chain.modules[1].set_limits(True, True)
    arm.driver.cycle()
    fault = arm.diagnostics()["fault"]
    assert word in fault
    assert bool(word) == bool(fault)


def test_jr3_reports_its_board(desk):
    desk.can("can0", Jr3CanNode(1, lambda now_ns: (0.0,) * 6, BOOT_NS))
    sensor = force_sensor_maker("jr3-can")({"interface": "virtual", "channel": "can0"}, context(desk))
    assert sensor.diagnostics() == {}
    sensor.configure()
    sensor.activate()
    found = sensor.diagnostics()
    assert found["fault"] == ""
    assert "node 1" in found["board"]
    assert int(found["readings"]) > 0
