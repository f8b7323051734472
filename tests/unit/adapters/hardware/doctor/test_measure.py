"""Rates, marks, noise and facts of devices of which only the ports are known, and signs by a person's pushes."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.doctor import DeviceReport, Level, Person, summary_text
from palpate.adapters.hardware.doctor.findings import Topic
from palpate.adapters.hardware.doctor.measure import (
    MeasuredNoise,
    listen,
    report_clock,
    report_facts,
    report_pace,
    report_samples,
    report_wrench,
)
from palpate.adapters.hardware.doctor.move import report_pose
from palpate.adapters.hardware.doctor.push import PushCheck
from palpate.adapters.hardware.errors import translated
from palpate.core.ports import Validity, WrenchSample
from palpate.drivers.errors import SettingError, SilentError
from tests.fake_devices import FakeForceSensor

MS = 1_000_000
NOISE = np.random.default_rng(0).standard_normal(200).tolist()
PAGE = Path(__file__).parents[5] / "docs" / "how-to" / "doctor-findings.md"


def levels(report):
    return {finding.topic.value: finding.level for finding in report.findings}


def test_finding_is_one_line_with_level_code_and_remedy():
    report = DeviceReport("arm: some")
    report.include({"rate": "70 Hz", "a longer name": "word", "fault": "motor 3: overcurrent"})
    report.add(Level.WRONG, Topic.OPEN, "no such port", "find another")
    report.error(translated(SilentError("drive 3", "is silent", "plug it in"), "arm"))
    report.error(KeyError("port"))
    error = translated(SettingError("drive 3", "no mode 8", "update it"), "arm")
    assert str(error) == "arm: drive 3: no mode 8; update it"
    assert report.text().splitlines() == [
        "arm: some",
        "  rate           70 Hz",
        "  a longer name  word",
        "  wrong  fault    motor 3: overcurrent: remove its cause, then examine the rig again",
        "  wrong  open     no such port: find another",
        "  wrong  open     arm: drive 3: is silent; plug it in",
        "  wrong  open     KeyError: 'port': see the adapter's own documentation",
        "",
    ]
    assert summary_text([report]) == "problems: 4, notes: 0\n"


def test_every_code_is_on_the_page():
    assert [topic.value for topic in Topic if f"| `{topic.value}` |" not in PAGE.read_text()] == []


class LateClock(FakeClock):
    """Wakes late, or too early."""

    def __init__(self, late_ns):
        super().__init__()
        self._late_ns = late_ns

    def sleep_until(self, deadline_ns):
        super().sleep_until(deadline_ns + self._late_ns)


@pytest.mark.parametrize(("late_ns", "level"), [(0, Level.OK), (5 * MS, Level.NOTE), (-MS, Level.WRONG)])
def test_computer_that_wakes_late_is_noted_and_one_that_wakes_early_is_wrong(late_ns, level):
    report = DeviceReport("rig")
    report_clock(LateClock(late_ns), report)
    assert levels(report) == {"clock": level}


def examined(values, period_ns=5 * MS, mark=Validity.VALID, rate_Hz=200.0, dead=None, marked=range(10**9)):
    """Return what is found about a sensor that gives a sample every few milliseconds, some of them marked."""
    clock, report = FakeClock(), DeviceReport("force sensor")

    def read():
        number = clock.now_ns() // period_ns
        force_N = values[number % len(values)]
        time_ns = number * period_ns
        torque_Nm = (0.1 * force_N,) * 2 + (dead or 0.1 * force_N,)
        validity = mark if number in marked else Validity.VALID
        return WrenchSample((force_N,) * 3, torque_Nm, time_ns, time_ns, number, validity)

    series = listen(read, clock, 0.5)
    report_pace(series, rate_Hz, report, least_Hz=20.0)
    report_samples(series, report, report_wrench(series, report))
    return report


@pytest.mark.parametrize(
    ("values", "more", "topic", "level"),
    [
        (NOISE, {}, "samples", Level.OK),
        (NOISE, {"dead": 0.1}, "samples", Level.WRONG),
        ((1.1,), {}, "samples", Level.WRONG),
        ((0.0, 9.0), {}, "noise", Level.NOTE),
        ((1.0, 1.2), {"mark": Validity.SATURATED}, "samples", Level.WRONG),
        ((1.0, 1.2), {"mark": Validity.STALE}, "samples", Level.WRONG),
        (NOISE, {"mark": Validity.STALE, "marked": [51]}, "samples", Level.NOTE),
        (NOISE, {"mark": Validity.STALE, "marked": [51, 71]}, "samples", Level.WRONG),
        (NOISE, {"mark": Validity.STALE, "marked": [51], "dead": 0.1}, "samples", Level.WRONG),
        (NOISE, {"mark": Validity.SATURATED, "marked": [51]}, "samples", Level.WRONG),
        ((1.0, 1.2), {"mark": Validity.INVALID}, "noise", Level.WRONG),
        ((1.0, 1.2), {"period_ns": 10 * MS}, "rate", Level.WRONG),
        ((1.0, 1.2), {"period_ns": 20 * MS, "rate_Hz": None}, "rate", Level.NOTE),
        ((1.0, 1.2), {"rate_Hz": None}, "rate", Level.OK),
        ((1.0, 1.2), {"period_ns": 40 * MS, "rate_Hz": 25.0}, "rate", Level.NOTE),
    ],
)
def test_sample_fault_has_its_code(values, more, topic, level):
    assert levels(examined(values, **more))[topic] is level


def test_device_that_is_set_too_slow_is_not_called_a_cable_fault():
    report = examined(NOISE, period_ns=100 * MS, rate_Hz=10.0, mark=Validity.STALE)
    wrong = {finding.topic.value: finding.text for finding in report.findings if finding.level is Level.WRONG}
    assert "set it to 40 Hz" in wrong["rate"]
    assert wrong["samples"].endswith("correct the rate first")


@pytest.mark.parametrize(
    ("pose", "joints", "wrong"),
    [((0.0, 0.5), 2, ""), ((0.0, 5.0), 2, "limits of the model: 2"), ((0.0, 0.5), 3, "the model of the arm has 3")],
)
def test_pose_outside_the_model_is_wrong(pose, joints, wrong):
    report = DeviceReport("arm")
    report_pose(pose, (-1.0,) * joints, (1.0,) * joints, report)
    text = " ".join(finding.text for finding in report.findings if finding.level is Level.WRONG)
    assert wrong in text
    assert bool(wrong) == bool(text)


REPORTED = SensorFactsTable(range_N=(115.0, 111.0, 185.0), range_Nm=(5.6, 5.2, 6.1), rate_Hz=200.0, frame="sensor")


def judged(stated, reported=REPORTED):
    report = DeviceReport("force sensor")
    report_facts(stated, reported, MeasuredNoise(0.0789, 0.00321, 199.7), report)
    return ((finding.level, finding.text) for finding in report.findings)


def test_missing_facts_come_with_the_line_to_write():
    ((level, text),) = judged(SensorFactsTable())
    assert level is Level.WRONG
    assert "noise_N, noise_Nm, which every run requires" in text
    facts = SensorFactsTable(**tomllib.loads(text.partition("below [force_sensor] write ")[2])["facts"])
    assert (facts.noise_N, facts.noise_Nm) == (0.0789, 0.00321)
    assert {level for level, _ in judged(facts)} == {Level.OK}
    ((_, text),) = judged(SensorFactsTable(), SensorFactsTable())
    assert "range_N = [x, y, z], range_Nm = [x, y, z], rate_Hz = 200 } (x, y, z: from the data sheet)" in text


@pytest.mark.parametrize(("noise_N", "is_well"), [(0.05, True), (0.14, True), (0.03, False), (0.2, False)])
def test_stated_noise_may_differ_from_the_measured_by_the_limit_of_a_run(noise_N, is_well):
    force, torque = judged(SensorFactsTable(noise_N=noise_N, noise_Nm=0.003))
    assert (force[0] is Level.OK, torque[0]) == (is_well, Level.OK)
    assert is_well or "facts = { noise_N = 0.0789, noise_Nm = 0.00321 }" in force[1]


LEVER_M = 0.2


class Somebody(Person):
    """Follows the instructions, with forces in the true right-handed frame of a tool that points down."""

    def __init__(self, sensor, feel, up):
        self.sensor, self.feel, self.up = sensor, feel, up
        self.load((0.0, 0.0, 0.0))

    def load(self, force):
        fx, fy, _ = force
        self.sensor.load_N, self.sensor.load_Nm = self.feel(force, (-LEVER_M * fy, LEVER_M * fx, 0.0))

    def ask(self, question):
        return self.answer

    def notify(self, text):
        sideways = (3.0, -5.0, 0.0) if "sideways" in text else (0.0, 0.0, 0.0)
        self.load(self.up if "straight up" in text else sideways)


def well(force, torque):
    # An offset as every raw sensor has.
    return (force[0] + 2.0, force[1] - 1.0, force[2] + 5.0), torque


def mirrored(force, torque):
    return (-force[0], force[1], force[2]), (-torque[0], torque[1], torque[2])


def upside_down(force, torque):
    return (force[0], -force[1], -force[2]), (torque[0], -torque[1], -torque[2])


def without_lever(force, torque):
    return force, (0.0, 0.0, 0.0)


def numb(force, torque):
    return (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)


def checked(feel, up=(0.0, 0.0, -8.0), answer=""):
    clock, report = FakeClock(), DeviceReport("force sensor")
    with FakeForceSensor(clock) as sensor:
        person = Somebody(sensor, feel, up)
        person.answer = answer
        PushCheck(sensor, clock, person, report).run()
    return [f"{level.value} {topic.value} {text}" for level, topic, text in report.findings]


def test_sensor_with_the_contract_s_signs_passes():
    sign, axes = checked(well)
    assert sign == "ok sign a push on the tip changed Fz by -8.00 N"
    assert axes.startswith("ok axes ")
    assert "+200 mm" in axes


@pytest.mark.parametrize(
    ("feel", "up", "answer", "code", "words"),
    [
        (mirrored, (0.0, 0.0, -8.0), "", "wrong axes", "the axes are mirrored"),
        (lambda force, torque: ((-force[0], *force[1:]), torque), (0.0, 0.0, -8.0), "", "wrong axes", "or swapped"),
        (upside_down, (0.0, 0.0, -8.0), "", "wrong sign", "changed Fz by +8.00 N: Fz must become negative"),
        (well, (8.0, 0.0, -2.0), "", "wrong push", "push along the tool's axis"),
        (without_lever, (0.0, 0.0, -8.0), "", "note axes", "too near"),
        (numb, (0.0, 0.0, -8.0), "", "wrong push", "did not change by 3.0 N"),
        (well, (0.0, 0.0, -8.0), None, "wrong push", "no one answered"),
    ],
)
def test_push_that_shows_a_fault_or_nothing(feel, up, answer, code, words):
    assert any(line.startswith(code) and words in line for line in checked(feel, up, answer))
