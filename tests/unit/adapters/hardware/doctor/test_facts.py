"""Facts about the force sensor, as the doctor judges and proposes them."""

import tomllib

import pytest

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.doctor.facts import report_facts
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level
from palpate.adapters.hardware.doctor.measure import MeasuredNoise

REPORTED = SensorFactsTable(range_N=(115.0, 111.0, 185.0), range_Nm=(5.6, 5.2, 6.1), rate_Hz=200.0, frame="sensor")
MEASURED = MeasuredNoise(0.0789, 0.00321, 199.7)


def judged(stated: SensorFactsTable, reported: SensorFactsTable = REPORTED) -> list[tuple[Level, str]]:
    report = DeviceReport("force sensor")
    report_facts(stated, reported, MEASURED, report)
    return [(finding.level, finding.text) for finding in report.findings]


def test_what_is_missing_comes_with_the_line_to_write() -> None:
    ((level, text),) = judged(SensorFactsTable())
    assert level is Level.WRONG
    assert "noise_N, noise_Nm, without which no run begins" in text
    line = text.partition("below [force_sensor] write ")[2]
    facts = SensorFactsTable(**tomllib.loads(line)["facts"])
    assert (facts.noise_N, facts.noise_Nm) == (0.079, 0.0032)
    # Written down, it is well.
    assert {level for level, *_ in judged(facts)} == {Level.OK}


def test_a_range_stands_in_the_data_sheet() -> None:
    ((_, text),) = judged(SensorFactsTable(), SensorFactsTable())
    assert "range_N = [x, y, z], range_Nm = [x, y, z], rate_Hz = 200 } (x, y, z: from the data sheet)" in text


@pytest.mark.parametrize(("noise_N", "well"), [(0.05, True), (0.15, True), (0.03, False), (0.2, False)])
def test_stated_noise_is_held_against_what_was_measured(noise_N: float, well: bool) -> None:
    force, torque = judged(SensorFactsTable(noise_N=noise_N, noise_Nm=0.003))
    assert (force[0] is Level.OK) is well
    assert torque[0] is Level.OK
    assert well or "facts = { noise_N = 0.079, noise_Nm = 0.0032 }" in force[1]


def test_a_contradiction_is_told() -> None:
    ((level, text),) = judged(SensorFactsTable(noise_N=0.08, noise_Nm=0.003, rate_Hz=140.0))
    assert level is Level.WRONG
    assert "force_sensor.facts.rate_Hz = 140.0 is refused: 200" in text
