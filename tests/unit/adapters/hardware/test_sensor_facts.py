"""Facts about the force sensor: what the rig file states and what the sensor reports, put together."""

import pytest

from palpate.adapters.config.rig import SensorFactsTable
from palpate.adapters.hardware.sensor_facts import gathered, missing_facts, reported_by
from palpate.core.errors import ConfigurationError
from palpate.core.ports.rig import SensorFacts

NOISE = {"noise_N": 0.08, "noise_Nm": 0.003}
REPORTED = SensorFactsTable(range_N=(115.0, 111.0, 185.0), range_Nm=(5.6, 5.2, 6.1), rate_Hz=200.0, frame="sensor")


def test_stated_noise_and_reported_ranges_make_the_facts():
    facts = gathered(SensorFactsTable(**NOISE), REPORTED)
    assert facts == SensorFacts(0.08, 0.003, (115.0, 111.0, 185.0), (5.6, 5.2, 6.1), 200.0, "sensor")


def test_a_sensor_that_reports_nothing_has_all_of_it_stated():
    stated = SensorFactsTable(**NOISE, range_N=(50.0, 50.0, 100.0), range_Nm=(2.0, 2.0, 2.0), rate_Hz=500)
    assert gathered(stated, reported_by(object())).frame == "sensor"


def test_what_is_missing_is_named_with_what_to_do():
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
def test_a_rig_file_does_not_contradict_the_sensor(stated, field, accepted):
    with pytest.raises(ConfigurationError) as error:
        gathered(SensorFactsTable(**NOISE, **stated), REPORTED)
    assert error.value.field == f"force_sensor.facts.{field}"
    assert accepted in error.value.accepted


def test_a_rig_file_may_narrow_a_range():
    facts = gathered(SensorFactsTable(**NOISE, range_N=(60.0, 60.0, 60.0), rate_Hz=201.0), REPORTED)
    assert (facts.range_N, facts.rate_Hz) == ((60.0, 60.0, 60.0), 201.0)
