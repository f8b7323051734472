"""Adapters for a Universal Robots arm and the force sensor in its flange: connection and sample validity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final

from typing_extensions import override

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.clock import sleeping
from palpate.adapters.hardware.errors import translating
from palpate.adapters.hardware.kinematics_check import ReportedPose, judge_kinematics, judge_tool
from palpate.adapters.hardware.plugins import Host, RigContext
from palpate.adapters.hardware.polled_sensor import PolledForceSensor, SensorTable
from palpate.adapters.hardware.served_arm import ArmTable, DriverArm, OpenArm
from palpate.core.errors import ConfigurationError
from palpate.core.ports import CONTROL_RATE_HZ, Clock, OneOf, Range, Settings
from palpate.drivers.device import ArmDriver
from palpate.drivers.ur import RANGE_N, RANGE_NM, UrArm, UrLink, UrSettings, UrToolForce

_NAME: Final = "Universal Robots arm"
_TOOL: Final = "Universal Robots tool force"
_JOINTS: Final = 6
_OPEN_S: Final = 3.0


@dataclass(frozen=True)
class UrController(Settings):
    """Settings shared by an arm and the sensor in its flange."""

    host: Host = "192.168.1.100"
    """Address of the controller."""
    rate_Hz: Annotated[float, OneOf(125.0, 250.0, 500.0)] = 500.0
    """Rate of the sensor data."""


@dataclass(frozen=True)
class UrTable(UrController, ArmTable):
    """The ``[arm]`` table of a rig file."""

    force_stop_N: Annotated[float, Range(0.0, 500.0)] = UrSettings.force_stop_N
    """Tool force change at which the arm stops, even with a different sensor; 0 disables the check."""
    lookahead_s: Annotated[float, Range(0.03, 0.2)] = UrSettings.lookahead_s
    """Look-ahead time for servoj. It smooths the motion but delays the arm."""
    gain: Annotated[float, Range(100.0, 2000.0)] = UrSettings.gain
    """Gain for servoj."""


@dataclass(frozen=True)
class UrToolTable(UrController, SensorTable):
    """The ``[force_sensor]`` table of a rig file."""


def make_ur_rtde(table: UrTable, context: RigContext, link: Callable[[], UrLink] | None = None) -> DriverArm:
    """Return a Universal Robots arm over RTDE, with the ur_rtde client or over a given link."""
    reach = link or partial(UrLink, table.host, table.rate_Hz, context.set_priority, context.real_time_factor)
    if len(context.lower_rad) != _JOINTS:
        raise ConfigurationError("arm", context.arm.name, f"an arm of {_JOINTS} joints; {_NAME} has no other")
    with translating("arm"):
        arm_settings = UrSettings(
            lower_rad=context.lower_rad, upper_rad=context.upper_rad, velocity_rad_s=context.velocity_limit_rad_s,
            period_s=table.divider / CONTROL_RATE_HZ, lookahead_s=table.lookahead_s, gain=table.gain,
            force_stop_N=table.force_stop_N, silence_s=UrSettings.silence_s * table.timeout_scale,
            watchdog_s=UrSettings.watchdog_s * table.timeout_scale,
        )  # fmt: skip

    def open_bus() -> OpenArm:
        opened, clock = reach(), context.clock
        return OpenArm(UrArm(opened, arm_settings, now_ns=clock.now_ns, sleep=sleeping(clock)), opened.close)

    return DriverArm(_NAME, open_bus, context.clock, context.limiter, table, lambda driver: judged(driver, context))


def judged(driver: ArmDriver, context: RigContext) -> list[str]:
    """Return lines that report how well the model and the tool agree with an open arm.

    Raises:
        ConfigurationError: The model or the tool disagrees with the arm.
    """
    if not isinstance(driver, UrArm) or (seen := driver.seen) is None:
        return []
    found = ReportedPose(seen.q_rad, seen.tcp_pose, driver.tcp_offset, seen.payload_kg, seen.payload_cog_m)
    lines = [judge_kinematics(context, found)]
    return lines if context.tool is None else [*lines, judge_tool(context, context.tool, found)]


class UrToolForceSensor(PolledForceSensor[UrToolForce]):
    """The force sensor in the flange of an e-Series arm."""

    REMEDY = "check that the controller is switched on, and that no firewall blocks port 30004"

    def __init__(self, link: Callable[[], UrLink], clock: Clock, table: UrToolTable) -> None:
        super().__init__(_TOOL, clock, table)
        self._link, self._rate_Hz = link, table.rate_Hz
        self._opened: UrLink | None = None

    @property
    @override
    def period_ns(self) -> int:
        return round(1e9 / self._rate_Hz)

    def reported_facts(self) -> SensorFactsTable:
        """Return the rate, and the rated ranges from the data sheet."""
        return SensorFactsTable(range_N=RANGE_N, range_Nm=RANGE_NM, rate_Hz=self._rate_Hz, frame="sensor")

    def _connect(self) -> None:
        opened = self._opened = self._link()
        self._close_wire = opened.close
        opened.open(_OPEN_S)
        self.device = UrToolForce(opened)

    def _on_acknowledge(self) -> None:
        super()._on_acknowledge()
        if self._opened is not None:
            with translating(self.name):
                self._opened.open(_OPEN_S)


def make_ur_tool_force(table: UrToolTable, context: RigContext) -> UrToolForceSensor:
    """Return the force sensor in the flange of an e-Series arm."""
    link = partial(UrLink, table.host, table.rate_Hz, context.set_priority, context.real_time_factor)
    return UrToolForceSensor(link, context.clock, table)
