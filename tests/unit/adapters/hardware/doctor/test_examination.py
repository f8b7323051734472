"""The order of things: what is opened is closed, one failure hides nothing else, nothing gets power unasked."""

from collections.abc import Callable
from typing import Any

import pytest

from palpate.adapters.config.rig import DeviceEntry, RigFile
from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.doctor import DeviceReport, Examination, ExaminationSettings, Level, examination
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext
from palpate.core.errors import ConfigurationError
from palpate.core.motion.arm import arm_named
from palpate.core.ports.lifecycle import Life
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

LIMIT = (1.0, 1.0)


class Bench:
    """A rig of strangers' adapters."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, move: bool = False) -> None:
        self.clock = FakeClock()
        self.arm = FakeArm(self.clock, (0.1, 0.2), lower_rad=(-1.0, -1.0), upper_rad=LIMIT, max_step_rad=0.1)
        self.encoder = FakeJointEncoder(self.clock, self.arm.position_rad)
        self.sensor = FakeForceSensor(self.clock)
        self.context = RigContext(self.clock, arm_named("ur5"), (-1.0, -1.0), LIMIT, LIMIT)
        self.move = move
        self.make_arm: Callable[[], Any] = lambda: ArmAdapter(self.encoder, self.arm)
        self.lives: list[Life] = []
        monkeypatch.setattr(examination, "arm_maker", lambda name: lambda settings, context: self.make_arm())
        monkeypatch.setattr(examination, "force_sensor_maker", lambda name: lambda settings, context: self.sensor)

    def reports(self) -> list[DeviceReport]:
        file = RigFile("bench", DeviceEntry("mine", {}), DeviceEntry("yours", {}))
        settings = ExaminationSettings(0.2, move=self.move)
        return list(Examination(file, self.context, settings).reports())

    def is_closed(self) -> bool:
        return all(device.life is Life.CLOSED for device in (self.arm, self.encoder, self.sensor))


def wrongs(report: DeviceReport) -> str:
    return " ".join(f.text for f in report.findings if f.level is Level.WRONG)


def test_everything_is_examined_and_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    activated: list[str] = []
    monkeypatch.setattr(bench.arm, "_on_activate", lambda: activated.append("arm"))
    rig, arm, sensor = bench.reports()
    assert [report.title for report in (rig, arm, sensor)] == ["rig: bench", "arm: mine", "force sensor: yours"]
    assert arm.count(Level.WRONG) == 0
    assert bench.is_closed()
    assert not activated


def test_the_arm_moves_only_when_that_is_wished(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, move=True)
    _, arm, _ = bench.reports()
    assert [finding.topic.value for finding in arm.findings].count("move") == 2
    assert bench.is_closed()


def test_nothing_moves_where_something_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch, move=True)
    bench.context = RigContext(bench.clock, arm_named("ur5"), (0.15, -1.0), LIMIT, LIMIT)
    sent: list[object] = []
    monkeypatch.setattr(bench.arm, "send", sent.append)
    _, arm, _ = bench.reports()
    assert "limits of the model: 1" in wrongs(arm)
    assert not sent


def test_an_arm_that_is_its_own_encoder_is_not_activated(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.make_arm = lambda: ArmAdapter(bench.arm, bench.arm)  # type: ignore[arg-type]
    _, arm, _ = bench.reports()
    assert any("--move" in finding.text for finding in arm.findings if finding.level is Level.NOTE)
    assert bench.arm.life is Life.CLOSED


def test_a_device_that_fails_does_not_hide_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.encoder.disconnected = True
    _, arm, sensor = bench.reports()
    assert "does not answer" in wrongs(arm)
    assert "age" in sensor.facts
    assert bench.is_closed()


def test_a_maker_that_fails_does_not_hide_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.make_arm = lambda: {}["port"]
    _, arm, sensor = bench.reports()
    assert "KeyError: 'port'" in wrongs(arm)
    assert "age" in sensor.facts


def test_settings_that_no_adapter_knows_are_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)

    def refuse() -> ArmAdapter:
        raise ConfigurationError("arm.prot", "/dev/ttyUSB0", "no such field")

    bench.make_arm = refuse
    with pytest.raises(ConfigurationError, match=r"arm\.prot"):
        bench.reports()
    assert bench.sensor.life is Life.CONSTRUCTED


def test_an_interrupt_closes_what_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)

    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(bench.encoder, "read", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.reports()
    assert bench.encoder.life is Life.CLOSED
    assert bench.arm.life is Life.CLOSED
