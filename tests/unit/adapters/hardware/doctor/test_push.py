"""The signs of the wrench, told from a person's pushes."""

from collections.abc import Callable

import pytest

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.doctor import DeviceReport, Person
from palpate.adapters.hardware.doctor.push import PushCheck
from palpate.core.ports import Vector3
from tests.fake_devices import FakeForceSensor

LEVER_M = 0.2
Feel = Callable[[Vector3, Vector3], tuple[Vector3, Vector3]]


class Somebody(Person):
    """Does as told, with forces in the true right-handed frame of a tool that points down."""

    def __init__(self, sensor, feel, up):
        self.sensor, self.feel, self.up = sensor, feel, up
        self.answer = ""
        self.load((0.0, 0.0, 0.0))

    def load(self, force):
        fx, fy, _ = force
        self.sensor.load_N, self.sensor.load_Nm = self.feel(force, (-LEVER_M * fy, LEVER_M * fx, 0.0))

    def ask(self, question):
        return self.answer

    def tell(self, text):
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
        (upside_down, (0.0, 0.0, -8.0), "", "wrong sign", "changed Fz by +8.00 N: Fz must become negative"),
        (well, (8.0, 0.0, -2.0), "", "wrong push", "push along the tool's axis"),
        (without_lever, (0.0, 0.0, -8.0), "", "note axes", "too near"),
        (numb, (0.0, 0.0, -8.0), "", "wrong push", "did not change by 3.0 N"),
        (well, (0.0, 0.0, -8.0), None, "wrong push", "no one answered"),
    ],
)
def test_push_that_shows_a_fault_or_nothing(feel, up, answer, code, words):
    assert any(line.startswith(code) and words in line for line in checked(feel, up, answer))
