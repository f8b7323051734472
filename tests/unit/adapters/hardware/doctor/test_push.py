from collections.abc import Callable

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level
from palpate.adapters.hardware.doctor.push import Person, PushCheck
from palpate.core.ports.values import Vector3
from tests.fake_devices import FakeForceSensor

LEVER_M = 0.2
Feel = Callable[[Vector3, Vector3], tuple[Vector3, Vector3]]


class Somebody(Person):
    """Does as told, with forces in the true right-handed frame of a tool that points down."""

    def __init__(self, sensor: FakeForceSensor, feel: Feel, answer: str | None = "") -> None:
        self.sensor, self.feel, self.answer = sensor, feel, answer
        self.up: Vector3 = (0.0, 0.0, -8.0)
        self.sideways: Vector3 = (3.0, -5.0, 0.0)
        self.load((0.0, 0.0, 0.0))

    def load(self, force: Vector3) -> None:
        fx, fy, _ = force
        self.sensor.load_N, self.sensor.load_Nm = self.feel(force, (-LEVER_M * fy, LEVER_M * fx, 0.0))

    def ask(self, question: str) -> str | None:
        return self.answer

    def tell(self, text: str) -> None:
        if "straight up" in text:
            self.load(self.up)
        elif "sideways" in text:
            self.load(self.sideways)
        else:
            self.load((0.0, 0.0, 0.0))


def well(force: Vector3, torque: Vector3) -> tuple[Vector3, Vector3]:
    # An offset as every raw sensor has.
    return (force[0] + 2.0, force[1] - 1.0, force[2] + 5.0), torque


def mirrored(force: Vector3, torque: Vector3) -> tuple[Vector3, Vector3]:
    return (-force[0], force[1], force[2]), (-torque[0], torque[1], torque[2])


def upside_down(force: Vector3, torque: Vector3) -> tuple[Vector3, Vector3]:
    return (force[0], -force[1], -force[2]), (torque[0], -torque[1], -torque[2])


def numb(force: Vector3, torque: Vector3) -> tuple[Vector3, Vector3]:
    return (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)


def checked(feel: Feel, answer: str | None = "", **more: object) -> DeviceReport:
    clock, report = FakeClock(), DeviceReport("force sensor")
    sensor = FakeForceSensor(clock)
    sensor.configure()
    sensor.activate()
    person = Somebody(sensor, feel, answer)
    for name, value in more.items():
        setattr(person, name, value)
    PushCheck(sensor, clock, person, report).run()
    return report


def told(report: DeviceReport, level: Level) -> list[str]:
    return [f"{finding.topic.value} {finding.text}" for finding in report.findings if finding.level is level]


def test_signs_as_the_contract_wants_them() -> None:
    notes = checked(well)
    assert not told(notes, Level.WRONG)
    first, second = told(notes, Level.OK)
    assert "sign a push on the tip changed Fz by -8.00 N" in first
    assert "+200 mm" in second


def test_mirrored_axes_are_found_by_a_sideways_push() -> None:
    (line,) = told(checked(mirrored), Level.WRONG)
    assert line.startswith("axes ")
    assert "the axes are mirrored" in line


def test_a_sensor_upside_down() -> None:
    lines = told(checked(upside_down), Level.WRONG)
    assert "changed Fz by +8.00 N: Fz must become negative" in lines[0]


def test_a_push_from_the_side_tells_nothing_of_fz() -> None:
    (line,) = told(checked(well, up=(8.0, 0.0, -2.0)), Level.WRONG)
    assert line.startswith("push ")
    assert "push along the tool's axis" in line


def test_a_push_near_the_sensor_tells_nothing_of_the_axes() -> None:
    notes = checked(lambda force, torque: (force, (0.0, 0.0, 0.0)))
    assert not told(notes, Level.WRONG)
    assert "too near" in told(notes, Level.NOTE)[0]


def test_nobody_pushes_hard_enough() -> None:
    lines = told(checked(numb), Level.WRONG)
    assert "did not change by 3.0 N" in lines[0]


def test_no_one_answers() -> None:
    (line,) = told(checked(well, None), Level.WRONG)
    assert "no one answered" in line
