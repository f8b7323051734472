"""The JR3 board: filter, counter and states, in the frames of its CAN firmware."""

import struct

import pytest

from palpate.simulation.emulators.jr3.can import Jr3CanNode
from palpate.simulation.emulators.jr3.node import BOOT_NS, Jr3Node, Notice, Sample
from palpate.simulation.emulators.lines.can_bus import BusFrame
from tests.support import jr3_vectors as golden

MS = 1_000_000
S = 1_000_000_000
FULL = (115.0, 111.0, 185.0, 5.6, 5.2, 6.1)


def frame(vector):
    return BusFrame(vector[0], bytes.fromhex(vector[1]))


READY, NOT_INITIALISED, BOOTUP = map(frame, (golden.READY, golden.NOT_INITIALISED, golden.BOOTUP))


class Host:
    """Talks to a node and keeps the time."""

    def __init__(self, boot_ns=0, connected=True):
        self.node = Jr3CanNode(1, lambda _: FULL, boot_ns)
        self.node.firmware.connected = connected
        self.now_ns = 0
        self.boot_frames = self.node.advance(0)

    def wait(self, ns):
        self.now_ns += ns
        return self.node.advance(self.now_ns)

    def send(self, arbitration_id, data=b"", wait_ns=MS):
        return self.node.feed(arbitration_id, data, self.now_ns) + self.wait(wait_ns)


def test_bootup_comes_after_two_seconds_and_what_was_heard_meanwhile_is_lost():
    host = Host(boot_ns=BOOT_NS)
    assert host.boot_frames == []
    assert host.send(0x401, wait_ns=2 * S) == []
    assert host.wait(40 * MS) == [BOOTUP]
    assert host.send(0x401) == [READY]
    host.node.reboot(host.now_ns)
    assert host.wait(3 * S) == [BOOTUP]


def test_golden_requests_have_golden_answers():
    host = Host()
    for request, answer in (
        (golden.GET_STATE, golden.READY),
        (golden.GET_FORCE_SCALES, golden.FORCE_SCALES),
        (golden.GET_MOMENT_SCALES, golden.MOMENT_SCALES),
        (golden.STOP, golden.READY),
    ):
        requested = frame(request)
        assert host.send(requested.arbitration_id, requested.data) == [frame(answer)]


def test_golden_start_gives_a_pair_every_ten_milliseconds():
    host = Host()
    start = frame(golden.START)
    frames = host.send(start.arbitration_id, start.data, wait_ns=101 * MS)
    assert frames[0] == READY
    assert [each.arbitration_id for each in frames[1:]] == [golden.FORCES[0], golden.MOMENTS[0]] * 10
    for forces, moments in zip(frames[1::2], frames[2::2], strict=True):
        assert len(forces.data) == len(moments.data) == 8
        assert forces.data[6:] == moments.data[6:]
    x, y, z, counter = struct.unpack("<3hH", frames[-2].data)
    assert (x, y, z) == (-y, z, y)
    assert counter == 1 + 90_000_000 // 128_500


def test_board_without_a_sensor_acknowledges_with_one_and_has_no_full_scales():
    host = Host(connected=False)
    assert host.boot_frames == []
    for operation in (0x200, 0x280, 0x400):
        assert host.send(operation + 1, b"\x00" * 6) == [NOT_INITIALISED]
    (answer,) = host.send(0x481)
    assert len(answer.data) == 7
    assert answer.data[0] == 1
    assert answer.data[1:] != struct.pack("<3H", 115, 111, 185)
    assert host.wait(S) == []


def ready(wrench=FULL):
    node = Jr3Node(lambda _: wrench, 0)
    assert node.advance(0) == [Notice.BOOTED]
    return node


def samples(node, until_ns):
    return [event for event in node.advance(until_ns) if isinstance(event, Sample)]


@pytest.mark.parametrize(
    ("wrench", "counts"),
    [
        (FULL, (-16384, 16384, 16384, -16384, 16384, 16384)),  # the axes are left-handed
        ((-1000.0, -1000.0, 0.0, 0.0, 0.0, 100.0), (32767, -32767, 0, 0, 0, 32767)),
    ],
    ids=["full scale", "saturated"],
)
def test_load_becomes_counts(wrench, counts):
    node = ready(wrench)
    node.start(0, 0, period_us=1000)
    assert samples(node, MS)[-1].counts == counts


def test_stop_resets_the_counter_and_another_start_does_not():
    node = ready()
    node.start(0, 0, period_us=1000)
    samples(node, 10 * MS)
    node.start(0, 10 * MS, period_us=2000)
    assert samples(node, 20 * MS)[-1].counter > 100
    node.stop()
    assert samples(node, 30 * MS) == []
    node.start(0, 30 * MS, period_us=1000)
    first = samples(node, 31 * MS)[0]
    assert (first.counter, first.counts[2]) == (1, 16384)
