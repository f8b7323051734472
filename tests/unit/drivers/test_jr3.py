"""The JR3 driver: CAN frames, halves joined, the counter unwrapped, counts scaled, settings checked."""

import itertools
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.can import CanFrame, FrameKind
from palpate.drivers.errors import RefusedError, SettingError
from palpate.drivers.jr3 import LEFT_HANDED, RIGHT_HANDED, Jr3Settings
from palpate.drivers.jr3.codec import CanDecoder, Reassembly, encode_can
from palpate.drivers.jr3.messages import (
    Ack,
    Bootup,
    Forces,
    FullScales,
    Moments,
    Op,
    Reading,
    Request,
    Scaling,
    peak_counts,
)
from palpate.drivers.jr3.sampling import FrameCounter
from palpate.drivers.jr3.settings import check_node, settling_ns
from tests.support import jr3_vectors as golden

WRIST = FullScales((115, 111, 185), (56, 52, 61))
COUNT = st.integers(-32768, 32767)
COUNTS = st.tuples(COUNT, COUNT, COUNT)
U16 = st.integers(0, 0xFFFF)


def frame(vector):
    return CanFrame(vector[0], bytes.fromhex(vector[1]))


@pytest.mark.parametrize(
    ("asked", "vector"),
    [
        (Request(Op.START, cutoff_cHz=200, period_us=10_000), golden.START),
        (Request(Op.STOP), golden.STOP),
        (Request(Op.GET_STATE), golden.GET_STATE),
        (Request(Op.GET_FORCE_SCALES), golden.GET_FORCE_SCALES),
        (Request(Op.GET_MOMENT_SCALES), golden.GET_MOMENT_SCALES),
    ],
)
def test_request_becomes_a_golden_frame(asked, vector):
    assert encode_can(asked, 1) == frame(vector)
    assert encode_can(asked, 2).can_id == vector[0] + 1


@pytest.mark.parametrize(
    ("asked", "node"),
    [
        (Request(Op.STOP), 0),
        (Request(Op.STOP), 128),
        (Request(Op.START, cutoff_cHz=65536), 1),
        (Request(Op.START, period_us=-1), 1),
    ],
)
def test_request_that_no_board_may_get_is_refused(asked, node):
    with pytest.raises(RefusedError):
        encode_can(asked, node)


def test_golden_frames_are_decoded():
    decoder = CanDecoder(1)
    for vector, message in (
        (golden.READY, Ack(True)),
        (golden.NOT_INITIALISED, Ack(False)),
        (golden.FORCE_SCALES, Ack(True, (115, 111, 185))),
        (golden.MOMENT_SCALES, Ack(True, (56, 52, 61))),
        (golden.FORCES, Forces((1, -1, -32768), 65535)),
        (golden.MOMENTS, Moments((32767, 0, 1), 2)),
        (golden.BOOTUP, Bootup()),
    ):
        assert decoder.decode(frame(vector)) == message
    assert decoder.counts.good == 7


@given(COUNTS, COUNTS, U16, st.integers(1, 127))
def test_readings_come_back(force, moment, counter, node):
    decoder = CanDecoder(node)
    assert decoder.decode(CanFrame(0x600 + node, struct.pack("<3hH", *force, counter))) == Forces(force, counter)
    assert decoder.decode(CanFrame(0x680 + node, struct.pack("<3hH", *moment, counter))) == Moments(moment, counter)


@pytest.mark.parametrize(
    ("heard", "counted"),
    [
        (CanFrame(0x701, b"\x05"), "garbage"),  # a CANopen heartbeat
        (CanFrame(0x601, bytes(7)), "garbage"),
        (CanFrame(0x681, b""), "garbage"),
        (CanFrame(0x101, bytes(2)), "garbage"),
        (CanFrame(0x101, b"\x02"), "garbage"),
        (CanFrame(0x602, bytes(8)), "foreign"),
        (CanFrame(0x080), "foreign"),
        (CanFrame(0x281), "foreign"),
        (CanFrame(0x601, bytes(8), FrameKind.ERROR), "garbage"),
        (CanFrame(0x601, bytes(8), FrameKind.EXTENDED), "garbage"),
        (CanFrame(0x601, b"", FrameKind.REMOTE), "garbage"),
        (CanFrame(0x601, bytes(8), FrameKind.FD), "garbage"),
        (CanFrame(0x801 + 0x600, bytes(8)), "garbage"),
    ],
)
def test_frame_that_is_not_ours_is_counted(heard, counted):
    decoder = CanDecoder(1)
    assert decoder.decode(heard) is None
    assert getattr(decoder.counts, counted) == 1
    assert decoder.counts.good == 0


@given(st.integers(-1, 1 << 29), st.binary(max_size=64), st.sampled_from(FrameKind))
def test_no_frame_raises_and_each_is_counted_once(can_id, data, kind):
    decoder = CanDecoder(1)
    decoder.decode(CanFrame(can_id, data, kind))
    counts = decoder.counts
    assert counts.good + counts.foreign + counts.garbage == 1


def f(counter):
    return Forces((1, 2, 3), counter)


def m(counter):
    return Moments((4, 5, 6), counter)


def joined(*halves):
    joiner = Reassembly()
    whole = [reading for half in halves if (reading := joiner.add(half)) is not None]
    assert all((r.forces, r.moments) == ((1, 2, 3), (4, 5, 6)) for r in whole)
    joiner.clear()
    return [reading.counter for reading in whole], joiner.orphans, joiner.duplicates


@pytest.mark.parametrize(
    ("halves", "result"),
    [
        ([f(1), m(1), f(2), m(2)], ([1, 2], 0, 0)),
        ([m(1), f(1)], ([1], 0, 0)),
        ([f(1), f(2), m(2)], ([2], 1, 0)),
        ([f(1), m(2), f(3), m(3)], ([3], 2, 0)),
        ([f(1), m(0), m(1)], ([1], 1, 0)),
        ([f(1), f(1), m(1)], ([1], 0, 1)),
        ([f(0xFFFF), m(0xFFFF), f(0), m(0)], ([0xFFFF, 0], 0, 0)),
        ([f(7)], ([], 1, 0)),
    ],
)
def test_halves_with_equal_counters_are_joined(halves, result):
    assert joined(*halves) == result


@given(st.lists(st.builds(f, st.integers(0, 3)) | st.builds(m, st.integers(0, 3)), max_size=40))
def test_every_half_is_accounted_for(halves):
    whole, orphans, duplicates = joined(*halves)
    assert 2 * len(whole) + orphans + duplicates == len(halves)


@pytest.mark.parametrize(
    ("raws", "sequence", "counted"),
    [
        ((0, 78, 78 * 4), [1, 79, 313], {"gaps": 1, "missed": 2}),
        # A flipped bit costs one reading, and little damage is corrected; neither looks like a restart.
        ((0, 78, 156 | 0x8000, 234, 312), [1, 79, None, 235, 313], {"doubted": 1, "restarts": 0}),
        ((1000, 1078 | 0x200, 1156, 1234, 1312), [1, 591, None, 592, 670], {"doubted": 1, "restarts": 0}),
        # A restart without a message, and a long gap, are believed at their second reading.
        ((20_000, 20_078, 5, 83, 161), [1, 79, None, 80, 158], {"restarts": 1}),
        ((0, 20_000, 20_078), [1, None, 20_079], {"gaps": 1, "missed": 257, "restarts": 0}),
        # The counter wraps and the sequence does not.
        ([raw % 0x10000 for raw in range(65_300, 220_000, 78)], list(range(1, 154_701, 78)), {"gaps": 0, "doubted": 0}),
    ],
    ids=["gap", "bit", "damage", "restart", "long gap", "wrap"],
)
def test_counter_becomes_a_sequence(raws, sequence, counted):
    counter = FrameCounter(10_000)
    assert [counter.accept(raw) for raw in raws] == sequence
    assert {name: getattr(counter, name) for name in counted} == counted


def test_counter_after_silence_may_be_any_but_the_old_one():
    counter = FrameCounter(10_000)
    counter.accept(30_000)
    counter.resume()
    assert [counter.accept(raw) for raw in (30_000, 100, 178)] == [None, 2, 80]
    assert counter.restarts == 0


@given(st.lists(st.integers(0, 0xFFFF), max_size=60), st.integers(500, 1_000_000))
def test_sequence_only_ever_increases(raws, period_us):
    counter = FrameCounter(period_us)
    sequence = [number for raw in raws if (number := counter.accept(raw)) is not None]
    assert all(after > before for before, after in itertools.pairwise(sequence))


@given(COUNTS, COUNTS)
def test_counts_become_newtons_in_right_handed_axes(force, moment):
    reading = Reading(force, moment, 0)
    force_N, torque_Nm = Scaling(WRIST, RIGHT_HANDED).wrench(reading)
    assert force_N == pytest.approx([x * full / 16384 for x, full in zip(force, (115, 111, 185), strict=True)])
    assert torque_Nm == pytest.approx([x * full / 16384 for x, full in zip(moment, (5.6, 5.2, 6.1), strict=True)])
    (fx, *_), (tx, *_) = Scaling(WRIST, LEFT_HANDED).wrench(reading)
    assert (fx, tx) == (-force_N[0], -torque_Nm[0])
    assert peak_counts(reading) == max(abs(x) for x in (*force, *moment))


@pytest.mark.parametrize(
    "wrong",
    [
        {"cutoff_Hz": 655.36}, {"cutoff_Hz": -1.0}, {"cutoff_Hz": 0.004}, {"cutoff_Hz": float("nan")},
        {"period_us": 0}, {"period_us": 2_000_000}, {"stall_periods": 1}, {"signs": (1, 1, 1, 1, 1, 0)},
        {"signs": (1, 1, 1)},
    ],
)  # fmt: skip
def test_setting_that_cannot_work_is_refused(wrong):
    with pytest.raises(SettingError, match=rf"{next(iter(wrong))} = .*must be"):
        Jr3Settings(**wrong)  # type: ignore[arg-type]


def test_filter_has_the_board_s_units():
    assert [Jr3Settings(cutoff_Hz=hz).cutoff_cHz for hz in (0.0, 0.01, 2.0, 10.25, 655.35)] == [0, 1, 200, 1025, 65535]
    assert settling_ns(200) == pytest.approx(398e6, rel=1e-3)
    assert settling_ns(0) == 0


def test_node_of_a_canopen_device_is_refused():
    check_node(1)
    check_node(10, range(1, 7))
    with pytest.raises(SettingError, match="for example 127"):
        check_node(3, range(1, 7))
    for node in (0, 128):
        with pytest.raises(SettingError, match="1 to 127"):
            check_node(node)
