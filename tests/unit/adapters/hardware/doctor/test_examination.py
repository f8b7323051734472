"""The order of things: what is opened is closed, one failure hides nothing else, nothing gets power unasked."""

from types import SimpleNamespace

import pytest

from palpate.adapters.config import DeviceEntry, RigFile
from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.adapter_arm import AdapterArm
from palpate.adapters.hardware.doctor import DeviceReport, Examination, Level, examination
from palpate.adapters.hardware.doctor.move import report_moves
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext
from palpate.core.errors import DeviceError
from palpate.core.motion import arm_named
from palpate.core.ports import CommandReason, JointCommand, Life
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.support.arm_thread import arm_in_thread
from tests.virtual_time import VirtualTime

HOME, LIMIT = (0.1, 0.2), (1.0, 1.0)


def fake_arm(clock, home=HOME):
    return FakeArm(clock, home, lower_rad=(-1.0, -1.0), upper_rad=LIMIT, max_step_rad=0.1)


class Bench:
    """A rig of third-party adapters, the arm's process a thread."""

    def __init__(self, monkeypatch):
        self.clock = VirtualTime()
        self.arm, self.sensor = fake_arm(self.clock), FakeForceSensor(self.clock)
        self.encoder = FakeJointEncoder(self.clock, self.arm.position_rad)
        self.adapter = ArmAdapter(self.encoder, self.arm)
        self.lower_rad = (-1.0, -1.0)
        self.activated = []
        monkeypatch.setattr(self.arm, "_on_activate", lambda: self.activated.append("arm"))
        monkeypatch.setattr(examination, "arm_in_process", lambda *given: self.hosted(*given))
        monkeypatch.setattr(examination, "force_sensor_maker", lambda _: lambda settings, context: self.sensor)

    def hosted(self, _, context, *_more):
        return arm_in_thread(AdapterArm(self.adapter, context), self.clock, 10**10)

    def reports(self, *, move=False):
        file = RigFile("bench", DeviceEntry("mine", {}), DeviceEntry("yours", {}))
        return list(Examination(file, self.context, 0.2, move=move).reports())

    @property
    def context(self):
        return RigContext(self.clock, arm_named("ur5"), self.lower_rad, LIMIT, LIMIT)

    def is_closed(self):
        return all(device.life is Life.CLOSED for device in (self.arm, self.encoder, self.sensor))


@pytest.fixture
def bench(monkeypatch):
    return Bench(monkeypatch)


def wrongs(report):
    return " ".join(f.text for f in report.findings if f.level is Level.WRONG)


def test_everything_is_examined_and_closed_without_power(bench):
    bench.arm.diagnostics = lambda: {"firmware": "7"}
    rig, arm, sensor = bench.reports()
    assert arm.facts["firmware"] == "7"
    assert [report.title for report in (rig, arm, sensor)] == ["rig: bench", "arm: mine", "force sensor: yours"]
    assert arm.count(Level.WRONG) == 0
    assert bench.is_closed()
    assert not bench.activated


def test_arm_moves_only_on_request(bench):
    _, arm, _ = bench.reports(move=True)
    assert [finding.topic.value for finding in arm.findings].count("move") == 2
    assert bench.activated
    assert bench.is_closed()


@pytest.mark.parametrize(("stood_s", "text"), [(0.2, "stationary 200 ms after"), (None, "moved on for 1 s")])
def test_statement_that_a_robot_stops_by_itself_is_tried(bench, monkeypatch, stood_s, text):
    file = RigFile("bench", DeviceEntry("mine", {"stops_without_commands": True}), DeviceEntry("yours", {}))
    again = SimpleNamespace(open=str, enable=str, run_out=lambda: stood_s, close=str)
    monkeypatch.setattr(examination, "arm_maker", lambda _: lambda settings, context: again)
    monkeypatch.setattr(examination, "served", lambda arm, _: arm)
    _, report, _ = Examination(file, bench.context, 0.2, move=True).reports()
    assert text in report.findings[-1].text
    assert (report.count(Level.WRONG) == 0) == (stood_s is not None)
    assert bench.is_closed()


def test_nothing_moves_where_something_is_wrong(bench):
    bench.lower_rad = (0.15, -1.0)
    _, arm, _ = bench.reports(move=True)
    assert "limits of the model: 1" in wrongs(arm)
    assert not bench.activated


def test_arm_that_is_its_own_encoder_gets_no_power(bench):
    bench.adapter = ArmAdapter(bench.arm, bench.arm)
    _, arm, _ = bench.reports()
    assert any("--move" in finding.text for finding in arm.findings if finding.level is Level.NOTE)
    assert (bench.arm.life, bench.activated) == (Life.CLOSED, [])


def test_device_that_fails_does_not_hide_the_other(bench):
    bench.encoder.disconnected = True
    _, arm, sensor = bench.reports()
    assert "does not answer" in wrongs(arm)
    assert "age" in sensor.facts
    assert bench.is_closed()


def test_interrupt_closes_what_is_open(bench, monkeypatch):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr(bench.sensor, "read", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.reports()
    assert bench.is_closed()


class Moves:
    """An arm whose encoders show what a fault makes of its angles."""

    def __init__(self, shown=lambda q: q, home=HOME):
        self.clock, self.report = FakeClock(), DeviceReport("arm")
        self.arm = fake_arm(self.clock, home)
        self.encoder = FakeJointEncoder(self.clock, lambda: shown(self.arm.position_rad()))
        for device in (self.arm, self.encoder):
            device.configure()
            device.activate()

    def texts(self):
        report_moves(self.arm, self.encoder, self.clock, LIMIT, self.report)
        assert self.is_stopped()
        return [f"{finding.level.value} {finding.text}" for finding in self.report.findings]

    def is_stopped(self):
        return self.arm.send(JointCommand(HOME)).reason is CommandReason.STOPPED


def test_arm_that_follows_is_moved_joint_by_joint_and_back():
    moves = Moves()
    second, first = moves.texts()
    assert second.startswith("ok joint 2 made +1.000 of +1 mrad")
    assert first.startswith("ok joint 1 made +1.000 of +1 mrad")
    assert moves.arm.position_rad() == pytest.approx(HOME)


def test_lag_of_an_arm_is_measured_on_its_moves():
    shown = [HOME] * 6  # and the read itself

    def behind(q):
        shown.append(q)
        return shown[-7]

    moves = Moves(behind)
    moves.texts()
    assert moves.report.facts["lag"].startswith("50 ms at most")


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (lambda q: HOME, "check gains, brake"),
        (lambda q: (q[0], 2 * HOME[1] - q[1]), "correct the sign of its counts"),
        (lambda q: (2 * HOME[0] - q[0], q[1]), "wrong joint 1 made -1.000 of +1 mrad"),
        (lambda q: (q[0], HOME[1] + 2.0 * (q[1] - HOME[1])), "correct its counts per radian, by the factor 2.00"),
        (lambda q: (q[0] + q[1] - HOME[1], q[1]), "another joint 1.000 mrad: correct transmission"),
    ],
)
def test_joint_that_does_not_follow_is_named_with_its_remedy(shown, words):
    assert words in Moves(shown).texts()[-1]


def test_arm_that_is_held_back_or_lost_is_stopped():
    moves = Moves()
    moves.arm.stop()
    with pytest.raises(DeviceError, match="held back"):
        moves.texts()
    moves = Moves()
    moves.encoder.read()
    moves.encoder.silent = True
    with pytest.raises(DeviceError, match="stale"):
        moves.texts()
    assert moves.is_stopped()
