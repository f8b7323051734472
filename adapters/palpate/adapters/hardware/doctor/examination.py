"""Device-by-device checks of a rig. Each device is always closed afterwards."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import TypeVar

from palpate.adapters.config import DeviceEntry, RealTimeConfig, RigFile
from palpate.adapters.hardware.adapter_arm import served
from palpate.adapters.hardware.arm_client import ArmClient, arm_in_process
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.adapters.hardware.doctor.measure import (
    listen,
    report_clock,
    report_facts,
    report_pace,
    report_samples,
    report_wrench,
)
from palpate.adapters.hardware.doctor.move import report_moves, report_pose
from palpate.adapters.hardware.doctor.push import Person, PushCheck
from palpate.adapters.hardware.plugins import RigContext, arm_maker, force_sensor_maker
from palpate.adapters.hardware.sensor_facts import reported_by
from palpate.core.errors import ConfigurationError
from palpate.core.ports import SENSOR_FRAME, ForceSensor
from palpate.core.supervision import SupervisionConfig, least_rate_Hz
from palpate.drivers.errors import DriverError

T = TypeVar("T")


class Examination:
    """A check on one rig.

    Args:
        seconds: Measurement time per device.
        person: Person who pushes the tool; None skips this check.
        move: True to move the joints.
        before_move: Function called before the first motion, which it can prevent by raising an error.

    Raises:
        ConfigurationError: The rig file cannot be used. Settings that only a driver rejects are findings instead.
    """

    def __init__(
        self,
        file: RigFile,
        context: RigContext,
        seconds: float,
        person: Person | None = None,
        *,
        move: bool = False,
        before_move: Callable[[], object] = str,
    ) -> None:
        self._file, self._context, self._seconds = file, context, seconds
        self._person, self._move, self._before_move = person, move, before_move
        self._of_arm = DeviceReport(f"arm: {file.arm.adapter}")
        self._of_sensor = DeviceReport(f"force sensor: {file.force_sensor.adapter}")
        own = replace(context, notify=lambda line: self._of_arm.add(Level.NOTE, Topic.MODEL, line))
        timeout_ns, sensor = file.watchdog.timeout_ns, force_sensor_maker(file.force_sensor.adapter)
        self._arm = _made(lambda: arm_in_process(file.arm, own, RealTimeConfig(), timeout_ns), self._of_arm)
        self._sensor = _made(lambda: sensor(file.force_sensor.settings, context), self._of_sensor)

    def reports(self) -> Iterator[DeviceReport]:
        """Yield each device's report as soon as its check is complete."""
        of_rig = DeviceReport(f"rig: {self._file.name}")
        report_clock(self._context.clock, of_rig)
        yield of_rig
        _examined(self._arm, self._examine_arm, self._of_arm)
        stated = self._file.arm.settings.get("stops_without_commands", False)
        if stated and self._move and not self._of_arm.count(Level.WRONG):
            _examined(self._file.arm, self._await_stop, self._of_arm)
        yield self._of_arm
        yield _examined(self._sensor, self._examine_sensor, self._of_sensor)

    def _examine_sensor(self, sensor: ForceSensor, opened: ExitStack) -> None:
        clock, report = self._context.clock, self._of_sensor
        opened.callback(sensor.close)
        sensor.configure()
        sensor.activate()
        # Adapters may lack diagnostics.
        opened.callback(lambda: report.include(getattr(sensor, "diagnostics", dict)()))
        series = listen(sensor.read, clock, self._seconds)
        reported = reported_by(sensor)
        report_pace(series, reported.rate_Hz, report, least_rate_Hz(SupervisionConfig()))
        noise = report_wrench(series, report)
        if noise is not None:
            report_facts(self._file.facts, reported, noise, report)
        report_samples(series, report, noise, self._file.facts.frame or reported.frame or SENSOR_FRAME)
        if self._person is not None:
            PushCheck(sensor, clock, self._person, report).run()

    def _examine_arm(self, arm: ArmClient, opened: ExitStack) -> None:
        clock, report, move = self._context.clock, self._of_arm, self._move
        opened.callback(arm.close)
        arm.configure()
        if not arm.listens_unpowered and not move:
            text = "encoders and servos are one device, which gives angles only when it is switched on"
            report.add(Level.NOTE, Topic.JOINTS, text, "add --move")
            return
        arm.listens = True
        arm.activate()
        opened.callback(lambda: report.include(arm.diagnostics()))
        series = listen(arm.read, clock, self._seconds)
        report_pace(series, arm.rate_Hz, report)
        report_samples(series, report)
        report_pose(series.samples[-1].position_rad, self._context.lower_rad, self._context.upper_rad, report)
        if not move:
            return
        if report.count(Level.WRONG):
            report.add(Level.NOTE, Topic.MOVE, "nothing was moved because of the problems above", "correct that first")
            return
        self._before_move()
        arm.deactivate()
        arm.listens = False
        arm.activate()
        report_moves(arm, arm, clock, self._context.upper_rad, report)

    def _await_stop(self, entry: DeviceEntry, opened: ExitStack) -> None:
        """Check that the robot stops by itself, as its settings claim, when no process stops it."""
        arm = served(arm_maker(entry.adapter)(entry.settings, self._context), self._context)
        opened.callback(arm.close)
        arm.open()
        arm.enable()
        stood_s = arm.run_out()
        text = "moved on for 1 s after the last command and was then stopped"
        if stood_s is not None:
            text = f"stationary {stood_s * 1e3:.0f} ms after the last command"
        remedy = 'stops_without_commands = true is wrong: remove it and use mode = "positions"'
        self._of_arm.judge(Topic.MOVE, stood_s is not None, text, remedy)


def _examined(device: T | None, examine: Callable[[T, ExitStack], None], report: DeviceReport) -> DeviceReport:
    if device is not None:
        try:
            with ExitStack() as opened:
                examine(device, opened)
        except Exception as error:
            # After any error of a device or a third-party adapter, the others must still be examined.
            report.error(error)
    return report


def _made(make: Callable[[], T], report: DeviceReport) -> T | None:
    """Return the adapter. If a driver rejects its settings, add a finding and return None."""
    try:
        return make()
    except ConfigurationError as error:
        if not isinstance(error.__cause__, DriverError):
            raise
        report.error(error)
    return None
