"""Examines a rig device by device; each is closed again on every way out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar, runtime_checkable

from palpate.adapters.config import RealTimeConfig, RigFile
from palpate.adapters.hardware.arm_client import ArmClient, arm_in_process
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.doctor.facts import report_facts
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.adapters.hardware.doctor.measure import listen, report_clock, report_pace, report_wrench
from palpate.adapters.hardware.doctor.move import report_moves, report_pose
from palpate.adapters.hardware.doctor.push import Person, PushCheck
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext, arm_maker, force_sensor_maker
from palpate.adapters.hardware.sensor_facts import reported_by
from palpate.adapters.hardware.served_arm import ServedArm
from palpate.core.errors import ConfigurationError
from palpate.core.ports import ForceSensor
from palpate.drivers.errors import DriverError

T = TypeVar("T")


@runtime_checkable
class ReportsDiagnostics(Protocol):
    """A device that reports its identity, state and error counters; adapters may leave this out."""

    def diagnostics(self) -> Mapping[str, str]:
        """Return names and values; ``fault`` is what is wrong at present."""


@dataclass(frozen=True)
class ExaminationSettings:
    """What to try.

    Attributes:
        seconds: How long to listen to each device.
        person: Pushes the tool; None leaves that out.
        move: Switch the arm on and move each joint.
        before_move: Called before the first motion; refuses it by an error.
    """

    seconds: float
    person: Person | None = None
    move: bool = False
    before_move: Callable[[], object] = str


class Examination:
    """One rig.

    Raises:
        ConfigurationError: The rig file cannot be used. What only a driver refuses is a finding instead.
    """

    def __init__(self, file: RigFile, context: RigContext, settings: ExaminationSettings) -> None:
        self._file, self._context, self._settings = file, context, settings
        self._of_arm = DeviceReport(f"arm: {file.arm.adapter}")
        self._of_sensor = DeviceReport(f"force sensor: {file.force_sensor.adapter}")
        arm, sensor = arm_maker(file.arm.adapter), force_sensor_maker(file.force_sensor.adapter)
        own = replace(context, tell=lambda line: self._of_arm.add(Level.NOTE, Topic.MODEL, line))
        self._arm = _made(lambda: _ports(arm(file.arm.settings, own), file, own), self._of_arm)
        self._sensor = _made(lambda: sensor(file.force_sensor.settings, context), self._of_sensor)

    def reports(self) -> Iterator[DeviceReport]:
        """Yield what was found, device by device, as soon as each is done."""
        of_rig = DeviceReport(f"rig: {self._file.name}")
        report_clock(self._context.clock, of_rig)
        yield of_rig
        yield _examined(self._arm, self._examine_arm, self._of_arm)
        yield _examined(self._sensor, self._examine_sensor, self._of_sensor)

    def _examine_sensor(self, sensor: ForceSensor, opened: ExitStack) -> None:
        clock, report = self._context.clock, self._of_sensor
        opened.callback(sensor.close)
        sensor.configure()
        sensor.activate()
        opened.callback(_include, sensor, report)
        series = listen(sensor.read, clock, self._settings.seconds)
        reported = reported_by(sensor)
        report_pace(series, reported.rate_Hz, report)
        noise = report_wrench(series, report)
        if noise is not None:
            report_facts(self._file.facts, reported, noise, report)
        if self._settings.person is not None:
            PushCheck(sensor, clock, self._settings.person, report).run()

    def _examine_arm(self, adapter: ArmAdapter, opened: ExitStack) -> None:
        arm, encoder, report = adapter.arm, adapter.encoder, self._of_arm
        move, is_one = self._settings.move, id(arm) == id(encoder)
        devices = {id(device): device for device in (encoder, arm)}.values()
        for device in devices:
            opened.callback(device.close)
        for device in devices:
            device.configure()
        if isinstance(arm, ArmClient):
            arm.listens = True
        elif is_one and not move:
            text = "encoders and servos are one device, which gives angles only when it is switched on"
            report.add(Level.NOTE, Topic.JOINTS, text, "add --move")
            return
        encoder.activate()
        opened.callback(_include, arm, report)
        series = listen(encoder.read, self._context.clock, self._settings.seconds)
        report_pace(series, getattr(encoder, "rate_Hz", None), report)
        report_pose(series.samples[-1].position_rad, self._context.lower_rad, self._context.upper_rad, report)
        if not move:
            return
        if report.count(Level.WRONG):
            report.add(Level.NOTE, Topic.MOVE, "nothing was moved, because something is wrong", "correct that first")
            return
        self._settings.before_move()
        if isinstance(arm, ArmClient):
            arm.deactivate()
            arm.listens = False
        if isinstance(arm, ArmClient) or not is_one:
            arm.activate()
        report_moves(arm, encoder, self._context.clock, self._context.upper_rad, report)


def _ports(made: ArmAdapter | ServedArm, file: RigFile, context: RigContext) -> ArmAdapter:
    """A third-party arm in this process; one of ours in its own, as in a run."""
    if isinstance(made, ArmAdapter):
        return made
    timeout_ns, clock = round(file.watchdog.setpoint_timeout_ms * 1e6), context.clock
    if not isinstance(clock, MonotonicClock):
        raise TypeError("another process needs real time")
    of_arm = file.arm.adapter, file.arm.settings
    arm = arm_in_process(*of_arm, context, clock, real_time=RealTimeConfig(), timeout_ns=timeout_ns)
    return ArmAdapter(arm, arm)


def _examined(device: T | None, examine: Callable[[T, ExitStack], None], report: DeviceReport) -> DeviceReport:
    if device is None:
        return report
    try:
        with ExitStack() as opened:
            examine(device, opened)
    except Exception as error:
        # Whatever a device or a third-party adapter does, the others are still to be examined.
        report.error(error)
    return report


def _include(device: object, report: DeviceReport) -> None:
    if isinstance(device, ReportsDiagnostics):
        report.include(device.diagnostics())


def _made(make: Callable[[], T], report: DeviceReport) -> T | None:
    """Return the adapter; None, and a finding, where a driver refuses its settings."""
    try:
        return make()
    except ConfigurationError as error:
        if not isinstance(error.__cause__, DriverError):
            raise
        report.error(error)
    except Exception as error:
        # A third-party function may fail in any way.
        report.error(error)
    return None
