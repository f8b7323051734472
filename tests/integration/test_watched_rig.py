"""A rig of devices, here fake ones in virtual time: what is wired around them by default."""

from dataclasses import replace

import pytest

from palpate.adapters.config import DeviceEntry, RigFile, RunConfig, SensorFactsTable, overlay
from palpate.adapters.config.rig import OperatorTable, WatchdogTable
from palpate.adapters.hardware import ArmAdapter, FaultFile, HardwareRig, find_approach
from palpate.adapters.hardware import rig as hardware_rig
from palpate.adapters.hardware.adapter_arm import AdapterArm
from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError
from palpate.core.ports import CommandReason, JointCommand, Life
from palpate.core.trial import find_ready_pose
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.support.arm_thread import arm_in_thread
from tests.support.stopped_arm import nothing_left_behind
from tests.unit.adapters.samples import ready_pose
from tests.virtual_time import VirtualTime

CONFIG = RunConfig()
READY = tuple(ready_pose().q_rad.tolist())
HERE = JointCommand(READY)
LONG_NS = 3_600_000_000_000


class CountedArm(FakeArm):
    """Counts its commands, and may report a fault once it has power."""

    sent = 0
    fail_on_activation = ""

    def _on_activate(self):
        super()._on_activate()
        if self.fail_on_activation:
            self._latch(self.fail_on_activation)

    def send(self, command):
        self.sent += 1
        return super().send(command)


class NoisyForceSensor(FakeForceSensor):
    """No sample is like the one before."""

    def _measured(self, now_ns, sequence):
        sample = super()._measured(now_ns, sequence)
        return replace(sample, force_N=(0.1 * (sequence % 2), 0.0, 0.0))


class Devices:
    """The fakes of a rig."""


NO_KEYS = OperatorTable(keys=False)
FACTS = SensorFactsTable(0.1, 0.004, (100.0,) * 3, (5.0,) * 3, 140.0)


@pytest.fixture
def rig_of(monkeypatch):
    devices = Devices()

    def arm(_, context, *_more):
        devices.context = context
        devices.arm = CountedArm(
            context.clock, READY, lower_rad=context.lower_rad, upper_rad=context.upper_rad, max_step_rad=0.1
        )
        encoder = FakeJointEncoder(context.clock, devices.arm.position_rad, max_age_ns=LONG_NS)
        return arm_in_thread(AdapterArm(ArmAdapter(encoder, devices.arm), context), context.clock, LONG_NS)

    def force(_, context):
        devices.sensor = NoisyForceSensor(context.clock, max_age_ns=LONG_NS)
        return devices.sensor

    monkeypatch.setattr(hardware_rig, "MonotonicClock", lambda *_: VirtualTime())
    monkeypatch.setattr(hardware_rig, "arm_in_process", arm)
    monkeypatch.setattr(hardware_rig, "force_sensor_maker", lambda _: force)

    def make(watchdog, operator, config=CONFIG, facts=FACTS, latch=None):
        entry = DeviceEntry("fake", {})
        file = RigFile("fakes", entry, entry, approach_rad_s=2.0, operator=operator, watchdog=watchdog, facts=facts)
        return HardwareRig(file, config, find_approach(config, ready_pose()), latch), devices

    return make


def test_arm_walks_to_the_ready_pose_once(rig_of):
    rig, devices = rig_of(WatchdogTable(), NO_KEYS)
    with nothing_left_behind(), rig:
        for trial, walks in ((0, True), (1, False)):
            before = devices.arm.sent
            rig.prepare(trial)
            assert (devices.arm.sent > before) is walks
            rig.ports.clock.sleep_until(rig.ports.clock.now_ns() + 10**9)
            assert rig.ports.arm.send(HERE).reason is CommandReason.AS_REQUESTED
        assert rig.stopped_by() == ""
        other = overlay(CONFIG, {"task": {"goal": {"y_mm": 60.0}}})
        there = find_ready_pose(other.arm, other.tool.geometry, other.task)
        rig.move(other, there)
        rig.prepare(2)
        assert rig.ports.joint_encoder.read().position_rad == pytest.approx(there.q_rad, abs=2e-3)


def test_fault_is_kept_until_it_is_acknowledged_and_no_device_reports_one(rig_of, tmp_path, capsys):
    quiet = WatchdogTable(), NO_KEYS, CONFIG, FACTS
    path = tmp_path / "rig.toml"
    rig, _ = rig_of(*quiet, FaultFile(path))
    with pytest.raises(DeviceError), rig:
        raise FaultLatchedError("arm", "fell silent")
    assert "fault 1: arm: fell silent; kept in" in capsys.readouterr().err
    with pytest.raises(FaultLatchedError, match='--acknowledge "1 NAME: why"'):
        FaultFile(path)
    rig, devices = rig_of(*quiet, FaultFile(path, "1 Ada: plugged in"))
    devices.arm.fail_on_activation = "protective stop"
    with pytest.raises(DeviceError, match="fake arm: protective stop"), rig:
        pytest.fail("was entered")
    rig, _ = rig_of(*quiet, FaultFile(path, "1 Ada: plugged in"))
    with rig:
        rig.prepare(0)
    assert [one.by for one in rig.latch.acknowledgements] == ["Ada"]
    FaultFile(path)


def test_sensor_that_falls_silent_ends_the_way_to_the_ready_pose_and_latches(rig_of):
    rig, devices = rig_of(WatchdogTable(), NO_KEYS)
    with rig:
        rig.ports.force_sensor.read()
        devices.sensor.silent = True
        with pytest.raises(DeviceError, match="SAMPLE_STALE: age of the force sample"):
            rig.prepare(0)
        assert "SAMPLE_STALE" in rig.latch.cause


def test_rig_whose_sensor_facts_nobody_states_is_refused_before_anything_gets_power(rig_of):
    rig, devices = rig_of(WatchdogTable(), NO_KEYS, facts=replace(FACTS, noise_N=None))
    with (
        nothing_left_behind(),
        pytest.raises(ConfigurationError, match="states noise_N, which the sensor does not report"),
        rig,
    ):
        pass
    assert (devices.arm.life, devices.arm.sent) == (Life.CLOSED, 0)
