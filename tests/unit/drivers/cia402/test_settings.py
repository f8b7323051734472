from dataclasses import replace
from math import nan
from typing import Any

import pytest

from palpate.core.ports.values import CommandReason
from palpate.drivers.can.identifiers import collisions
from palpate.drivers.cia402.settings import ArmSettings, JointDrive, bits_per_cycle, bus_budget
from palpate.drivers.device import AppliedReason
from palpate.drivers.errors import SettingError
from tests.support.cia402_bench import joints


def test_the_budget_of_six_drives() -> None:
    assert bits_per_cycle(6) == 6 * (115 + 125) + 55
    assert bits_per_cycle(6, stuffed=False) == 6 * (95 + 103) + 47
    budget = bus_budget(6, 1_000_000, 0.05)
    # 80 % of the bus, less seven heartbeats of 65 bits twenty times a second.
    assert budget.max_rate_Hz == pytest.approx((800_000 - 7 * 65 * 20) / 1495)
    budget.require(140, 1)


def test_a_rate_that_does_not_fit_is_refused_with_the_numbers() -> None:
    with pytest.raises(SettingError, match=r"1495 bits.*125000 bit/s, so 60\.8 Hz at most.*140 Hz: 46\.67, 35"):
        bus_budget(6, 125_000, 0.05).require(140, 1)
    bus_budget(6, 125_000, 0.05).require(140, 3)
    with pytest.raises(SettingError, match="none"):
        bus_budget(6, 10_000, 0.05).require(140, 14)


@pytest.mark.parametrize(("rate_Hz", "divider"), [(140, 0), (0, 1), (-140, 1), (nan, 1)])
def test_what_is_no_rate_is_refused(rate_Hz: float, divider: int) -> None:
    with pytest.raises(SettingError, match="no rate of cycles"):
        bus_budget(6, 1_000_000, 0.05).require(rate_Hz, divider)


def test_a_sensor_on_a_node_of_a_drive_is_refused() -> None:
    found = {c.identifier: (c.canopen, c.jr3) for c in collisions([3], 3)}
    assert found[0x183] == ("TPDO1 of node 3", "START_SYNC")
    assert found[0x203] == ("RPDO1 of node 3", "START_ASYNC")
    assert found[0x583] == ("SDO answer of node 3", "RESET")
    assert found[0x603] == ("SDO request of node 3", "FORCES")
    assert found[0x703] == ("heartbeat of node 3", "BOOTUP")
    assert 0x083 not in found  # the sensor's SYNC has no node number, so EMCY is free


def test_counts_and_angles() -> None:
    joint = JointDrive(
        node=1, counts_per_rad=-1000.0, lower_rad=-1.0, upper_rad=2.0, velocity_rad_per_s=1.0, zero_counts=50
    )
    assert joint.counts(0.1) == -50
    assert joint.angle_rad(-50) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "wrong",
    [
        {"node": 0},
        {"node": 128},
        {"counts_per_rad": 0.0},
        {"counts_per_rad": nan},
        {"lower_rad": 2.0},
        {"lower_rad": nan},
        {"velocity_rad_per_s": 0.0},
        {"zero_counts": 2**31},
        {"counts_per_rad": 1e10},
    ],
)
def test_a_joint_that_cannot_work_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(SettingError):
        replace(joints()[0], **wrong)


@pytest.mark.parametrize(
    "wrong",
    [
        {"joints": ()},
        {"joints": joints() + joints()},
        {"host_node": 3},
        {"host_node": 200},
        {"bitrate": 0},
        {"bitrate": 125_000},
        {"answer_share": 0.0},
        {"csv_gain": 1.5},
        {"velocity_margin": 0.5},
        {"pose_margin_rad": nan},
        {"heartbeat_timeout_ms": 40},
        {"heartbeat_ms": 0},
        {"missed_cycles": 0},
        {"host_watchdog_ms": 10},
        {"host_watchdog_ms": -1},
        {"quick_stop_rad_per_s2": nan},
    ],
)
def test_an_arm_that_cannot_work_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(SettingError):
        ArmSettings(**({"joints": joints(), "control_rate_Hz": 140} | wrong))


def test_the_reasons_are_those_of_the_core() -> None:
    assert [r.name for r in AppliedReason] == [r.name for r in CommandReason]
