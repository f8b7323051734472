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
from palpate.adapters.hardware.rig import watched_sensors
from palpate.adapters.hardware.sensor_facts import gathered, reported_by
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    CommandReason,
    FaultLatch,
    JointCommand,
    ManagedDevice,
    Ports,
    Rig,
    SensorFacts,
    World,
)


class NoArm(ManagedDevice, ArmCommand):
    """Takes commands and keeps them to itself."""

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        return AppliedCommand(command.position_rad, CommandReason.AS_ASKED)

    @override
    def stop(self) -> None:
        return


class DryRig(Rig):
    """Sensors and encoders of a rig; commands end in :class:`NoArm`.

    The arm gets no power, except where encoders and servos are one object of a third-party adapter: that is activated,
    because it gives no angles otherwise.

    Attributes:
        is_on: Whether the arm had to be activated.
    """

    def __init__(self, file: RigFile, config: RunConfig) -> None:
        clock = MonotonicClock()
        context = replace(RigContext.of(config.arm, clock), tool=config.tool, accept_kinematics=True)
        self._sensor = force_sensor_maker(file.force_sensor.adapter)(file.force_sensor.settings, context)
        adapter = arm_maker(file.arm.adapter)(file.arm.settings, context)
        self._encoder, self._file = adapter.encoder, file
        if isinstance(adapter.arm, BusArm):
            adapter.arm.listens = True
        self.is_on = id(adapter.arm) == id(adapter.encoder) and not isinstance(adapter.arm, BusArm)
        sensors = watched_sensors(file, self._sensor, adapter.encoder, clock, len(context.lower_rad))
        self.ports, self.latch = Ports(clock, *sensors, NoArm("no arm")), FaultLatch()

    @property
    def sensor_facts(self) -> SensorFacts:
        """What rig file and force sensor say together."""
        return gathered(self._file.facts, reported_by(self._sensor))

    def prepare(self, trial: int) -> None:
        """Nothing moves; what waited in the lines is taken now."""
        self.ports.force_sensor.read()

    def world(self) -> World:
        """The name of the rig, and that nothing moved."""
        return World(self._file.name, {"arm": "none: dry run", "force_sensor": self._file.force_sensor.adapter})

    def truth(self) -> None:
        """Not known."""

    @property
    def clock_ticks(self) -> int:
        """Real time cannot be set."""
        return 0

    def set_clock_ticks(self, ticks: int) -> None:
        """Real time cannot be set."""

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            for device in (self._sensor, self._encoder):
                opened.callback(device.close)
                device.configure()
                device.activate()
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()
