"""The driver of CiA 402 arms against emulated drives on a bus where frames take their time; in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from palpate.drivers.cia402.arm import Cia402Arm
from palpate.drivers.cia402.link import CanLink
from palpate.drivers.cia402.measured import ArmState, Measured
from palpate.drivers.cia402.object_dictionary import DriveState, OperationMode
from palpate.drivers.cia402.settings import AppliedReason, ArmSettings, JointDrive
from palpate.drivers.errors import DeviceFaultError, SilentError
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.cia402.servo import PowerState
from palpate.simulation.emulators.motors.plant import IdealPlant
from tests.virtual_lines import VirtualDesk

SCALE = 30_557.75
NODES = (1, 2, 3, 4, 5, 6)


class Cell:
    """Six drives, a bus, and the computer that runs the driver."""

    def __init__(self, desk: VirtualDesk) -> None:
        self.clock = desk.clock
        self.plant = IdealPlant()
        self.drives = [CanopenDrive(node, self.plant, axis) for axis, node in enumerate(NODES)]
        desk.can("can0", *self.drives, bit_rate_Hz=1_000_000)
        self.link = CanLink.open(interface="socketcan", channel="can0", bitrate=1_000_000)
        self.clock.sleep(0.05)

    def arm(self, mode: OperationMode = OperationMode.CSP, watchdog_ms: int = 100) -> Cia402Arm:
        joints = tuple(
            JointDrive(node=node, counts_per_rad=SCALE, lower_rad=-1.0, upper_rad=1.0, velocity_rad_per_s=1.0)
            for node in NODES
        )
        settings = ArmSettings(joints=joints, mode=mode, host_watchdog_ms=watchdog_ms)
        arm = Cia402Arm(self.link, settings, now_ns=self.clock.now_ns, sleep=self.clock.sleep)
        arm.configure()
        arm.enable()
        return arm

    def run(self, arm: Cia402Arm, setpoint: tuple[float, ...] | None, cycles: int) -> Measured:
        for _ in range(cycles):
            self.clock.sleep_until((self.clock.now_ns() * 140 // 10**9 + 1) * 10**9 // 140)
            measured = arm.cycle(setpoint)
        return measured


@pytest.fixture
def cell() -> Iterator[Cell]:
    with VirtualDesk() as desk:
        yield Cell(desk)


@pytest.mark.parametrize("mode", list(OperationMode))
def test_six_drives_move_and_stop(cell: Cell, mode: OperationMode) -> None:
    for axis in range(6):
        cell.plant.set_motor_counts(axis, 100.0 * axis)
    arm = cell.arm(mode)
    start = cell.run(arm, None, 10)
    assert start.states == (DriveState.ENABLED,) * 6
    assert start.position_rad == pytest.approx([100 * axis / SCALE for axis in range(6)], abs=1e-9)
    goal = tuple(0.05 * sign for sign in (1, -1, 1, -1, 1, -1))
    moved = cell.run(arm, goal, 60)
    assert moved.position_rad == pytest.approx(goal, abs=1e-3)
    arm.stop()
    held = cell.run(arm, (0.0,) * 6, 10)
    assert held.states == (DriveState.QUICK_STOP,) * 6
    assert held.applied is not None
    assert held.applied.reason is AppliedReason.STOPPED
    arm.close()
    assert {drive.machine.state for drive in cell.drives} == {PowerState.SWITCH_ON_DISABLED}
    figures = arm.statistics()
    assert sum(node.malformed + node.missed + node.late for node in figures.nodes) == 0
    # Eight frames there, six back, on a bus of 1 Mbit/s.
    assert 0.001 < figures.round_trip_median_s < 0.003


@pytest.mark.parametrize(
    ("provoke", "kind"),
    [
        (lambda drive: drive.fail(0x2310), DeviceFaultError),
        (lambda drive: drive.emergency(0x4210), DeviceFaultError),
        (lambda drive: drive.reset(), DeviceFaultError),
        (lambda drive: setattr(drive.faults, "silent", True), SilentError),
        (lambda drive: setattr(drive.faults, "heartbeat_stopped", True), SilentError),
    ],
    ids=["fault", "emcy", "reset", "silent", "heartbeat"],
)
def test_faults_stop_the_arm_until_acknowledged(
    cell: Cell, provoke: Callable[[CanopenDrive], None], kind: type[Exception]
) -> None:
    arm = cell.arm()
    cell.run(arm, (0.01,) * 6, 5)
    provoke(cell.drives[1])
    with pytest.raises(kind, match="drive 2"):
        cell.run(arm, (0.02,) * 6, 30)
    assert arm.state is ArmState.FAULTED
    cell.clock.sleep(0.05)
    assert PowerState.ENABLED not in {drive.machine.state for drive in cell.drives if drive is not cell.drives[1]}
    cell.drives[1].faults.silent = cell.drives[1].faults.heartbeat_stopped = False
    cell.clock.sleep(0.05)
    arm.acknowledge()
    assert arm.state is ArmState.CONFIGURED
    arm.enable()
    cell.run(arm, None, 3)
    arm.close()


def test_a_host_that_dies_leaves_an_arm_at_rest(cell: Cell) -> None:
    arm = cell.arm(OperationMode.CSV)
    cell.run(arm, (0.3,) * 6, 20)
    cell.clock.sleep(0.2)
    assert {drive.machine.state for drive in cell.drives} == {PowerState.QUICK_STOP}


def test_a_bus_that_is_closed_under_the_arm(cell: Cell) -> None:
    arm = cell.arm()
    cell.run(arm, None, 5)
    cell.link.close()
    arm.stop()
    arm.stop()
    with pytest.raises(SilentError):
        arm.cycle()
    arm.close()
    cell.clock.sleep(0.2)
    assert PowerState.ENABLED not in {drive.machine.state for drive in cell.drives}
