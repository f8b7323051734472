"""An arm of CiA 402 drives on CAN as an arm adapter: wiring and calibration.

A modern refit of an arm: nothing says that any Zebra Zero ever had such drives. Each drive turns one joint alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Final

from palpate.adapters.config.toml import overlay
from palpate.adapters.hardware.arm_on_bus import ArmDriver, BusArm, BusCycle
from palpate.adapters.hardware.errors import translating
from palpate.adapters.hardware.plugins import ArmAdapter, DeviceSettings, RigContext
from palpate.core.errors import ConfigurationError
from palpate.core.ports.devices import Clock
from palpate.core.ports.settings import OneOf, Range, Settings
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, CommandReason, JointVector
from palpate.drivers.cia402.arm import Cia402Arm
from palpate.drivers.cia402.link import CanLink
from palpate.drivers.cia402.object_dictionary import OperationMode
from palpate.drivers.cia402.settings import ArmSettings, JointDrive
from palpate.drivers.errors import StateError

_NAME: Final = "CiA 402 arm"


class Cia402Driver(ArmDriver):
    """The driver behind the adapter.

    Args:
        open_link: Opens the bus.
        settings: The arm's settings.
        clock: The run's clock.

    Attributes:
        arm: The driver proper; None before ``open``. For ``palpate doctor``.
    """

    def __init__(self, open_link: Callable[[], CanLink], settings: ArmSettings, clock: Clock) -> None:
        self._open_link, self._settings, self._clock = open_link, settings, clock
        self._link: CanLink | None = None
        self.arm: Cia402Arm | None = None

    def open(self) -> None:
        """Open the bus and set up the drives; nothing gets power."""
        self._link = self._open_link()
        self.arm = Cia402Arm(self._link, self._settings, now_ns=self._clock.now_ns, sleep=self._sleep)
        self.arm.configure()

    def enable(self) -> None:
        """See :class:`ArmDriver`."""
        self._require().enable()

    def preview(self, asked_rad: JointVector) -> AppliedCommand:
        """See :class:`ArmDriver`."""
        applied = self._require().limited(asked_rad)
        return AppliedCommand(applied.position_rad, CommandReason[applied.reason.name])

    def cycle(self, setpoint_rad: JointVector | None) -> BusCycle:
        """See :class:`ArmDriver`."""
        measured = self._require().cycle(setpoint_rad)
        return BusCycle(measured.position_rad, measured.sync_ns)

    def stop(self) -> None:
        """See :class:`ArmDriver`."""
        if self.arm is not None:
            self.arm.stop()

    def disable(self) -> None:
        """Takes the power away; the brakes hold the arm."""
        self._require().disable()

    def acknowledge(self) -> None:
        """See :class:`ArmDriver`."""
        self._require().acknowledge()

    def close(self) -> None:
        """See :class:`ArmDriver`."""
        arm, link = self.arm, self._link
        self.arm = self._link = None
        if arm is not None:
            arm.close()
        if link is not None:
            link.close()

    def _require(self) -> Cia402Arm:
        if self.arm is None:
            raise StateError(_NAME, "is not open", "configure it first")
        return self.arm

    def _sleep(self, seconds: float) -> None:
        self._clock.sleep_until(self._clock.now_ns() + round(seconds * 1e9))


@dataclass(frozen=True)
class _Cia402Table(Settings):
    """The table ``[arm]`` of a rig file. Vectors have one number a joint."""

    TABLE: ClassVar[str] = "arm"

    interface: str = "socketcan"
    """Kind of CAN interface, as python-can calls it."""
    channel: str = "can0"
    """Its name."""
    bitrate: int = 1_000_000
    """Bits a second."""
    nodes: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    """CANopen node of each joint's drive."""
    counts_per_rad: tuple[float, ...] = ()
    """Encoder counts per radian of each joint."""
    zero_counts: tuple[int, ...] = ()
    """Encoder counts at each joint's zero; none are zeros."""
    mode: Annotated[str, OneOf("position", "velocity")] = "position"
    """What setpoints are sent."""
    divider: Annotated[int, Range(1, 14)] = 1
    """Control ticks per bus cycle."""
    max_age_ms: Annotated[float, Range(1.0, 10_000.0)] = 50.0
    """Age above which a sample of the joints is marked as stale."""
    patience: Annotated[float, Range(0.1, 100.0)] = 1.0
    """Factor on every time-out, for machines that cannot keep time."""


def cia402_table(settings: DeviceSettings) -> _Cia402Table:
    """The table ``[arm]`` with all that it leaves out.

    Raises:
        ConfigurationError: Something in it cannot be used.
    """
    return overlay(_Cia402Table(), settings)


def make_cia402(settings: DeviceSettings, context: RigContext) -> ArmAdapter:
    """An arm of CiA 402 drives."""
    joints = len(context.lower_rad)
    table = cia402_table(settings)
    zeros = table.zero_counts or (0,) * joints
    for name, vector in (("nodes", table.nodes), ("counts_per_rad", table.counts_per_rad), ("zero_counts", zeros)):
        if len(vector) != joints:
            raise ConfigurationError(f"arm.{name}", vector, f"{joints} numbers, one a joint of {context.arm.name}")
    with translating("arm"):
        drives = tuple(
            JointDrive(
                node=node, counts_per_rad=scale, lower_rad=lower, upper_rad=upper, velocity_rad_per_s=speed,
                zero_counts=zero,
            )
            for node, scale, zero, lower, upper, speed in zip(
                table.nodes, table.counts_per_rad, zeros, context.lower_rad, context.upper_rad,
                context.velocity_limit_rad_s, strict=True,
            )
        )  # fmt: skip
        arm_settings = ArmSettings(
            joints=drives,
            mode=OperationMode.CSP if table.mode == "position" else OperationMode.CSV,
            bitrate=table.bitrate,
            rate_Hz=Fraction(CONTROL_RATE_HZ, table.divider),
            missed_cycles=max(1, round(3 * table.patience)),
            heartbeat_timeout_ms=round(150 * table.patience),
            host_watchdog_ms=round(100 * table.patience),
            sdo_timeout_s=0.3 * table.patience,
            transition_timeout_s=2.0 * table.patience,
        )
    extra: dict[str, Any] = {"sleep_after_open": 0.1} if table.interface == "slcan" else {}

    def open_link() -> CanLink:
        return CanLink.open(
            interface=table.interface,
            channel=table.channel,
            bitrate=table.bitrate,
            in_receiver=context.hurry,
            **extra,
        )

    driver = Cia402Driver(open_link, arm_settings, context.clock)
    age_ns = round(table.max_age_ms * 1e6)
    arm = BusArm(
        _NAME, driver, context.clock, joints=joints, divider=table.divider, max_age_ns=age_ns, hurry=context.hurry
    )
    return ArmAdapter(arm, arm)
