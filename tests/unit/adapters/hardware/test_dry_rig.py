"""A dry run's rig: sensors and encoders are read, and no arm is ever commanded."""

import pytest

from palpate.adapters.config import DeviceEntry, RigFile, RunConfig, SensorFactsTable
from palpate.adapters.hardware import ArmAdapter, DryRig
from palpate.adapters.hardware import rig as hardware_rig
from palpate.adapters.hardware.adapter_arm import AdapterArm
from palpate.adapters.hardware.served_arm import DriverArm, OpenArm
from palpate.adapters.hardware.zebra_zero import ZebraTable
from palpate.core.ports import CommandLimiter, CommandReason, JointCommand, JointSample, Life
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.support.arm_thread import arm_in_thread
from tests.unit.adapters.hardware.test_arm_process import SlowDriver
from tests.virtual_time import VirtualTime

HOME = (0.1,) * 6
TIMEOUT_NS = 10**9


class NeverTold(FakeArm):
    """Fails the test if it is commanded."""

    activations = 0

    def _on_activate(self):
        self.activations += 1

    def send(self, command):
        pytest.fail("was commanded")

    def read(self):
        """Encoders and servos in one object, which must be active to be read."""
        self._require_active("read()")
        return JointSample(HOME, self.clock.now_ns(), self.clock.now_ns(), self.clock.now_ns())


@pytest.mark.parametrize("is_one", [False, True])
def test_arm_gets_no_command_and_power_only_where_it_gives_no_angles_without(monkeypatch, is_one):
    made = []

    def arm(_, context, *_more):
        clock = context.clock
        servos = NeverTold(clock, HOME, lower_rad=(-3.0,) * 6, upper_rad=(3.0,) * 6, max_step_rad=0.1)
        encoder = servos if is_one else FakeJointEncoder(clock, lambda: HOME)
        made.extend((servos, encoder))
        return arm_in_thread(AdapterArm(ArmAdapter(encoder, servos), context), clock, TIMEOUT_NS)

    monkeypatch.setattr(hardware_rig, "arm_in_process", arm)
    monkeypatch.setattr(hardware_rig, "force_sensor_maker", lambda _: lambda _, context: FakeForceSensor(context.clock))
    facts = SensorFactsTable(0.01, 0.01, (100.0,) * 3, (10.0,) * 3, 140.0)
    entry = DeviceEntry("fake", {})
    with DryRig(RigFile("bench", entry, entry, facts=facts), RunConfig()) as rig:
        assert rig.ports.arm.send(JointCommand((0.5,) * 6)).reason is CommandReason.AS_REQUESTED
        rig.ports.arm.stop()
        assert rig.ports.joint_encoder.read().position_rad == HOME
        assert rig.sensor_facts.noise_N == 0.01
        assert rig.is_on is is_one
    assert made[0].activations == is_one
    assert {device.life for device in made} == {Life.CLOSED}


def test_arm_on_a_bus_that_listens_gets_no_power_and_no_set_point():
    class Mute(SlowDriver):
        def enable(self):
            pytest.fail("got power")

        def cycle(self, setpoint_rad=None, /):
            assert setpoint_rad is None
            return super().cycle(None)

    clock = VirtualTime()
    driver = Mute(clock)
    limiter = CommandLimiter((-1.0,), (1.0,), (1.0,), 140.0)
    served = DriverArm("arm", lambda: OpenArm(driver, str), clock, limiter, ZebraTable(divider=1))
    arm = arm_in_thread(served, clock, 10**8)
    arm.listens = True
    arm.configure()
    arm.activate()
    assert arm.send(JointCommand((0.5,))).reason is CommandReason.STOPPED
    clock.sleep(0.1)
    assert arm.read().position_rad == (0.0,)
    arm.close()
