from collections.abc import Callable

import pytest

from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.push import Person, PushCheck
from palpate.core.ports.contracts import FakeClock
from palpate.core.ports.values import Vector3
from tests.fake_devices import FakeForceSensor
from tests.unit.adapters.hardware.doctor.notebook import told

LEVER_M = 0.2
MEND = 'axes = "right-handed"'
Feel = Callable[[Vector3, Vector3], tuple[Vector3, Vector3]]


class Somebody(Person):
    """Does as told, with forces in the true right-handed frame of a tool that points down."""

    def __init__(self, sensor: FakeForceSensor, feel: Feel, answer: str | None = "", mass_kg: float = 0.0) -> None:
        self.sensor, self.feel, self.answer, self.mass_kg = sensor, feel, answer, mass_kg
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
        elif "Hang" in text:
            self.load((0.0, 0.0, 9.81 * self.mass_kg))
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


def checked(feel: Feel, answer: str | None = "", **more: object) -> Notebook:
    clock, notes = FakeClock(), Notebook("force sensor")
    sensor = FakeForceSensor(clock)
    sensor.configure()
    sensor.activate()
    person = Somebody(sensor, feel, answer)
    for name, value in more.items():
        setattr(person, name, value)
    PushCheck(sensor, clock, person, notes, MEND).run()
    return notes


def test_signs_as_the_contract_wants_them() -> None:
    notes = checked(well)
    assert not told(notes, Level.WRONG)
    first, second = told(notes, Level.OK)
    assert "changed Fz by -8.00 N, as it must" in first
    assert "+200 mm" in second


def test_mirrored_axes_are_found_by_a_sideways_push() -> None:
    (line,) = told(checked(mirrored), Level.WRONG)
    assert "mirrored" in line
    assert line.endswith(f"-> {MEND}")


def test_a_sensor_upside_down() -> None:
    lines = told(checked(upside_down), Level.WRONG)
    assert "changed Fz by +8.00 N, it must get negative" in lines[0]


def test_a_push_from_the_side_tells_nothing_of_fz() -> None:
    (line,) = told(checked(well, up=(8.0, 0.0, -2.0)), Level.WRONG)
    assert "from the side" in line


def test_a_push_near_the_sensor_tells_nothing_of_the_axes() -> None:
    notes = checked(lambda force, torque: (force, (0.0, 0.0, 0.0)))
    assert not told(notes, Level.WRONG)
    assert "too near" in told(notes, Level.NOTE)[0]


def test_nobody_pushes_hard_enough() -> None:
    lines = told(checked(numb), Level.WRONG)
    assert "did not change by 3.0 N" in lines[0]


@pytest.mark.parametrize(
    ("feel", "hung_kg", "level", "words"),
    [
        (well, 0.5, Level.OK, "a weight of 4.91 N changed Fz by +4.91 N, as it must"),
        (upside_down, 0.5, Level.WRONG, "must make Fz more positive"),
        (well, 0.7, Level.WRONG, "changed Fz by +6.87 N"),
        (well, 0.1, Level.WRONG, "did not change by 2.5 N"),
    ],
)
def test_a_weight(feel: Feel, hung_kg: float, level: Level, words: str) -> None:
    (line,) = told(checked(feel, "0,5 kg\n", mass_kg=hung_kg), level)
    assert words in line


@pytest.mark.parametrize(("answer", "words"), [(None, "nobody answered"), ("yes\n", "is no mass"), ("-1\n", "no mass")])
def test_no_sensible_answer(answer: str | None, words: str) -> None:
    (line,) = told(checked(well, answer), Level.WRONG)
    assert words in line
