"""A rig of real devices that are read and never commanded."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import Self

from typing_extensions import override

from palpate.adapters.config import RigFile, RunConfig
from palpate.adapters.hardware.arm_on_bus import BusArm
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.plugins import RigContext, arm_maker, force_sensor_maker
from palpate.adapters.hardware.rig import DeviceRig, watched_sensors
from palpate.core.ports import AppliedCommand, ArmCommand, CommandReason, FaultLatch, JointCommand, ManagedDevice, Ports


class NoArm(ManagedDevice, ArmCommand):
    """Takes commands and keeps them to itself."""

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        return AppliedCommand(command.position_rad, CommandReason.AS_ASKED)

    @override
    def stop(self) -> None:
        return


class DryRig(DeviceRig):
    """Sensors and encoders of a rig; commands end in :class:`NoArm`.

    The arm gets no power, except where encoders and servos are one object of a third-party adapter: that is activated,
    because it gives no angles otherwise.

    Attributes:
        is_on: Whether the arm had to be activated.
    """

    def __init__(self, file: RigFile, config: RunConfig) -> None:
        clock = MonotonicClock()
        context = replace(RigContext.of(config.arm, clock), tool=config.tool, accept_kinematics=True)
        sensor = force_sensor_maker(file.force_sensor.adapter)(file.force_sensor.settings, context)
        adapter = arm_maker(file.arm.adapter)(file.arm.settings, context)
        super().__init__(file, sensor, adapter.encoder)
        self.is_on = id(adapter.arm) == id(adapter.encoder)
        if isinstance(adapter.arm, BusArm):
            adapter.arm.listens, self.is_on = True, False
        sensors = watched_sensors(file, sensor, adapter.encoder, clock, len(context.lower_rad))
        self.ports, self.latch = Ports(clock, *sensors, NoArm("no arm")), FaultLatch()

    def prepare(self, trial: int) -> None:
        """Nothing moves; what waited in the lines is taken now."""
        self.ports.force_sensor.read()

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            for device in self._devices:
                opened.callback(device.close)
                device.configure()
                device.activate()
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()
