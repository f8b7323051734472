"""Records that are lost, old, or an old sample under a new number; status words; a new start; any bytes at all."""

import struct
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.ati import NetFt, NetFtBox
from palpate.drivers.ati.stream import SATURATED, faults_in
from palpate.drivers.errors import DeviceFaultError, SilentError, WiringError

BOX = NetFtBox(1e6, 1e5, (330.0, 330.0, 990.0), (30.0, 30.0, 30.0), 1000.0)
START, STOP = bytes.fromhex("1234000200000000"), bytes.fromhex("1234000000000000")


def record(number: int, ft: int | None = None, status: int = 0, fz: int = 0) -> bytes:
    return struct.pack(">3I6i", number % 2**32, (7 * number if ft is None else ft) % 2**32, status, 0, 0, fz, 0, 0, fz)


class Wire:
    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.waiting: list[bytes] = []
        self.broken = False

    def send(self, datagram: bytes) -> None:
        self.sent.append(datagram)

    def receive(self) -> list[bytes]:
        if self.broken:
            raise OSError("is gone")
        found, self.waiting = self.waiting, []
        return found


def streaming() -> tuple[NetFt, Wire]:
    wire = Wire()
    device = NetFt(wire, BOX)
    device.start(0)
    return device, wire


def fed(*datagrams: bytes) -> tuple[list[int], NetFt]:
    """Numbers of the samples that come of these, one poll each."""
    device, wire = streaming()
    numbers = []
    for datagram in datagrams:
        wire.waiting = [datagram]
        numbers += [sample.sequence for sample in device.poll(1)]
    return numbers, device


@pytest.mark.parametrize(
    ("sent", "taken", "counts"),
    [
        ((1, 2, 3), [1, 2, 3], Counter(new=3)),
        ((1, 4, 5), [1, 4, 5], Counter(new=3, lost=2)),
        ((1, 2, 2, 3), [1, 2, 3], Counter(new=3, old=1)),
        ((1, 3, 2, 4), [1, 3, 4], Counter(new=3, lost=1, old=1)),
        ((2**32 - 2, 2**32 - 1, 0, 2, 1), [1, 2, 3, 5], Counter(new=4, lost=1, old=1)),
        ((5, 5 + 10_000), [1, 10_001], Counter(new=2, lost=9_999)),
    ],
)
def test_lost_and_old_records_are_counted(sent: tuple[int, ...], taken: list[int], counts: Counter[str]) -> None:
    numbers, device = fed(*map(record, sent))
    assert (numbers, device.records) == (taken, counts)


def test_an_old_sample_under_a_new_number_is_no_news() -> None:
    numbers, device = fed(record(1, ft=70), record(2, ft=70), record(3, ft=77), b"\0" * 35)
    assert numbers == [1, 3]
    assert device.records == Counter(new=2, lost=1, old=1, malformed=1)


@given(st.lists(st.integers(0, 60), max_size=60))
def test_whatever_the_network_does_samples_go_forward_and_the_account_is_even(sent: list[int]) -> None:
    numbers, device = fed(*map(record, sent))
    counts = device.records
    assert numbers == sorted(set(numbers))
    assert counts["new"] + counts["old"] == len(sent)
    assert counts["new"] + counts["lost"] == (max(sent) - sent[0] + 1 if sent else 0)


def test_scales_marks_and_range() -> None:
    device, wire = streaming()
    wire.waiting = [record(1, fz=2_000_000), record(2, status=0x8002_0000), record(3, fz=-(2**31))]
    plain, saturated, beyond = device.poll(5)
    assert (plain.force_N, plain.torque_Nm) == ((0.0, 0.0, 2.0), (0.0, 0.0, 20.0))
    assert [s.saturated for s in (plain, saturated)] == [False, True]
    assert beyond.over_range
    device.check()


def test_a_fault_has_its_name_and_waits_for_a_person() -> None:
    _, device = fed(record(1, status=0x8000_0020), record(2))
    for _ in range(2):
        with pytest.raises(DeviceFaultError, match="analog supply voltage too low"):
            device.check()
    device.acknowledge()
    device.check()


def test_a_request_that_was_lost_is_sent_again_until_the_stream_begins() -> None:
    device, wire = streaming()
    for ms in (50, 100, 150, 200):
        device.poll(ms * 1_000_000)
    assert wire.sent == [START] * 3
    wire.waiting = [record(1)]
    device.poll(250_000_000)
    device.poll(900_000_000)
    device.stop()
    assert wire.sent == [START] * 3 + [STOP]


def test_a_new_stream_goes_on_counting_and_drops_what_waited() -> None:
    device, wire = streaming()
    wire.waiting = [record(1), record(2)]
    device.poll(1)
    wire.waiting = [record(3)]
    device.start(2)
    wire.waiting = [record(1, ft=999)]
    assert [sample.sequence for sample in device.poll(3)] == [3]
    assert device.records == Counter(new=3)


def test_a_straggler_of_the_stream_before_does_not_hold_up_the_new_one() -> None:
    # Asked anew the box counts records from one, its samples go on.
    numbers, device = fed(record(900, ft=6300), *(record(n, ft=6300 + 7 * n) for n in range(1, 4)), record(2, ft=6314))
    assert numbers == [1, 2, 3, 4]
    assert device.records == Counter(new=4, old=1)


def test_a_dead_way_is_an_error_and_not_silence() -> None:
    device, wire = streaming()
    wire.broken = True
    assert device.poll(1) == []
    with pytest.raises(WiringError, match="is gone"):
        device.check()


def test_a_stream_that_ceases_is_silence_until_it_goes_on() -> None:
    device, wire = streaming()
    wire.waiting = [record(1)]
    device.poll(1_000_000)
    device.poll(200_000_000)
    with pytest.raises(SilentError, match="has sent nothing for 199 ms"):
        device.check()
    wire.waiting = [record(2)]
    device.poll(210_000_000)
    device.check()


@pytest.mark.parametrize(
    ("datagram", "told"),
    [
        (record(1), r"nothing new for 199 ms, but records: old \(1\)"),
        (record(501, ft=3500), r"but records: old \(1\)"),
        (bytes(35), r"but records: malformed \(1\)"),
    ],
)
def test_what_comes_instead_of_news_is_told_apart_from_silence(datagram: bytes, told: str) -> None:
    device, wire = streaming()
    wire.waiting = [record(500)]
    device.poll(1_000_000)
    wire.waiting = [datagram]
    device.poll(200_000_000)
    with pytest.raises(SilentError, match=told):
        device.check()


@given(st.lists(st.binary(max_size=200), max_size=5))
def test_no_datagram_raises(datagrams: list[bytes]) -> None:
    numbers, device = fed(*datagrams)
    assert numbers == sorted(set(numbers))
    assert device.records["malformed"] == sum(not data or len(data) % 36 > 0 for data in datagrams)


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (0, []),
        (SATURATED | 1 << 31, []),  # marks samples
        (0x8001_0000, []),  # a threshold of the box's own monitor, latched
        (0x8000_0000, ["bit 31"]),
        (0xC000_0000, ["CPU or RAM"]),
        (0x8000_0010, ["transducer unplugged"]),
        (0x8802_0400, ["serial link", "analog board watchdog"]),
        (0x0000_8000, ["unknown fault (bit 15)"]),
    ],
)
def test_a_status_word_names_its_faults(status: int, words: list[str]) -> None:
    faults = faults_in(status)
    assert len(faults) == len(words)
    assert all(word in fault for word, fault in zip(words, faults, strict=True))
