"""The driver of CiA 402 arms against emulated drives on a bus where frames take their time; in virtual time.

Its faults are tried without a bus between, in tests/unit/drivers/cia402/test_arm_latches.py.
"""

import pytest

from palpate.drivers.arm import AppliedReason
from palpate.drivers.cia402.arm import Cia402Arm, DrivesMeasured
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.cia402.object_dictionary import DriveState, OperationMode
from palpate.drivers.cia402.settings import ArmSettings, JointDrive
from palpate.simulation.emulators.cia402.node import CanopenDrive
from palpate.simulation.emulators.cia402.servo import PowerState
from palpate.simulation.emulators.motors.plant import IdealPlant
from tests.virtual_lines import VirtualDesk

SCALE = 30_557.75
NODES = (1, 2, 3, 4, 5, 6)


@pytest.mark.parametrize("mode", list(OperationMode))
def test_six_drives_move_and_stop(mode: OperationMode) -> None:
    with VirtualDesk() as desk:
        move_and_stop(desk, mode)


def move_and_stop(desk: VirtualDesk, mode: OperationMode) -> None:
    clock, plant = desk.clock, IdealPlant()
    drives = [CanopenDrive(node, plant, axis) for axis, node in enumerate(NODES)]
    desk.can("can0", *drives, bit_rate_Hz=1_000_000)
    link = CanopenLink.open(interface="socketcan", channel="can0", bitrate=1_000_000)
    clock.sleep(0.05)
    joints = tuple(
        JointDrive(node=node, counts_per_rad=SCALE, lower_rad=-1.0, upper_rad=1.0, velocity_rad_per_s=1.0)
        for node in NODES
    )
    arm = Cia402Arm(
        link, ArmSettings(joints=joints, control_rate_Hz=140, mode=mode), now_ns=clock.now_ns, sleep=clock.sleep
    )

    def run(setpoint: tuple[float, ...] | None, cycles: int) -> DrivesMeasured:
        for _ in range(cycles):
            clock.sleep_until((clock.now_ns() * 140 // 10**9 + 1) * 10**9 // 140)
            measured = arm.cycle(setpoint)
        return measured

    for axis in range(6):
        plant.set_motor_counts(axis, 100.0 * axis)
    arm.open()
    arm.enable()
    start = run(None, 10)
    assert start.states == (DriveState.ENABLED,) * 6
    assert start.position_rad == pytest.approx([100 * axis / SCALE for axis in range(6)], abs=1e-9)
    goal = tuple(0.05 * sign for sign in (1, -1, 1, -1, 1, -1))
    moved = run(goal, 60)
    assert moved.position_rad == pytest.approx(goal, abs=1e-3)
    arm.stop()
    held = run((0.0,) * 6, 10)
    assert held.states == (DriveState.QUICK_STOP,) * 6
    assert held.applied is not None
    assert held.applied.reason is AppliedReason.STOPPED
    arm.close()
    assert {drive.machine.state for drive in drives} == {PowerState.SWITCH_ON_DISABLED}
    figures = arm.statistics()
    assert sum(node.malformed + node.missed + node.late for node in figures.nodes) == 0
    # Eight frames there, six back, on a bus of 1 Mbit/s.
    assert 0.001 < figures.round_trip_median_s < 0.003
