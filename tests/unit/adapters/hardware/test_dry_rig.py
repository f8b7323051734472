"""A dry run's rig: sensors and encoders are read, and no arm is ever told anything."""

from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from palpate.adapters.config import DeviceEntry, RigFile, RunConfig, SensorFactsTable
from palpate.adapters.hardware import ArmAdapter, DryRig, RigContext
from palpate.adapters.hardware.arm_client import arm_in_thread
from palpate.adapters.hardware.served_arm import DriverArm, JointLimits, OpenArm
from palpate.core.ports import CommandReason, JointCommand, Life, WrenchSample
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder
from tests.unit.adapters.hardware.test_arm_process import SlowDriver
from tests.virtual_time import VirtualTime

HOME = (0.1,) * 6
MADE: list[Any] = []


class Quiet(FakeForceSensor):
    """Adds noise, as every sensor does."""

    @override
    def read(self) -> WrenchSample:
        fx, fy, fz, *torque = np.random.default_rng(self.clock.now_ns()).normal(0.0, 0.01, 6)
        self.load_N, self.load_Nm = (fx, fy, fz), tuple(torque)  # type: ignore[assignment]
        return super().read()


class NeverTold:
    """An arm that fails the test by whatever is done to it."""

    def __getattribute__(self, name: str) -> object:
        if name.startswith("__"):
            return object.__getattribute__(self, name)
        pytest.fail(f"the arm's {name} was touched")


class Combined(FakeArm):
    """Encoders and servos in one object, which must be active to be read."""

    def read(self) -> Any:
        self._require_active("read()")
        return FakeJointEncoder.read(self._encoder)

    @override
    def send(self, command: JointCommand) -> Any:
        pytest.fail("was commanded")


def make_sensor(settings: Any, context: RigContext) -> Any:
    MADE.append(Quiet(context.clock))
    return MADE[-1]


def make_arm(settings: Any, context: RigContext) -> ArmAdapter:
    encoder = FakeJointEncoder(context.clock, lambda: HOME)
    MADE.append(encoder)
    return ArmAdapter(encoder, NeverTold())  # type: ignore[arg-type]


def make_combined(settings: Any, context: RigContext) -> ArmAdapter:
    arm: Any = Combined(context.clock, HOME, lower_rad=(-3.0,) * 6, upper_rad=(3.0,) * 6, max_step_rad=0.1)
    arm._encoder = FakeJointEncoder(context.clock, lambda: HOME)
    arm._encoder.configure()
    arm._encoder.activate()
    MADE.append(arm)
    return ArmAdapter(arm, arm)


def rig(arm: str) -> DryRig:
    MADE.clear()
    facts = SensorFactsTable(0.01, 0.01, (100.0,) * 3, (10.0,) * 3, 140.0)
    entries = [DeviceEntry(f"{__name__}:{name}", {}) for name in (arm, "make_sensor")]
    return DryRig(RigFile("bench", *entries, facts=facts), RunConfig())


def test_an_arm_beside_its_encoders_is_not_touched_and_commands_end_here() -> None:
    with rig("make_arm") as made:
        assert made.ports.arm.send(JointCommand((0.5,) * 6)).reason is CommandReason.AS_ASKED
        made.ports.arm.stop()
        assert made.ports.joint_encoder.read().position_rad == HOME
        assert made.sensor_facts.noise_N == 0.01
        assert not made.is_on
    assert [device.life for device in MADE] == [Life.CLOSED, Life.CLOSED]


def test_one_object_for_encoders_and_servos_is_activated_but_not_commanded() -> None:
    with rig("make_combined") as made:
        made.ports.arm.send(JointCommand((0.5,) * 6))
        assert made.ports.joint_encoder.read().position_rad == HOME
        assert made.is_on
    assert {device.life for device in MADE} == {Life.CLOSED}


def test_an_arm_on_a_bus_that_listens_gets_no_power_and_no_set_point() -> None:
    class Mute(SlowDriver):
        def enable(self) -> None:
            pytest.fail("got power")

        def preview(self, setpoint_rad: Any, /) -> Any:
            pytest.fail("was commanded")

        def cycle(self, setpoint_rad: Any = None, /) -> Any:
            assert setpoint_rad is None
            return super().cycle(None)

    clock = VirtualTime()
    driver = Mute(clock)
    limits = JointLimits((-1.0,), (1.0,), (1.0,))
    served = DriverArm("arm", lambda: OpenArm(driver, str), clock, limits, divider=1, max_age_ns=10**8)
    arm = arm_in_thread(served, clock, 10**8)
    arm.listens = True
    arm.configure()
    arm.activate()
    assert arm.send(JointCommand((0.5,))).reason is CommandReason.STOPPED
    clock.sleep(0.1)
    assert arm.read().position_rad == (0.0,)
    arm.close()
