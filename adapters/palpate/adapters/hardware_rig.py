"""A rig of real devices, as a rig file names them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import ExitStack
from math import dist
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from palpate.adapters.config import RunConfig
from palpate.adapters.monotonic_clock import MonotonicClock
from palpate.adapters.plugins import RigContext, arm_maker, force_sensor_maker
from palpate.adapters.rig import Rig, World
from palpate.adapters.rig_file import RigFile
from palpate.adapters.watchdogs.guard import GuardedArm
from palpate.adapters.watchdogs.operator_stop import OperatorSources, OperatorStop
from palpate.adapters.watchdogs.trip import Trip
from palpate.core.arms import arm_named
from palpate.core.cycle import Ports, next_slot, tick_time_ns
from palpate.core.errors import DeviceError
from palpate.core.kinematics import Kinematics, ToolGeometry
from palpate.core.lifecycle import Life
from palpate.core.task_config import CONTROL_RATE_HZ
from palpate.core.values import CommandReason, JointCommand, JointVector, Validity

_THERE_RAD: Final = 2e-3
"""An arm whose joints are all this close to a pose is there."""
_PATIENCE_TICKS: Final = 3 * CONTROL_RATE_HZ
"""How long the arm may take to arrive after its set-point has."""


class HardwareRig(Rig):
    """Real devices behind the ports. A context manager: on exit the arm is stopped and every device closed.

    Args:
        file: What the rig is made of.
        config: The run's configuration.
        approach_rad: Joint poses, (n,) each, by which the arm moves to the ready pose before the first trial.

    Attributes:
        ports: What the core runs over.
        operator: Stops the arm at a person's word.
    """

    def __init__(self, file: RigFile, config: RunConfig, approach_rad: Sequence[JointVector]) -> None:
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
        self._file, self._approach, self._limit_N = file, approach_rad, config.task.max_force_N
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
            for pose in self._approach:
                move_joints(self.ports, pose, self._file.approach_rad_s, self._limit_N)
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


def move_joints(ports: Ports, target_rad: JointVector, speed_rad_s: float, limit_N: float) -> None:
    """Move straight in joint space, all joints arriving together, and wait until the arm is there.

    The arm is left as it is on every way out: it holds its last set-point, or was stopped.

    Args:
        ports: The four ports.
        target_rad: Where to, (n,).
        speed_rad_s: Speed of the joint that has farthest to go.
        limit_N: A force that differs by more than this from the first one stops the arm.

    Raises:
        DeviceError: The arm does not follow, is held back, meets something, or a sensor fails.
    """
    clock, sensor, encoder, arm = ports.clock, ports.force_sensor, ports.joint_encoder, ports.arm
    start_ns, slot, tick, late = clock.now_ns(), 0, 0, 0
    begin = encoder.read().position_rad
    first_N = sensor.read().force_N
    far = max(abs(t - b) for t, b in zip(target_rad, begin, strict=True))
    ticks = max(1, round(far / speed_rad_s * CONTROL_RATE_HZ))
    try:
        while True:
            clock.sleep_until(tick_time_ns(start_ns, slot))
            now_ns = clock.now_ns()
            joints, wrench = encoder.read(), sensor.read()
            if joints.validity is not Validity.VALID or wrench.validity is not Validity.VALID:
                problem = f"joint sample {joints.validity.value}, force sample {wrench.validity.value}"
                raise DeviceError("rig", f"{problem} on the way to the ready pose")
            if dist(wrench.force_N, first_N) > limit_N:
                raise DeviceError("rig", f"a force of more than {limit_N:g} N on the way to the ready pose")
            tick += 1
            share = min(tick / ticks, 1.0)
            asked = tuple(b + share * (t - b) for t, b in zip(target_rad, begin, strict=True))
            applied = arm.send(JointCommand(asked))
            if applied.reason in (CommandReason.STOPPED, CommandReason.POSITION_LIMIT):
                raise DeviceError("rig", f"the arm was held back on the way to the ready pose: {applied.reason.value}")
            away = max(abs(t - q) for t, q in zip(target_rad, joints.position_rad, strict=True))
            if share == 1.0 and away <= _THERE_RAD:
                return
            late += share == 1.0
            if late > _PATIENCE_TICKS:
                raise DeviceError("rig", f"the arm does not arrive at the ready pose: {away:.4f} rad away")
            slot = next_slot(start_ns, slot, now_ns)
    except BaseException:
        arm.stop()
        raise
