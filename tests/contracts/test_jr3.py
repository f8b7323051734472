"""The JR3 adapter keeps the contract of a force sensor, over CAN, against a board in virtual time."""

import pytest

from palpate.adapters.contracts import ForceSensorContract, ForceSensorRig
from palpate.adapters.hardware.plugins import RigContext, force_sensor_maker
from palpate.core.motion.arm import arm_named
from palpate.core.ports import Validity
from palpate.simulation.emulators.jr3 import Jr3CanNode
from tests.virtual_lines import Cable, VirtualDesk

TICK_NS = 10**9 // 140
MAX_AGE_MS = 200.0
BOOT_NS = 1_000_000


def context(clock):
    return RigContext(clock, arm_named("zebra-zero"), (), (), ())


class Load:
    """What presses on the emulated sensor."""

    def __init__(self):
        self.wrench = (0.0,) * 6

    def __call__(self, now_ns):
        return self.wrench

    def push_N(self, fx, fy, fz):
        self.wrench = (fx, fy, fz, 0.0, 0.0, 0.0)


def rig(desk, wire, sensor, load, firmware):
    # It cannot tell a cable that is cut from silence, and bears that for ten times as long as a sample may be old.
    cable = Cable(desk.clock, wire, 0.011 * MAX_AGE_MS)

    def fall_silent():
        firmware.silent = True

    return ForceSensorRig(
        device=sensor,
        clock=desk.clock,
        advance=lambda ticks: desk.clock.sleep(ticks / 140),
        max_age_ns=round(MAX_AGE_MS * 1e6) + TICK_NS,
        push_N=load.push_N,
        load_N=20.0,
        tolerance_N=0.05,
        settle_ticks=14,
        go_silent=fall_silent,
        is_open=lambda: sensor.device is not None,
        provoke_fault=lambda: sensor._latch("fault on demand"),
        disconnect=cable.cut,
        reconnect=cable.join,
        dispose=desk.close,
        runs_by_itself=True,
    )


def can_rig():
    load, desk = Load(), VirtualDesk()
    node = Jr3CanNode(1, load, BOOT_NS)
    bus = desk.can("can0", node)
    settings = {"interface": "virtual", "channel": "can0", "max_age_ms": MAX_AGE_MS, "period_us": 2000}
    return rig(desk, bus, force_sensor_maker("jr3-can")(settings, context(desk.clock)), load, node.firmware)


class TestJr3Can(ForceSensorContract):
    def make(self):
        return can_rig()


def test_after_a_long_pause_a_living_sensor_gives_what_it_feels_now():
    made = can_rig()
    try:
        with made.device as sensor:
            before = sensor.read()
            made.clock.sleep_until(made.clock.now_ns() + round(1.5e6 * MAX_AGE_MS))
            made.push_N(0.0, 0.0, made.load_N)
            made.advance(made.settle_ticks)
            after = sensor.read()
            assert after.validity is Validity.VALID
            assert after.sequence > before.sequence
            assert abs(after.force_N[2] - before.force_N[2]) == pytest.approx(made.load_N, abs=2 * made.tolerance_N)
    finally:
        made.dispose()
