"""The adapter of ATI's Net F/T keeps the contract of a force sensor, against an emulated box in virtual time."""

import pytest

from palpate.adapters.contracts import ForceSensorContract, ForceSensorRig
from palpate.adapters.hardware.ati import NetFtForceSensor, NetFtTable
from palpate.core.errors import DeviceError
from palpate.core.ports import Life, Validity
from palpate.simulation.emulators.ati import EmulatedBox
from tests.contracts.bus_bench import loads
from tests.virtual_box import VirtualBox
from tests.virtual_time import VirtualTime


class Bench(VirtualBox):
    """An adapter, and the box that it talks to."""

    def __init__(self):
        self.load = [0.3, -0.2, 5.0, 0.01, 0.02, 0.03]
        super().__init__(VirtualTime(), EmulatedBox(lambda now_ns: tuple(self.load)))
        self.sensor = NetFtForceSensor(NetFtTable(start_timeout_s=1.0), self.clock, self.open)

    def ticks(self, count):
        self.clock.sleep(count / 140)

    def fall_silent(self):
        self.box.network = lambda datagrams: []

    def fail(self):
        self.box.status = 0x8000_0020
        self.ticks(1)
        with pytest.raises(DeviceError, match="supply voltage too low"):
            self.sensor.read()
        self.box.status = 0


class TestNetFt(ForceSensorContract):
    def make(self):
        bench = Bench()
        return ForceSensorRig(
            device=bench.sensor, clock=bench.clock, advance=bench.ticks, max_age_ns=50_000_000 + 10**9 // 140,
            **loads(bench.load), tolerance_N=1e-5, tolerance_Nm=1e-5, go_silent=bench.fall_silent,
            is_open=lambda: bench.is_open, provoke_fault=bench.fail,
            disconnect=lambda: setattr(bench, "is_plugged", False),
            reconnect=lambda: setattr(bench, "is_plugged", True), runs_by_itself=True,
        )  # fmt: skip


@pytest.mark.parametrize("end", ["silent", "unplugged"])
def test_silence_is_stale_at_first_a_cut_cable_a_fault_and_both_name_their_cause(end):
    bench = Bench()
    with bench.sensor as sensor:
        network = bench.box.network
        bench.is_plugged = end != "unplugged"
        if end == "silent":
            bench.fall_silent()
        bench.ticks(10)
        if end == "silent":
            assert sensor.read().validity is Validity.STALE
            bench.ticks(70)
        with pytest.raises(DeviceError, match="nothing new for" if end == "silent" else "network is unreachable"):
            sensor.read()
        assert sensor.life is Life.FAULTED
        bench.ticks(200)
        bench.box.network, bench.is_plugged = network, True
        sensor.acknowledge_fault()
        sensor.activate()
        assert sensor.read().validity is Validity.VALID
