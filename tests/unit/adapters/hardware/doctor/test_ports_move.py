from collections.abc import Callable

import pytest

from palpate.adapters.hardware.doctor.findings import Level, Notebook
from palpate.adapters.hardware.doctor.ports import examine_following
from palpate.core.errors import DeviceError
from palpate.core.ports.contracts import FakeClock
from palpate.core.ports.values import CommandReason, JointCommand, JointVector
from tests.fake_devices import FakeArm, FakeJointEncoder
from tests.unit.adapters.hardware.doctor.notebook import rows, told

HOME = (0.1, 0.2)


class Bench:
    def __init__(self, shown: Callable[[JointVector], JointVector] = lambda q: q, home: JointVector = HOME) -> None:
        self.clock, self.notes = FakeClock(), Notebook("arm")
        self.arm = FakeArm(self.clock, home, lower_rad=(-1.0, -1.0), upper_rad=(1.0, 1.0), max_step_rad=0.1)
        self.encoder = FakeJointEncoder(self.clock, lambda: shown(self.arm.position_rad()))
        for device in (self.arm, self.encoder):
            device.configure()
            device.activate()

    def run(self) -> None:
        examine_following(self.arm, self.encoder, self.clock, (1.0, 1.0), self.notes)

    def is_stopped(self) -> bool:
        return self.arm.send(JointCommand(HOME)).reason is CommandReason.STOPPED


def test_an_arm_that_follows() -> None:
    bench = Bench()
    bench.run()
    assert [f.text for f in bench.notes.section().findings] == ["every joint follows in direction and size"]
    assert [row[:3] for row in rows(bench.notes)] == [("2", "+1.000", "+1.000"), ("1", "+1.000", "+1.000")]
    assert bench.arm.position_rad() == pytest.approx(HOME)
    assert bench.is_stopped()


def test_the_step_goes_away_from_a_limit() -> None:
    bench = Bench(home=(0.0, 1.0))
    bench.run()
    assert not told(bench.notes, Level.WRONG)
    assert [row[1] for row in rows(bench.notes)] == ["-1.000", "+1.000"]


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (lambda q: HOME, "look at gains, brake"),
        (lambda q: (q[0], 2 * HOME[1] - q[1]), "joint 2 does not follow -> it turned the other way"),
        (lambda q: (2 * HOME[0] - q[0], q[1]), "joint 1 does not follow -> it turned the other way"),
        (
            lambda q: (q[0], HOME[1] + 2.0 * (q[1] - HOME[1])),
            "it made 2.00 times the step: correct its counts",
        ),
        (lambda q: (q[0] + q[1] - HOME[1], q[1]), "another joint moved along by 1.000 mrad"),
    ],
)
def test_an_arm_that_does_not(shown: Callable[[JointVector], JointVector], words: str) -> None:
    bench = Bench(shown)
    bench.run()
    assert words in " ".join(told(bench.notes, Level.WRONG))
    assert bench.is_stopped()


def test_an_arm_that_is_held_back_or_lost_is_stopped() -> None:
    bench = Bench()
    bench.arm.stop()
    with pytest.raises(DeviceError, match="held back"):
        bench.run()
    bench = Bench()
    bench.encoder.read()
    bench.encoder.silent = True
    with pytest.raises(DeviceError, match="stale"):
        bench.run()
    assert bench.is_stopped()
