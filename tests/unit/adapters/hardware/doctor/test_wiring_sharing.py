from dataclasses import replace

from palpate.adapters.config.rig import DeviceEntry
from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.wiring import Wiring, examine_sharing, wiring_of
from tests.unit.adapters.hardware.doctor.notebook import told

ARM = Wiring(network="can0", canopen_nodes=(1, 2, 3), bitrate=1_000_000)
SENSOR = Wiring(network="can0", jr3_node=9, period_us=5000, bitrate=1_000_000)


def examined(arm: Wiring, sensor: Wiring) -> Notebook:
    notes = Notebook("rig")
    examine_sharing(arm, sensor, notes)
    return notes


def test_a_bus_may_be_shared() -> None:
    notes = examined(ARM, SENSOR)
    assert not told(notes, Level.WRONG)
    assert "fill" in " ".join(told(notes, Level.OK))


def test_nodes_that_collide_are_told_with_a_free_one() -> None:
    (line,) = told(examined(ARM, replace(SENSOR, jr3_node=2)), Level.WRONG)
    assert "node 2" in line
    assert "for example 4" in line


def test_a_bus_that_is_too_full() -> None:
    (line,) = told(examined(ARM, replace(SENSOR, period_us=250)), Level.WRONG)
    assert "more than 80%" in line
    assert "period_us" in line


def test_two_bit_rates_on_one_bus() -> None:
    lines = told(examined(ARM, replace(SENSOR, bitrate=500_000)), Level.WRONG)
    assert "1000000 and 500000 bit/s" in lines[0]


def test_one_serial_port_named_twice() -> None:
    (line,) = told(examined(Wiring("/dev/ttyUSB0"), Wiring("/dev/ttyUSB0")), Level.WRONG)
    assert "both name /dev/ttyUSB0" in line


def test_wires_of_their_own() -> None:
    assert told(examined(Wiring("/dev/ttyUSB0"), SENSOR), Level.OK) == ["arm and force sensor have a wire each -> "]


def test_where_a_rig_file_says_that_a_device_hangs() -> None:
    assert wiring_of(DeviceEntry("zebra-nmc", {})).serial == "/dev/ttyUSB0"
    on_can = wiring_of(DeviceEntry("jr3-can", {"node": 9}))
    assert (on_can.serial, on_can.network, on_can.jr3_node) == (None, "can0", 9)
    assert (
        wiring_of(DeviceEntry("cia402", {"interface": "slcan", "channel": "/dev/ttyACM0@1"})).serial == "/dev/ttyACM0"
    )
    assert wiring_of(DeviceEntry("strange", {"port": "/dev/ttyS1"})).serial == "/dev/ttyS1"
    assert wiring_of(DeviceEntry("strange", {"interface": "socketcan", "channel": "can1"})).network == "can1"
    assert wiring_of(DeviceEntry("strange", {"host": 3})) == Wiring()
    assert wiring_of(DeviceEntry("strange", {"host": "10.0.0.5", "port": 5800})).told == "10.0.0.5, port 5800"
