"""Rates, marks and noise of devices of which only the ports are known."""

import pytest

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level
from palpate.adapters.hardware.doctor.measure import listen, report_clock, report_pace, report_wrench
from palpate.adapters.hardware.doctor.move import report_pose
from palpate.core.ports import Validity, WrenchSample
from tests.fake_devices import FakeForceSensor

MS = 1_000_000


def levels(report: DeviceReport) -> dict[str, Level]:
    return {finding.topic.value: finding.level for finding in report.findings}


class LateClock(FakeClock):
    """Wakes late, or too early."""

    def __init__(self, late_ns: int) -> None:
        super().__init__()
        self._late_ns = late_ns

    def sleep_until(self, deadline_ns: int) -> None:
        super().sleep_until(deadline_ns + self._late_ns)


@pytest.mark.parametrize(("late_ns", "level"), [(0, Level.OK), (5 * MS, Level.NOTE), (-MS, Level.WRONG)])
def test_the_clock(late_ns: int, level: Level) -> None:
    report = DeviceReport("rig")
    report_clock(LateClock(late_ns), report)
    assert levels(report) == {"clock": level}


class Sensor:
    """Gives a sample every few milliseconds."""

    def __init__(self, clock: FakeClock, period_ns: int, values: tuple[float, ...], mark: Validity = Validity.VALID):
        self.clock, self.period_ns, self.values, self.mark = clock, period_ns, values, mark

    def read(self) -> WrenchSample:
        number = self.clock.now_ns() // self.period_ns
        time_ns = number * self.period_ns
        force = (0.0, 0.0, self.values[number % len(self.values)])
        return WrenchSample(force, (0.0, 0.0, force[2] * 0.1), time_ns, time_ns, number, self.mark)


def examined(values: tuple[float, ...], period_ns: int = 5 * MS, mark: Validity = Validity.VALID) -> DeviceReport:
    clock, report = FakeClock(), DeviceReport("force sensor")
    series = listen(Sensor(clock, period_ns, values, mark).read, clock, 0.5)
    report_pace(series, 200.0, report)
    report_wrench(series, report)
    return report


def test_a_good_sensor() -> None:
    report = examined((1.0, 1.2))
    assert set(levels(report).values()) == {Level.OK}
    assert report.findings[0].text == "200.0 new samples a second, the device is set to 200.0 Hz"
    assert "+1.100 N; sigma 0.0000, 0.0000, 0.1000" in report.facts["force"]


@pytest.mark.parametrize(
    ("report", "topic", "level"),
    [
        (examined((1.0,)), "noise", Level.WRONG),
        (examined((0.0, 9.0)), "noise", Level.NOTE),
        (examined((1.0, 1.2), mark=Validity.SATURATED), "range", Level.WRONG),
        (examined((1.0, 1.2), mark=Validity.STALE), "samples", Level.WRONG),
        (examined((1.0, 1.2), mark=Validity.INVALID), "noise", Level.WRONG),
        (examined((1.0, 1.2), period_ns=10 * MS), "rate", Level.WRONG),
    ],
)
def test_what_is_wrong_with_samples(report: DeviceReport, topic: str, level: Level) -> None:
    assert levels(report)[topic] is level


def test_a_sensor_of_unknown_rate() -> None:
    clock, report = FakeClock(), DeviceReport("force sensor")
    sensor = FakeForceSensor(clock)
    sensor.configure()
    sensor.activate()
    report_pace(listen(sensor.read, clock, 0.2), None, report)
    assert levels(report) == {"rate": Level.OK, "samples": Level.OK}


@pytest.mark.parametrize(
    ("pose", "joints", "wrong"),
    [((0.0, 0.5), 2, ""), ((0.0, 5.0), 2, "limits of the model: 2"), ((0.0, 0.5), 3, "the model of the arm has 3")],
)
def test_a_pose(pose: tuple[float, ...], joints: int, wrong: str) -> None:
    report = DeviceReport("arm")
    report_pose(pose, (-1.0,) * joints, (1.0,) * joints, report)
    text = " ".join(finding.text for finding in report.findings if finding.level is Level.WRONG)
    assert wrong in text
    assert bool(wrong) == bool(text)
