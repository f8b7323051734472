"""The Zebra Zero on its NMC bus as an arm adapter: wiring and calibration."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

import serial

from palpate.adapters.config.toml import overlay
from palpate.adapters.hardware.arm_on_bus import ArmDriver, BusArm, BusCycle
from palpate.adapters.hardware.errors import translating
from palpate.adapters.hardware.plugins import ArmAdapter, DeviceSettings, RigContext
from palpate.core.errors import OutputError
from palpate.core.files import write_whole
from palpate.core.ports.devices import Clock
from palpate.core.ports.settings import OneOf, Range, Settings
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, CommandReason, JointVector
from palpate.drivers.errors import StateError, WiringError
from palpate.drivers.nmc.settings import POWER_UP_BAUD, BusSettings
from palpate.drivers.zebra_zero.arm import ZebraZero
from palpate.drivers.zebra_zero.counts import Transmission
from palpate.drivers.zebra_zero.settings import JointLimits, Streaming, ZebraZeroSettings
from palpate.drivers.zebra_zero.states import ZebraState

_NAME: Final = "Zebra Zero"
_JOINTS: Final = 6


class ZebraDriver(ArmDriver):
    """The driver behind the adapter.

    Args:
        open_port: Opens the serial port.
        settings: The arm's settings.
        clock: The run's clock.
        at_home: A person's word that the arm rests in its home pose whenever its controller was switched on.
        counts_file: Where the counters are kept from run to run; None keeps them nowhere.

    Attributes:
        arm: The driver proper; None before ``open``. For ``palpate doctor``.
    """

    def __init__(
        self,
        open_port: Callable[[], Any],
        settings: ZebraZeroSettings,
        clock: Clock,
        *,
        at_home: bool,
        counts_file: Path | None,
    ) -> None:
        self._open_port, self._settings, self._clock = open_port, settings, clock
        self._at_home, self._counts_file = at_home, counts_file
        self._port: Any = None
        self.arm: ZebraZero | None = None

    def open(self) -> None:
        """Open the port, find the modules, and learn where the arm is: from the stored counters, or a person's word."""
        arm = self.connect() if self.arm is None else self.arm
        stored = self._stored_counts()
        if arm.was_reset or stored is None:
            arm.confirm_home(at_home=self._at_home)
        else:
            arm.resume(stored)

    def connect(self) -> ZebraZero:
        """Open the port and find the modules, without asking where the arm is; for ``palpate doctor``."""
        self._port = self._open_port()
        self.arm = arm = ZebraZero(self._port, self._clock.now_ns, self._sleep, self._settings)
        arm.connect()
        return arm

    @property
    def keeps_counts(self) -> bool:
        """Whether the counters are kept from run to run."""
        return self._counts_file is not None

    def enable(self) -> None:
        """See :class:`ArmDriver`."""
        self._require().servo_on()

    def preview(self, asked_rad: JointVector) -> AppliedCommand:
        """See :class:`ArmDriver`."""
        applied = self._require().preview(asked_rad)
        return AppliedCommand(applied.position_rad, CommandReason[applied.reason.name])

    def cycle(self, setpoint_rad: JointVector | None) -> BusCycle:
        """See :class:`ArmDriver`."""
        measured = self._require().cycle(setpoint_rad)
        return BusCycle(measured.position_rad, measured.time_ns)

    def stop(self) -> None:
        """See :class:`ArmDriver`."""
        if self.arm is not None and self.arm.state is not ZebraState.CLOSED:
            self.arm.smooth_stop()
            self._store_counts()

    def disable(self) -> None:
        """Its servos go on holding the arm."""

    def acknowledge(self) -> None:
        """See :class:`ArmDriver`."""
        self._require().acknowledge()

    def close(self) -> None:
        """See :class:`ArmDriver`."""
        arm, port = self.arm, self._port
        self.arm = self._port = None
        if arm is not None:
            arm.close()
        if port is not None:
            port.close()

    def _require(self) -> ZebraZero:
        if self.arm is None:
            raise StateError(_NAME, "is not open", "configure it first")
        return self.arm

    def _sleep(self, seconds: float) -> None:
        self._clock.sleep_until(self._clock.now_ns() + round(seconds * 1e9))

    def _stored_counts(self) -> list[int] | None:
        if self._counts_file is None or not os.path.exists(self._counts_file):
            return None
        try:
            return [int(count) for count in json.loads(self._counts_file.read_text())]
        except (OSError, ValueError, TypeError) as error:
            problem = f"{self._counts_file} cannot be read ({error})"
            raise WiringError(_NAME, problem, "delete it and begin from the home pose") from error

    def _store_counts(self) -> None:
        counts = None if self.arm is None else self.arm.stored_counts
        if counts is None or self._counts_file is None:
            return
        # A stop must not fail for a full disk; without the file the next run begins from the home pose.
        with suppress(OutputError):
            write_whole(self._counts_file, json.dumps(counts))


@dataclass(frozen=True)
class _ZebraTable(Settings):
    """The table ``[arm]`` of a rig file."""

    TABLE: ClassVar[str] = "arm"

    port: str = "/dev/ttyUSB0"
    """Serial port of the bus."""
    baud: int = 115_200
    """Its rate, once the modules are awake."""
    adapter_latency_ms: Annotated[float, Range(0.0, 100.0)] = 1.0
    """Latency timer of the USB adapter."""
    divider: Annotated[int, Range(1, 14)] = 3
    """Control ticks per bus cycle."""
    at_home: bool = False
    """A person's word that the arm rests in its home pose whenever its controller was switched on."""
    counts_file: str = ""
    """Where the counters are kept from run to run; empty keeps them nowhere."""
    joint1_sign: Annotated[int, OneOf(1, -1)] = 1
    """Sense in which joint 1 counts."""
    velocity_rad_s: float = 1.0
    """Limit of each joint's velocity."""
    acceleration_rad_s2: float = 19.0
    """Limit of each joint's acceleration."""
    streaming: Annotated[str, OneOf(*(way.value for way in Streaming))] = "by firmware"
    """How setpoints are sent."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 100.0
    """Age above which a sample of the joints is marked as stale."""
    patience: Annotated[float, Range(0.1, 100.0)] = 1.0
    """Factor on the wait for an answer."""
    reset_wait_ms: Annotated[float, Range(0.0, 10_000.0)] = 100.0
    """What the modules get to wake after a reset."""


def zebra_table(settings: DeviceSettings) -> _ZebraTable:
    """The table ``[arm]`` with all that it leaves out.

    Raises:
        ConfigurationError: Something in it cannot be used.
    """
    return overlay(_ZebraTable(), settings)


def make_zebra_nmc(settings: DeviceSettings, context: RigContext) -> ArmAdapter:
    """The Zebra Zero on its own serial bus."""
    table = zebra_table(settings)
    with translating("arm"):
        arm_settings = ZebraZeroSettings(
            bus=BusSettings(
                baud=table.baud,
                adapter_latency_s=table.adapter_latency_ms * 1e-3,
                slack_s=0.02 * table.patience,
                reset_wait_s=table.reset_wait_ms * 1e-3,
            ),
            transmission=Transmission(joint_1_sign=table.joint1_sign),
            limits=JointLimits(
                velocity_rad_per_s=table.velocity_rad_s, acceleration_rad_per_s2=table.acceleration_rad_s2
            ),
            streaming=Streaming(table.streaming),
            rate_Hz=CONTROL_RATE_HZ / table.divider,
        )
    driver = ZebraDriver(
        lambda: open_port(table.port),
        arm_settings,
        context.clock,
        at_home=table.at_home,
        counts_file=Path(table.counts_file) if table.counts_file else None,
    )
    age_ns = round(table.max_age_ms * 1e6)
    arm = BusArm(
        _NAME, driver, context.clock, joints=_JOINTS, divider=table.divider, max_age_ns=age_ns, hurry=context.hurry
    )
    return ArmAdapter(arm, arm)


def open_port(name: str) -> Any:
    """Open the serial port at the rate at which the modules wake up.

    Raises:
        WiringError: It cannot be opened.
    """
    try:
        return serial.serial_for_url(name, POWER_UP_BAUD, write_timeout=1.0)
    except (serial.SerialException, OSError, ValueError) as error:
        remedy = "check the name, that it is plugged in, and that you may open it (group dialout)"
        raise WiringError(_NAME, f"{name} cannot be opened ({error})", remedy) from error
