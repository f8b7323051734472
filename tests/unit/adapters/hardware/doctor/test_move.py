from collections.abc import Callable

import pytest

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level
from palpate.adapters.hardware.doctor.move import report_moves
from palpate.core.errors import DeviceError
from palpate.core.ports.values import CommandReason, JointCommand, JointVector
from tests.fake_devices import FakeArm, FakeJointEncoder

HOME = (0.1, 0.2)


class Bench:
    def __init__(self, shown: Callable[[JointVector], JointVector] = lambda q: q, home: JointVector = HOME) -> None:
        self.clock, self.report = FakeClock(), DeviceReport("arm")
        self.arm = FakeArm(self.clock, home, lower_rad=(-1.0, -1.0), upper_rad=(1.0, 1.0), max_step_rad=0.1)
        self.encoder = FakeJointEncoder(self.clock, lambda: shown(self.arm.position_rad()))
        for device in (self.arm, self.encoder):
            device.configure()
            device.activate()

    def run(self) -> None:
        report_moves(self.arm, self.encoder, self.clock, (1.0, 1.0), self.report)

    def texts(self) -> list[str]:
        return [f"{finding.level.value} {finding.text}" for finding in self.report.findings]

    def is_stopped(self) -> bool:
        return self.arm.send(JointCommand(HOME)).reason is CommandReason.STOPPED


def test_an_arm_that_follows() -> None:
    bench = Bench()
    bench.run()
    second, first = bench.texts()
    assert second.startswith("ok joint 2 made +1.000 of +1 mrad")
    assert first.startswith("ok joint 1 made +1.000 of +1 mrad")
    assert bench.arm.position_rad() == pytest.approx(HOME)
    assert bench.is_stopped()


def test_the_step_goes_away_from_a_limit() -> None:
    bench = Bench(home=(0.0, 1.0))
    bench.run()
    assert not bench.report.count(Level.WRONG)
    assert [text.split(" of ")[1].split()[0] for text in bench.texts()] == ["-1", "+1"]


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (lambda q: HOME, "check gains, brake"),
        (lambda q: (q[0], 2 * HOME[1] - q[1]), "correct the sign of its counts"),
        (lambda q: (2 * HOME[0] - q[0], q[1]), "wrong joint 1 made -1.000 of +1 mrad"),
        (
            lambda q: (q[0], HOME[1] + 2.0 * (q[1] - HOME[1])),
            "correct its counts per radian, by the factor 2.00",
        ),
        (lambda q: (q[0] + q[1] - HOME[1], q[1]), "another joint 1.000 mrad: correct transmission"),
    ],
)
def test_an_arm_that_does_not(shown: Callable[[JointVector], JointVector], words: str) -> None:
    bench = Bench(shown)
    bench.run()
    assert words in bench.texts()[-1]
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
