"""Facts about the force sensor, its mounting, and readings that come faster than they are polled."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typing_extensions import override

from palpate.adapters.config.rig import SensorFactsTable
from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware import TurnedForceSensor
from palpate.adapters.hardware.polled_sensor import PolledForceSensor
from palpate.adapters.hardware.sensor_facts import gathered, missing_facts
from palpate.core.errors import ConfigurationError
from palpate.core.ports import Validity, WrenchSample
from palpate.core.ports.rig import SensorFacts
from palpate.drivers.device import ForceSample, PolledSensor
from palpate.simulation.work_cell import HiddenValues
from tests.fake_devices import FakeForceSensor

NOISE = {"noise_N": 0.08, "noise_Nm": 0.003}
REPORTED = SensorFactsTable(range_N=(115.0, 111.0, 185.0), range_Nm=(5.6, 5.2, 6.1), rate_Hz=200.0, frame="sensor")


def test_stated_noise_and_reported_ranges_make_the_facts():
    facts = gathered(SensorFactsTable(**NOISE), REPORTED)
    assert facts == SensorFacts(0.08, 0.003, (115.0, 111.0, 185.0), (5.6, 5.2, 6.1), 200.0, "sensor")


def test_missing_fact_is_named_with_a_remedy():
    assert missing_facts(SensorFactsTable(), REPORTED) == ("noise_N", "noise_Nm")
    with pytest.raises(ConfigurationError) as error:
        gathered(SensorFactsTable(noise_N=0.1), SensorFactsTable())
    assert error.value.field == "force_sensor.facts"
    assert "noise_Nm, range_N, range_Nm, rate_Hz, which the sensor does not report" in str(error.value)
    assert "palpate rig doctor --rig FILE" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("stated", "field", "accepted"),
    [
        ({"range_N": (115.0, 112.0, 185.0)}, "range_N", "at most 115, 111, 185, what the sensor reports"),
        ({"range_Nm": (9.0, 1.0, 1.0)}, "range_Nm", "at most 5.6, 5.2, 6.1"),
        ({"rate_Hz": 140.0}, "rate_Hz", "200, as the sensor is set"),
        ({"frame": "flange"}, "frame", "sensor, as the sensor reports it"),
    ],
)
def test_rig_file_does_not_contradict_the_sensor(stated, field, accepted):
    with pytest.raises(ConfigurationError) as error:
        gathered(SensorFactsTable(**NOISE, **stated), REPORTED)
    assert error.value.field == f"force_sensor.facts.{field}"
    assert accepted in error.value.accepted


@given(st.floats(-180.0, 180.0), st.tuples(*[st.floats(-10.0, 10.0)] * 6))
def test_turned_sensor_reads_as_if_it_were_not(turn_deg, wrench):
    measured = HiddenValues(mounting_deg=turn_deg).measured(list(wrench), (0.0, 0.0, 1.0))
    sensor = FakeForceSensor(FakeClock())
    sensor.read = lambda: WrenchSample(tuple(measured[:3]), tuple(measured[3:]), 1, 2, 3)
    read = TurnedForceSensor(sensor, turn_deg).read()
    assert (*read.force_N, *read.torque_Nm) == pytest.approx(wrench, abs=1e-12)
    assert (read.source_time_ns, read.receive_time_ns, read.sequence) == (1, 2, 3)


class Busy(PolledSensor):
    """A poll takes longer than a reading: each finds a new one."""

    def __init__(self, clock):
        super().__init__("sensor", "wait")
        self.clock, self.count = clock, 0

    @override
    def poll(self, now_ns):
        self.clock.sleep_until(now_ns + 6_000_000)
        self.count += 1
        zero = (0.0, 0.0, 0.0)
        self.latest = ForceSample(zero, zero, self.count, self.clock.now_ns())
        return [self.latest]

    @override
    def check(self): ...


@dataclass
class Table:
    max_age_ms: float = 50.0
    start_timeout_s: float = 30.0


class Sensor(PolledForceSensor[Busy]):
    period_ns = 5_000_000

    @override
    def _connect(self):
        self.device = Busy(self._clock)

    @override
    def _leave(self, device): ...


def test_sensor_whose_readings_come_faster_than_they_are_taken_is_activated():
    clock = FakeClock()
    with Sensor("sensor", clock, Table()) as sensor:
        assert clock.now_ns() < 2 * 10**9
        assert sensor.read().validity is Validity.VALID
