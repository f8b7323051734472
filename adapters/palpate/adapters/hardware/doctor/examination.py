"""The examination of a rig: one device after the other, each opened and closed again, whatever becomes of it."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TypeVar

from palpate.adapters.config import DeviceEntry, RigFile
from palpate.adapters.hardware.arm_on_bus import BusArm
from palpate.adapters.hardware.ati import NetFtForceSensor
from palpate.adapters.hardware.doctor.cia402 import examine_cia402
from palpate.adapters.hardware.doctor.facts import judge_facts
from palpate.adapters.hardware.doctor.findings import FindingsSection, Notebook, driver_error
from palpate.adapters.hardware.doctor.force_sensors import examine_jr3, examine_netft, examine_tool_force
from palpate.adapters.hardware.doctor.pace import examine_clock
from palpate.adapters.hardware.doctor.ports import examine_encoder, examine_following, examine_force_sensor
from palpate.adapters.hardware.doctor.push import Person, PushCheck
from palpate.adapters.hardware.doctor.system import System
from palpate.adapters.hardware.doctor.ur import examine_ur
from palpate.adapters.hardware.doctor.wiring import Wiring, examine_sharing, wiring_of
from palpate.adapters.hardware.doctor.zebra import examine_zebra, tell_modules
from palpate.adapters.hardware.jr3 import Jr3ForceSensor
from palpate.adapters.hardware.plugins import ArmAdapter, RigContext, arm_maker, force_sensor_maker
from palpate.adapters.hardware.sensor_facts import reported_by
from palpate.adapters.hardware.ur import UrToolForceSensor
from palpate.core.errors import ConfigurationError
from palpate.core.ports import ForceSensor
from palpate.drivers.cia402 import Cia402Arm
from palpate.drivers.errors import DriverError, GarbledError, WiringError
from palpate.drivers.jr3 import LEFT_HANDED
from palpate.drivers.ur import UrArm
from palpate.drivers.zebra_zero import ZebraZero

T = TypeVar("T")


@dataclass(frozen=True)
class Wishes:
    """What to try.

    Attributes:
        person: Who pushes the tool; None leaves that out.
        before_move: Is called before the first motion, and refuses it by an error.
    """

    seconds: float
    person: Person | None
    move: bool
    before_move: Callable[[], object] = str


class Examination:
    """One rig.

    Args:
        system: The operating system's side.

    Raises:
        ConfigurationError: The rig file cannot be used. What only a driver refuses is a finding instead.
    """

    def __init__(self, file: RigFile, context: RigContext, wishes: Wishes, system: System) -> None:
        self._file, self._context, self._wishes, self._system = file, context, wishes, system
        self._wirings = wiring_of(file.arm), wiring_of(file.force_sensor)
        self._arm_notes = Notebook(f"arm: {file.arm.adapter}")
        self._sensor_notes = Notebook(f"force sensor: {file.force_sensor.adapter}")
        arm, sensor = arm_maker(file.arm.adapter), force_sensor_maker(file.force_sensor.adapter)
        self._arm = _made(lambda: arm(file.arm.settings, context), self._arm_notes)
        self._sensor = _made(lambda: sensor(file.force_sensor.settings, context), self._sensor_notes)

    def sections(self) -> Iterator[FindingsSection]:
        """What was found, device by device, as soon as each is done."""
        notes = Notebook(f"rig: {self._file.name}")
        examine_clock(self._context.clock, notes)
        examine_sharing(*self._wirings, notes)
        yield notes.section()
        yield self._examined(self._file.arm, self._wirings[0], self._arm, self._examine_arm, self._arm_notes)
        entry, wiring = self._file.force_sensor, self._wirings[1]
        yield self._examined(entry, wiring, self._sensor, self._examine_sensor, self._sensor_notes)

    def _examined(
        self, entry: DeviceEntry, wiring: Wiring, device: T | None, examine: Callable[[T, ExitStack], None],
        notes: Notebook,
    ) -> FindingsSection:  # fmt: skip
        notes.fact("adapter", entry.adapter)
        notes.fact("wire", wiring.told)
        if self._system.examine(wiring, notes) and device is not None:
            errors = self._system.errors_of(wiring)
            try:
                with ExitStack() as opened:
                    examine(device, opened)
            except Exception as error:
                # Whatever a device or a stranger's adapter does, the others are still to be examined.
                notes.error(error)
                if isinstance(driver_error(error), (WiringError, GarbledError)):
                    self._system.suspect_another_device(wiring, notes)
            self._system.examine_after(wiring, errors, notes)
        return notes.section()

    def _examine_sensor(self, sensor: ForceSensor, opened: ExitStack) -> None:
        clock, wishes, notes = self._context.clock, self._wishes, self._sensor_notes
        opened.callback(sensor.close)
        sensor.configure()
        sensor.activate()
        mend_axes = "mirror one axis of forces and torques in the adapter"
        if isinstance(sensor, Jr3ForceSensor):
            measured = examine_jr3(sensor, clock, wishes.seconds, notes)
            other = "right-handed" if sensor.settings.signs == LEFT_HANDED else "left-handed"
            mend_axes = f'[force_sensor] axes = "{other}"'
        elif isinstance(sensor, NetFtForceSensor):
            measured = examine_netft(sensor, clock, wishes.seconds, notes)
        elif isinstance(sensor, UrToolForceSensor):
            measured = examine_tool_force(sensor, clock, wishes.seconds, notes)
        else:
            measured = examine_force_sensor(sensor, clock, wishes.seconds, notes)
        judge_facts(self._file.facts, reported_by(sensor), measured, notes)
        if wishes.person is not None:
            PushCheck(sensor, clock, wishes.person, notes, mend_axes).run()

    def _examine_arm(self, adapter: ArmAdapter, opened: ExitStack) -> None:
        clock, seconds, notes = self._context.clock, self._wishes.seconds, self._arm_notes
        arm, encoder = adapter.arm, adapter.encoder
        for device in {id(d): d for d in (encoder, arm)}.values():
            opened.callback(device.close)
        # A bus can be examined while no thread cycles it, which is before anything gets power.
        driver = arm.connect() if isinstance(arm, BusArm) else None
        if isinstance(driver, ZebraZero):
            # Who the modules are can be told even where nobody knows where the arm is.
            driver.connect()
            tell_modules(driver, notes)
            arm.configure()
            examine_zebra(driver, clock, seconds, notes)
        elif isinstance(driver, Cia402Arm):
            arm.configure()
            examine_cia402(driver, clock, seconds, notes)
        elif isinstance(driver, UrArm):
            arm.configure()
            examine_ur(driver, self._context, seconds, notes)
        else:
            self._examine_strange_arm(adapter)
        if not self._wishes.move:
            notes.ok("nothing was switched on, nothing moved; --move tries that")
        elif notes.wrongs:
            notes.note("nothing was moved, because something is wrong", "mend that first")
        else:
            self._move(adapter)

    def _examine_strange_arm(self, adapter: ArmAdapter) -> None:
        context, notes = self._context, self._arm_notes
        arm, encoder = adapter.arm, adapter.encoder
        # By number: the two ports have nothing in common that their types would tell.
        apart = id(arm) != id(encoder)
        encoder.configure()
        if apart:
            arm.configure()
        notes.ok("the adapter opens its device")
        if not apart and not self._wishes.move:
            notes.note("encoders and servos are one device: joint angles are read only when it is active, with --move")
            return
        encoder.activate()
        if self._wishes.move and apart:
            arm.activate()
        examine_encoder(encoder, context.clock, self._wishes.seconds, context.lower_rad, context.upper_rad, notes)

    def _move(self, adapter: ArmAdapter) -> None:
        arm, encoder = adapter.arm, adapter.encoder
        if isinstance(arm, BusArm):
            arm.activate()
        self._wishes.before_move()
        examine_following(arm, encoder, self._context.clock, self._context.upper_rad, self._arm_notes)
        if isinstance(arm, BusArm) and isinstance(arm.connect(), ZebraZero):
            self._arm_notes.note("its servos go on holding the arm", "switch the controller off to release it")


def _made(make: Callable[[], T], notes: Notebook) -> T | None:
    """The adapter; None, and a finding, where a driver says that it cannot work like that."""
    try:
        return make()
    except ConfigurationError as error:
        if not isinstance(error.__cause__, DriverError):
            raise
        notes.error(error)
    except Exception as error:
        # A stranger's function may fail in any way.
        notes.error(error)
    return None
