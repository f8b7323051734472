"""A rig of real devices, as a rig file names them."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from palpate.adapters.approach import Approach, walk
from palpate.adapters.config import RunConfig
from palpate.adapters.monotonic_clock import MonotonicClock
from palpate.adapters.plugins import RigContext, arm_maker, force_sensor_maker
from palpate.adapters.rig import Rig, World
from palpate.adapters.rig_file import RigFile
from palpate.adapters.watchdogs.guard import GuardedArm
from palpate.adapters.watchdogs.operator_stop import OperatorSources, OperatorStop
from palpate.adapters.watchdogs.trip import Trip
from palpate.core.arms import arm_named
from palpate.core.cycle import Ports
from palpate.core.kinematics import Kinematics, ToolGeometry
from palpate.core.lifecycle import Life


class HardwareRig(Rig):
    """Real devices behind the ports. A context manager: on exit the arm is stopped and every device closed.

    Args:
        file: What the rig is made of.
        config: The run's configuration.
        approach: How the arm comes to the ready pose before the first trial.

    Attributes:
        ports: What the core runs over.
        operator: Stops the arm at a person's word.
    """

    def __init__(self, file: RigFile, config: RunConfig, approach: Approach) -> None:
        kinematics = Kinematics(arm_named(config.arm), ToolGeometry())
        context = RigContext(
            MonotonicClock(),
            arm_named(config.arm),
            tuple(kinematics.lower_rad.tolist()),
            tuple(kinematics.upper_rad.tolist()),
            tuple(kinematics.velocity_limit_rad_s.tolist()),
        )
        sensor = force_sensor_maker(file.force_sensor.adapter)(file.force_sensor.settings, context)
        adapter = arm_maker(file.arm.adapter)(file.arm.settings, context)
        table = file.operator
        sources = OperatorSources(
            keys=table.keys,
            file=Path(table.file) if table.file else None,
            socket=Path(table.socket) if table.socket else None,
        )
        self._devices = (sensor, adapter.encoder, adapter.arm)
        self.operator = OperatorStop(adapter.arm, context.clock, sources, tell=_tell)
        self.ports = Ports(context.clock, sensor, adapter.encoder, GuardedArm(adapter.arm, [self.operator]))
        self._file, self._approach, self._limit_N = file, approach, config.task.max_force_N
        self._at_ready = False

    def prepare(self, trial: int) -> None:
        """Free the arm from its last stop; before the first trial, move it to the ready pose.

        Raises:
            DeviceError: A device failed, or the arm met something on its way.
        """
        arm = self.ports.arm
        if arm.life is Life.ACTIVE:
            arm.deactivate()
        arm.activate()
        if not self._at_ready:
            walk(self._approach, self.ports, self._file.approach_rad_s, self._limit_N)
            self._at_ready = True

    def world(self) -> World:
        """What a log must know: there is no way to set this world up again, only the name of the rig."""
        facts: dict[str, Any] = {"arm": self._file.arm.adapter, "force_sensor": self._file.force_sensor.adapter}
        return World(self._file.name, facts)

    def truth(self) -> None:
        """Nobody knows."""

    @property
    def clock_ticks(self) -> int:
        """Real time cannot be set."""
        return 0

    def set_clock_ticks(self, ticks: int) -> None:
        """Real time cannot be set."""

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            devices = {id(device): device for device in self._devices}
            for device in devices.values():
                opened.callback(device.close)
                device.configure()
            for device in devices.values():
                device.activate()
            opened.enter_context(self.operator)
            self._opened = opened.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.ports.arm.stop()
        self._opened.close()


def _tell(trip: Trip) -> None:
    sys.stderr.write(f"\npalpate: the arm was stopped by a {trip.source}: {trip.text}\n")
