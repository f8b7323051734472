"""The page of a Net F/T; records that are lost or old, or an old sample under a new number; any bytes at all."""

import socket
import struct
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.ati import NetFt, NetFtBox, UdpWire, parse_box
from palpate.drivers.errors import DeviceFaultError, DriverError, SettingError, SilentError, WiringError

# As a Gamma with firmware 2.2.59 sends it.
PAGE = b"""<?xml version="1.0"?><netft>
<runstat>0x00000000</runstat><runrate>7000</runrate><cfgnam>empty</cfgnam><cfgcalsn>FT27462</cfgcalsn>
<scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><cfgtfx>0;0;132.710;0;0;0</cfgtfx>
<cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt><cfgmr>330;330;990;30;30;30</cfgmr>
<comrdte>Enabled</comrdte><comrdtrate>100</comrdtrate><comrdtbsiz>1</comrdtbsiz><mfgdigver>2.2.59</mfgdigver>
</netft>"""


def test_page_of_a_box_is_read():
    box = parse_box(PAGE)
    assert (box.counts_per_N, box.counts_per_Nm, box.rate_Hz) == (1e6, 1e6, 100.0)
    assert (box.range_N, box.range_Nm) == ((330.0, 330.0, 990.0), (30.0, 30.0, 30.0))
    assert box.calibration == "FT27462"
    assert parse_box(PAGE.replace(b">Nm<", b">N-m<")) == box  # as older firmware says it


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b">N<", b">lbf<", "lbf, not N; set the force units to N"),
        (b">Nm<", b">lbf-in<", "lbf-in, not Nm; set the torque units"),
        (b"Enabled", b"Disabled", "Disabled, not Enabled; enable RDT"),
        (b"cfgcpf", b"other", "has no cfgcpf"),
        (b"330;330;", b"330;", "cfgmr"),
        (b"<cfgcpt>1000000", b"<cfgcpt>0", "cfgcpt = '0'"),
        (b"<comrdtrate>100", b"<comrdtrate>nan", "comrdtrate"),
    ],
)
def test_box_that_does_not_fit_says_what_to_change(old, new, words):
    with pytest.raises(SettingError, match=words):
        parse_box(PAGE.replace(old, new))


@given(st.binary(max_size=30), st.integers(0, len(PAGE)), st.integers(0, len(PAGE)))
def test_no_page_raises_anything_else(noise, begin, end):
    try:
        parse_box(PAGE[:begin] + noise + PAGE[end:])
    except DriverError:
        pass


BOX = NetFtBox(1e6, 1e5, (330.0, 330.0, 990.0), (30.0, 30.0, 30.0), 1000.0)
START, STOP = bytes.fromhex("1234000200000000"), bytes.fromhex("1234000000000000")


def record(number, ft=None, status=0, fz=0):
    return struct.pack(">3I6i", number % 2**32, (7 * number if ft is None else ft) % 2**32, status, 0, 0, fz, 0, 0, fz)


class Wire:
    def __init__(self):
        self.sent = []
        self.waiting = []
        self.broken = False

    def send(self, datagram):
        self.sent.append(datagram)

    def receive(self):
        if self.broken:
            raise OSError("is gone")
        found, self.waiting = self.waiting, []
        return found


def streaming(rate_Hz=1000.0):
    wire = Wire()
    device = NetFt(wire, replace(BOX, rate_Hz=rate_Hz))
    device.start(0)
    return device, wire


def fed(*datagrams):
    """Numbers of the samples that come of these, one poll each."""
    device, wire = streaming()
    numbers = []
    for datagram in datagrams:
        wire.waiting = [datagram]
        numbers += [sample.sequence for sample in device.poll(1)]
    return numbers, device


@pytest.mark.parametrize(
    ("sent", "taken", "errors"),
    [
        ([record(n) for n in (1, 2, 3)], [1, 2, 3], {}),
        ([record(n) for n in (1, 4, 5)], [1, 4, 5], {"lost records": 2}),
        ([record(n) for n in (1, 2, 2, 3)], [1, 2, 3], {"old records": 1}),
        ([record(n) for n in (1, 3, 2, 4)], [1, 3, 4], {"lost records": 1, "old records": 1}),
        ([record(n) for n in (2**32 - 2, 2**32 - 1, 0, 2, 1)], [1, 2, 3, 5], {"lost records": 1, "old records": 1}),
        ([record(n) for n in (5, 5 + 10_000)], [1, 10_001], {"lost records": 9_999}),
        # An old sample under a new number is no news.
        ([record(1, ft=70), record(2, ft=70), record(3, ft=77), bytes(35)], [1, 3],
         {"lost records": 1, "old records": 1, "malformed datagrams": 1}),
        # Asked again the box counts records from one, its samples continue.
        ([record(900, ft=6300), *(record(n, ft=6300 + 7 * n) for n in (1, 2, 3)), record(2, ft=6314)], [1, 2, 3, 4],
         {"old records": 1}),
    ],
)  # fmt: skip
def test_lost_and_old_records_are_counted(sent, taken, errors):
    numbers, device = fed(*sent)
    assert (numbers, device.received, +device.errors) == (taken, len(taken), Counter(errors))


@given(st.lists(st.integers(0, 60), max_size=60))
def test_samples_go_forward_whatever_the_network_does(sent):
    numbers, device = fed(*map(record, sent))
    assert numbers == sorted(set(numbers))
    assert device.received + device.errors["old records"] == len(sent)
    assert device.received + device.errors["lost records"] == (max(sent) - sent[0] + 1 if sent else 0)


def test_sample_has_scales_marks_and_range():
    device, wire = streaming()
    wire.waiting = [record(1, fz=2_000_000), record(2, status=0x8002_0000), record(3, fz=-(2**31))]
    plain, saturated, _ = device.poll(5)
    assert (plain.force_N, plain.torque_Nm) == ((0.0, 0.0, 2.0), (0.0, 0.0, 20.0))
    assert [s.saturated for s in (plain, saturated)] == [False, True]
    device.check()


def test_fault_has_its_name_and_waits_for_a_person():
    _, device = fed(record(1, status=0x8000_0020), record(2))
    for _ in range(2):
        with pytest.raises(DeviceFaultError, match="analog supply voltage too low"):
            device.check()
    device.acknowledge()
    device.check()


def test_request_that_was_lost_is_sent_again_until_the_stream_begins():
    device, wire = streaming()
    for ms in (50, 100, 150, 200):
        device.poll(ms * 1_000_000)
    assert wire.sent == [START] * 3
    wire.waiting = [record(1)]
    device.poll(250_000_000)
    device.poll(900_000_000)
    device.stop()
    assert wire.sent == [START] * 3 + [STOP]


def test_slow_stream_has_time_to_begin():
    device, wire = streaming(rate_Hz=2.0)
    for ms in (100, 500, 999):
        device.poll(ms * 1_000_000)
    assert wire.sent == [START]
    device.poll(1_000_000_000)
    assert wire.sent == [START] * 2


def test_dead_network_is_an_error_and_not_silence():
    device, wire = streaming()
    wire.broken = True
    assert device.poll(1) == []
    with pytest.raises(WiringError, match="is gone"):
        device.check()


@pytest.mark.parametrize(
    ("datagrams", "message"),
    [
        ([], "nothing new for 199 ms;"),
        ([record(1)], r"nothing new for 199 ms, but old records \(1\)"),
        ([record(501, ft=3500)], r"but old records \(1\)"),
        ([bytes(35)], r"but malformed datagrams \(1\)"),
    ],
)
def test_silence_tells_what_came_instead_of_news_until_there_is_some(datagrams, message):
    device, wire = streaming()
    wire.waiting = [record(500)]
    device.poll(1_000_000)
    wire.waiting = datagrams
    device.poll(200_000_000)
    with pytest.raises(SilentError, match=message):
        device.check()
    wire.waiting = [record(502)]
    device.poll(210_000_000)
    device.check()


@given(st.lists(st.binary(max_size=200), max_size=5))
def test_no_datagram_raises(datagrams):
    numbers, device = fed(*datagrams)
    assert numbers == sorted(set(numbers))
    assert device.errors["malformed datagrams"] == sum(not data or len(data) % 36 > 0 for data in datagrams)


def test_wire_carries_datagrams_both_ways_and_a_box_without_an_address_is_named():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as box:
        box.bind(("127.0.0.1", 0))
        wire = UdpWire("localhost", box.getsockname()[1])
        assert wire.address == "127.0.0.1"
        assert wire.receive() == []
        wire.send(START)
        request, sender = box.recvfrom(64)
        assert request == START
        for number in (1, 2):
            box.sendto(record(number), sender)
        assert wire.receive() == [record(1), record(2)]
        wire.close()
    with pytest.raises(WiringError, match="::1, UDP port 1 cannot be reached"):
        UdpWire("::1", 1)
