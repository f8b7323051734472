"""Facts about the force sensor, as the doctor judges and proposes them."""

import tomllib

import pytest

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.doctor.facts import MeasuredNoise, judge_facts
from palpate.adapters.hardware.doctor.findings import Level, Notebook

REPORTED = SensorFactsTable(range_N=(115.0, 111.0, 185.0), range_Nm=(5.6, 5.2, 6.1), rate_Hz=200.0, frame="sensor")
MEASURED = MeasuredNoise(0.0789, 0.00321, 199.7)


def judged(
    stated: SensorFactsTable, reported: SensorFactsTable = REPORTED, measured: MeasuredNoise | None = MEASURED
) -> list[tuple[Level, str, str]]:
    notes = Notebook("force sensor")
    judge_facts(stated, reported, measured, notes)
    return [(finding.level, finding.text, finding.remedy) for finding in notes.section().findings]


def test_what_is_missing_comes_with_the_line_to_write() -> None:
    ((level, text, remedy),) = judged(SensorFactsTable())
    assert (level, text) == (Level.WRONG, "the rig file does not state noise_N, noise_Nm of the sensor: no run begins")
    line = remedy.removeprefix("below [force_sensor] write: ")
    facts = SensorFactsTable(**tomllib.loads(line)["facts"])
    assert (facts.noise_N, facts.noise_Nm) == (0.079, 0.0032)
    # Written down, it is well.
    assert {level for level, *_ in judged(facts)} == {Level.OK}


def test_a_range_stands_in_the_data_sheet() -> None:
    ((_, _, remedy),) = judged(SensorFactsTable(), SensorFactsTable())
    assert "range_N = [x, y, z], range_Nm = [x, y, z], rate_Hz = 200 } (x, y, z: from the data sheet)" in remedy


@pytest.mark.parametrize(("noise_N", "well"), [(0.05, True), (0.15, True), (0.03, False), (0.2, False)])
def test_stated_noise_is_held_against_what_was_measured(noise_N: float, well: bool) -> None:
    force, torque = judged(SensorFactsTable(noise_N=noise_N, noise_Nm=0.003))
    assert (force[0] is Level.OK) is well
    assert torque[0] is Level.OK
    assert well or "facts = { noise_N = 0.079, noise_Nm = 0.0032 }" in force[2]


def test_a_contradiction_is_told() -> None:
    ((level, text, _),) = judged(SensorFactsTable(noise_N=0.08, noise_Nm=0.003, rate_Hz=140.0))
    assert level is Level.WRONG
    assert "force_sensor.facts.rate_Hz = 140.0 is refused: 200" in text


@pytest.mark.parametrize("measured", [None, MeasuredNoise(0.0, 0.0, 200.0)])
def test_of_a_dead_sensor_nothing_is_proposed(measured: MeasuredNoise | None) -> None:
    assert judged(SensorFactsTable(), measured=measured) == []
