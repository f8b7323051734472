"""A rig with real devices, defined by a rig file."""

import os
from contextlib import ExitStack, suppress
from dataclasses import replace
from math import cos, radians, sin
from typing import Any, Self

from typing_extensions import override

from palpate.adapters.config import RealTimeConfig, RigFile, RunConfig
from palpate.adapters.hardware.approach import ReadyPosePath, find_approach, move_to_ready
from palpate.adapters.hardware.arm_client import ArmClient, arm_in_process
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.fault_file import FaultFile
from palpate.adapters.hardware.operator_stop import GuardedArm, OperatorStop
from palpate.adapters.hardware.plugins import RigContext, force_sensor_maker
from palpate.adapters.hardware.real_time import RealTime, join_loop
from palpate.adapters.hardware.sensor_facts import gathered, reported_by
from palpate.core.errors import DeviceError, LifecycleError
from palpate.core.ports import (
    AppliedCommand,
    ArmCommand,
    CommandReason,
    DeviceDecorator,
    FaultLatch,
    ForceSensor,
    JointCommand,
    Life,
    ManagedDevice,
    Ports,
    Rig,
    SensorFacts,
    WorldRecord,
    WrenchSample,
)
from palpate.core.supervision import SampleMonitor
from palpate.core.trial import ReadyPose


class TurnedForceSensor(DeviceDecorator, ForceSensor):
    """Sensor rotated about the tool axis, from x towards y. Its wrenches are converted to the tool frame."""

    def __init__(self, sensor: ForceSensor, mounting_deg: float) -> None:
        super().__init__(sensor)
        self._sensor = sensor
        self._cos, self._sin = cos(radians(mounting_deg)), sin(radians(mounting_deg))

    def read(self) -> WrenchSample:
        """Return the latest sample, converted to the tool frame."""
        sample = self._sensor.read()
        c, s = self._cos, self._sin
        (fx, fy, fz), (tx, ty, tz) = sample.force_N, sample.torque_Nm
        return replace(
            sample, force_N=(c * fx - s * fy, c * fy + s * fx, fz), torque_Nm=(c * tx - s * ty, c * ty + s * tx, tz)
        )


class DeviceRig(Rig):
    """Rig whose devices are known only from the rig file and their own reports."""

    def __init__(self, file: RigFile, sensor: ForceSensor, arm: ArmClient) -> None:
        turn_deg = file.calibration.mounting_deg
        self._file, self._sensor, self._arm = file, sensor, arm
        self._turned = TurnedForceSensor(sensor, turn_deg) if turn_deg else sensor
        self._facts: SensorFacts | None = None

    @property
    def sensor_facts(self) -> SensorFacts:
        """Properties of the force sensor from the rig file and from the sensor, as read when the rig was entered."""
        if self._facts is None:
            raise LifecycleError("rig", "closed", "sensor_facts", "enter the rig first")
        return self._facts

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            self._open(opened)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self._opened.close()

    def _open(self, opened: ExitStack) -> None:
        for device in (self._sensor, self._arm):
            opened.callback(device.close)
            device.configure()
        # Before anything gets power.
        self._facts = gathered(self._file.facts, reported_by(self._sensor))
        self._sensor.activate()
        self._arm.activate()

    @override
    def device_behind(self, sample: str) -> str:
        device: object = self._arm if sample == "joint" else self._sensor
        # What arrived instead of samples; adapters may lack this, and a name too.
        name, account = str(getattr(device, "name", "")), getattr(device, "account", str)()
        return f"{name}: {account}" if account else name

    def world(self) -> WorldRecord:
        """Return the rig's name for logs; a real world cannot be reproduced."""
        facts: dict[str, Any] = {"arm": self._file.arm.adapter, "force_sensor": self._file.force_sensor.adapter}
        return WorldRecord(self._file.name, facts)

    def truth(self) -> None:
        """Return None, because the ground truth is unknown."""

    @property
    def clock_ticks(self) -> int:
        """Return 0, because real time cannot be set."""
        return 0

    def set_clock_ticks(self, ticks: int) -> None:
        """Do nothing, because real time cannot be set."""


class HardwareRig(DeviceRig):
    """Real devices behind the ports. When the context exits, the arm is stopped and every device is closed.

    Args:
        latch: Latch that persists after the program ends, or None for a temporary latch.

    Attributes:
        latch: Latch that a trip, an operator's stop or a device fault sets; while it is set, nothing moves.
    """

    def __init__(
        self, file: RigFile, config: RunConfig, approach: ReadyPosePath, latch: FaultFile | None = None
    ) -> None:
        clock, real_time = MonotonicClock(None, file.real_time_factor), config.real_time
        accepted = file.emulated or file.accept_kinematics
        own = RigContext.of(config.arm, clock)
        context = replace(own, set_priority=lambda: join_loop(real_time), tool=config.tool, accept_kinematics=accepted)
        sensor = force_sensor_maker(file.force_sensor.adapter)(file.force_sensor.settings, context)
        arm = arm_in_process(file.arm, context, real_time, file.watchdog.timeout_ns)
        self.operator = OperatorStop(arm, keys=file.operator.keys, notify=_notify)
        super().__init__(file, sensor, arm)
        self.ports = Ports(clock, self._turned, arm, GuardedArm(arm, self.operator))
        self._approach, self._limit_N, self._supervision = approach, config.task.max_force_N, config.supervision
        self._at_ready, self._left = False, list[ReadyPosePath]()
        self.latch: FaultFile = FaultFile(None) if latch is None else latch
        self.latch.still = self._reported
        # For the approach only; the caller that runs trials requests more, and reports what was granted.
        self._real_time = RealTime(RealTimeConfig(scheduling=real_time.scheduling, priority=real_time.priority))

    def prepare(self, trial: int) -> None:
        """Release the arm from its last stop. Before the first trial, also move it to the ready pose."""
        self._free()
        if not self._at_ready:
            try:
                with self._real_time.loop():
                    monitor = SampleMonitor(self._supervision, self.sensor_facts)
                    for way in (*self._left, self._approach):
                        move_to_ready(way, self.ports, self._file.approach_rad_s, self._limit_N, monitor)
                    self._left.clear()
            except DeviceError as error:
                self.latch.set(error.fault)
                raise
            # The arm needs no commands until the trial starts.
            self.ports.arm.stop()
            self._at_ready = True
            self._free()
        # Waiting data are read now, not in the first tick.
        self.ports.force_sensor.read()

    @override
    def move(self, config: RunConfig, ready: ReadyPose) -> None:
        if self._at_ready:
            # Moves up first from the place that the arm leaves.
            self._left.append(replace(self._approach, poses_rad=self._approach.poses_rad[:1]))
        self._approach, self._at_ready = find_approach(config, ready), False

    def stopped_by(self) -> str:
        """Operator stop or arm fault since the last :meth:`prepare`, or an empty string if there was none."""
        fault = self.ports.arm.fault
        return self.operator.tripped or (f"fault of the arm: {fault}" if fault else "")

    def _reported(self) -> str:
        """Return the fault reported by a device, or an empty string if there is none."""
        devices = (self._sensor, self._arm)
        return next((f"{getattr(one, 'name', 'device')}: {one.fault}" for one in devices if one.fault), "")

    def _free(self) -> None:
        arm = self.ports.arm
        if arm.life is Life.ACTIVE:
            arm.deactivate()
        arm.activate()

    @override
    def _open(self, opened: ExitStack) -> None:
        super()._open(opened)
        self.latch.begin()
        opened.enter_context(self._real_time)
        opened.enter_context(self.operator)

    @override
    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        self.ports.arm.stop()
        if isinstance(error, DeviceError):
            self.latch.set(error.fault)
        try:
            super().__exit__(kind, error, trace)
        finally:
            self.latch.end()


class NoArm(ManagedDevice, ArmCommand):
    """Arm that accepts commands without executing them."""

    @override
    def send(self, command: JointCommand) -> AppliedCommand:
        return AppliedCommand(command.position_rad, CommandReason.AS_REQUESTED)

    @override
    def stop(self) -> None:
        return


class DryRig(DeviceRig):
    """A rig's sensors and encoders; commands go to :class:`NoArm`. ``is_on`` is True if the arm had to be activated.

    The arm gets no power, except with a third-party adapter whose encoders and servos are one object, which must be
    activated to report angles.
    """

    def __init__(self, file: RigFile, config: RunConfig) -> None:
        clock = MonotonicClock(None, file.real_time_factor)
        context = replace(RigContext.of(config.arm, clock), tool=config.tool, accept_kinematics=True)
        sensor = force_sensor_maker(file.force_sensor.adapter)(file.force_sensor.settings, context)
        encoder = arm_in_process(file.arm, context, config.real_time, file.watchdog.timeout_ns)
        encoder.listens = True
        self.is_on = not encoder.listens_unpowered
        super().__init__(file, sensor, encoder)
        self.ports = Ports(clock, self._turned, encoder, NoArm("no arm"))
        self.latch = FaultLatch()

    def prepare(self, trial: int) -> None:
        """Discard buffered data without any motion."""
        self.ports.force_sensor.read()


def _notify(trip: str) -> None:
    with suppress(OSError):
        # Unbuffered, because signal handlers call this.
        os.write(2, f"\npalpate: the arm was stopped, {trip}\n".encode())
