"""The CiA 402 arm on its bus: golden frames, statuswords, what the receive thread leaves, speeds, settings."""

from dataclasses import replace

import can
import pytest

from palpate.drivers.cia402 import ArmSettings, CanopenLink, DriveState, JointDrive
from palpate.drivers.cia402.codec import PATTERNS, state_of
from palpate.drivers.cia402.mailbox import Mailbox
from palpate.drivers.errors import DeviceFaultError, SettingError, SilentError
from tests.support import cia402_vectors as golden
from tests.support.cia402_bench import Bench, joints
from tests.wall_clock.late import wait_for

BUS = {"interface": "virtual", "bitrate": 1_000_000}
SYNC = 0x080


def sdo_of(bench):
    return [data.hex().upper() for can_id, data in bench.network.sent if can_id == 0x601]


def test_set_up_is_the_golden_one():
    bench = Bench()
    bench.arm.open()
    assert sdo_of(bench) == [*golden.IDENTIFY, *golden.SET_UP]
    nmt = [data.hex() for can_id, data in bench.network.sent if can_id == 0]
    assert nmt == [f"80{node:02x}" for node in range(1, 7)] + [f"01{node:02x}" for node in range(1, 7)]


def test_watchdog_is_armed_before_power_and_fed_by_the_cycle():
    bench = Bench()
    bench.arm.open()
    bench.network.sent.clear()
    bench.arm.enable()
    assert sdo_of(bench) == list(golden.WATCHDOG_ON)
    bench.network.sent.clear()
    bench.cycle(times=140)
    beats = [data for can_id, data in bench.network.sent if can_id == 0x77E]
    assert set(beats) == {b"\x05"}
    assert 25 <= len(beats) <= 32
    bench.network.sent.clear()
    bench.arm.disable()
    assert sdo_of(bench) == list(golden.WATCHDOG_OFF)


def test_cycle_sends_targets_and_then_sync():
    bench = Bench(host_watchdog_ms=60_000).enabled()
    bench.cycle()
    bench.network.sent.clear()
    bench.cycle((0.005, -0.005, 0.0, 0.0, 0.0, 0.001))
    # Controlword 000F and the target in counts, little-endian, in the order of the joints.
    targets = ("32000000", "ceffffff", "00000000", "00000000", "00000000", "0a000000")
    expected = [(0x201 + i, "0f00" + counts) for i, counts in enumerate(targets)]
    assert [(can_id, data.hex()) for can_id, data in bench.network.sent] == [*expected, (SYNC, "")]


@pytest.mark.parametrize("name", golden.STATUSWORDS)
def test_statusword_is_read_by_mask(name):
    assert {state_of(word) for word in golden.STATUSWORDS[name]} == {DriveState[name] if name else None}
    assert all(sum(word & mask == value for _, mask, value in PATTERNS) <= 1 for word in range(0x80))


def test_emergency_stays_until_the_node_takes_it_back_and_a_flood_is_bounded():
    mailbox = Mailbox((1, 2), 6, lambda: 0)
    for _ in range(1000):
        mailbox.on_emcy(0x081, bytearray(b"\x11\x86\x21\x01\x02\x03\x04\x05"), 0.0)
    active = mailbox.look()[0].active
    assert active[0] == (0x8611, 0x21, b"\x01\x02\x03\x04\x05")
    assert len(active) <= 65
    mailbox.on_emcy(0x081, bytearray(b"\x07\x00\x00\x00\x00\x00\x00\x00"), 0.0)
    assert mailbox.look()[0].active == ()


def test_answer_that_comes_after_the_wait_counts_for_no_sync():
    mailbox = Mailbox((1,), 7, lambda: 0)
    mailbox.begin()
    mailbox.wait(0)
    mailbox.on_tpdo(0x181, bytearray(7), 0.0)
    mailbox.begin()
    assert [box.answered for box in mailbox.wait(0)] == [False]
    mailbox.begin()
    mailbox.on_tpdo(0x181, bytearray(7), 0.0)
    assert [box.answered for box in mailbox.wait(0)] == [True]


def test_frame_of_another_length_changes_nothing():
    mailbox = Mailbox((1,), 7, lambda: 0)
    before = mailbox.look()
    for hear in (mailbox.on_tpdo, mailbox.on_heartbeat, mailbox.on_emcy):
        for size in (0, 2, 6):
            hear(0x001, bytearray(size), 0.0)
    assert mailbox.look() == before


def test_link_sends_frames_and_hears_them_until_it_is_closed():
    heard = []
    with (
        CanopenLink.open(channel="link-frames", **BUS) as link,
        can.Bus(interface="virtual", channel="link-frames") as peer,
    ):
        link.subscribe(0x181, lambda can_id, data, _: heard.append((can_id, bytes(data))))
        link.send(0x201, b"\x0f\x00")
        message = peer.recv(1.0)
        assert (message.arbitration_id, bytes(message.data), message.is_extended_id) == (0x201, b"\x0f\x00", False)
        for number in (1, 2):
            peer.send(can.Message(arbitration_id=0x181, data=b"\x01", is_extended_id=False))
            wait_for(lambda number=number: len(heard) == number)
        link.unsubscribe(0x181)
        link.unsubscribe(0x181)
        link.require_alive()
    assert heard == [(0x181, b"\x01")] * 2
    link.close()
    with pytest.raises(SilentError, match=r"receiving has ended \(it is closed\)"):
        link.require_alive()
    with pytest.raises(SilentError, match="does not take frames"):
        link.send(0x80, b"")


def test_sdo_errors_become_driver_errors():
    with CanopenLink.open(channel="link-sdo", **BUS) as link, can.Bus(interface="virtual", channel="link-sdo") as peer:
        objects = link.objects(5, 0.02)
        with pytest.raises(SilentError, match="drive 5: does not answer about object 0x1018:01"):
            objects.read(0x1018, 1)
        patient = link.objects(6, 2.0)

        def answer_with(code):
            data = b"\x80\x18\x10\x01" + code.to_bytes(4, "little")
            peer.send(can.Message(arbitration_id=0x586, data=data, is_extended_id=False))

        with can.Notifier(peer, [_OnRequest(0x606, answer_with, [0x06020000, 0x08000022, 0x06090011])]):
            assert patient.read(0x1018, 1) is None
            with pytest.raises(DeviceFaultError, match=r"refuses object 0x1018:01.*0x08000022"):
                patient.write(0x1018, 1, 0, 4)
            with pytest.raises(DeviceFaultError, match="has no object 0x1018:01"):
                patient.write(0x1018, 1, 0, 4)


def test_damaged_sdo_answer_is_asked_for_again():
    with CanopenLink.open(channel="link-bad", **BUS) as link, can.Bus(interface="virtual", channel="link-bad") as peer:
        objects, good = link.objects(5, 0.02), bytes.fromhex("4b41600037020000")

        def answer_with(size):
            peer.send(can.Message(arbitration_id=0x585, data=good[:size], is_extended_id=False))

        with can.Notifier(peer, [_OnRequest(0x605, answer_with, [3, 8, 0, 7, 8])]):
            assert objects.read(0x6041) == b"\x37\x02"
            with pytest.raises(SilentError, match="drive 5: does not answer about object 0x6041:00"):
                objects.read(0x6041)


class _OnRequest(can.Listener):
    def __init__(self, identifier, answer, codes):
        self._identifier, self._answer, self._codes = identifier, answer, codes

    def on_message_received(self, msg):
        if msg.arbitration_id == self._identifier:
            self._answer(self._codes.pop(0))

    def stop(self): ...


def test_counts_become_angles_and_back():
    joint = JointDrive(
        node=1, counts_per_rad=-1000.0, lower_rad=-1.0, upper_rad=2.0, velocity_rad_per_s=1.0, zero_counts=50
    )
    assert joint.counts(0.1) == -50
    assert joint.angle_rad(-50) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "wrong", [{"node": 0}, {"counts_per_rad": 0.0}, {"counts_per_rad": 1e10}, {"zero_counts": 2**31}]
)
def test_joint_that_cannot_work_is_refused(wrong):
    with pytest.raises(SettingError):
        replace(joints()[0], **wrong)


@pytest.mark.parametrize("wrong", [{"joints": joints() + joints()}, {"host_node": 3}, {"host_watchdog_ms": 10}])
def test_arm_that_cannot_work_is_refused(wrong):
    with pytest.raises(SettingError):
        ArmSettings(**({"joints": joints(), "control_rate_Hz": 140} | wrong))
