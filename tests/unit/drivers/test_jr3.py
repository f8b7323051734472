"""The JR3 driver: CAN frames, halves joined, the counter unwrapped, counts scaled, settings checked."""

import itertools
import struct
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.hardware.jr3 import Jr3CanTable
from palpate.core.errors import ConfigurationError
from palpate.drivers.can import CanFrame
from palpate.drivers.jr3 import LEFT_HANDED, RIGHT_HANDED
from palpate.drivers.jr3.codec import CanDecoder, encode_can
from palpate.drivers.jr3.messages import Ack, Bootup, FullScales, Op, Reading
from palpate.drivers.jr3.sampling import REPEATED, RESTARTED, Sampler, settling_ns
from tests.support import jr3_vectors as golden

WRIST = FullScales((115, 111, 185), (56, 52, 61))
COUNT = st.integers(-32768, 32767)
COUNTS = st.tuples(COUNT, COUNT, COUNT)
U16 = st.integers(0, 0xFFFF)


def frame(vector):
    return CanFrame(vector[0], bytes.fromhex(vector[1]))


@pytest.mark.parametrize(
    ("requested", "vector"),
    [
        ((Op.START, 200, 10_000), golden.START),
        ((Op.STOP,), golden.STOP),
        ((Op.GET_STATE,), golden.GET_STATE),
        ((Op.GET_FORCE_SCALES,), golden.GET_FORCE_SCALES),
        ((Op.GET_MOMENT_SCALES,), golden.GET_MOMENT_SCALES),
    ],
)
def test_request_becomes_a_golden_frame(requested, vector):
    op, *values = requested
    assert encode_can(op, 1, *values) == frame(vector)
    assert encode_can(op, 2, *values).can_id == vector[0] + 1


def decoder(node=1):
    return CanDecoder(node, Counter())


def test_golden_frames_are_decoded():
    ours = decoder()
    for vector, message in (
        (golden.READY, Ack(True)),
        (golden.NOT_INITIALISED, Ack(False)),
        (golden.FORCE_SCALES, Ack(True, (115, 111, 185))),
        (golden.MOMENT_SCALES, Ack(True, (56, 52, 61))),
        (golden.FORCES, None),
        (golden.MOMENTS, None),
        (golden.BOOTUP, Bootup()),
    ):
        assert ours.decode(frame(vector)) == message


def f(counter, counts=(1, 2, 3), node=1):
    return CanFrame(0x600 + node, struct.pack("<3hH", *counts, counter))


def m(counter, counts=(4, 5, 6), node=1):
    return CanFrame(0x680 + node, struct.pack("<3hH", *counts, counter))


@given(COUNTS, COUNTS, U16, st.integers(1, 127))
def test_readings_come_back(force, moment, counter, node):
    ours = decoder(node)
    assert ours.decode(f(counter, force, node)) is None
    assert ours.decode(m(counter, moment, node)) == Reading((*force, *moment), counter)


@pytest.mark.parametrize(
    ("heard", "counted"),
    [
        (CanFrame(0x701, b"\x05"), 1),  # a CANopen heartbeat
        (CanFrame(0x601, bytes(7)), 1),
        (CanFrame(0x681, b""), 1),
        (CanFrame(0x101, bytes(2)), 1),
        (CanFrame(0x101, b"\x02"), 1),
        (CanFrame(0x602, bytes(8)), 0),
        (CanFrame(0x080), 0),
        (CanFrame(0x281), 0),
    ],
)
def test_frame_of_ours_that_makes_no_sense_is_counted(heard, counted):
    ours = decoder()
    assert ours.decode(heard) is None
    assert ours._errors.total() == counted


@pytest.mark.parametrize(
    ("halves", "whole", "orphans"),
    [
        ([f(1), m(1), f(2), m(2)], [1, 2], 0),
        ([m(1), f(1)], [1], 0),
        ([f(1), f(2), m(2)], [2], 1),
        ([f(1), m(2), f(3), m(3)], [3], 2),
        ([f(1), m(0), m(1)], [1], 1),
        ([f(1), f(1), m(1)], [1], 0),
        ([f(0xFFFF), m(0xFFFF), f(0), m(0)], [0xFFFF, 0], 0),
        ([f(7)], [], 1),
    ],
)
def test_halves_with_equal_counters_are_joined(halves, whole, orphans):
    ours = decoder()
    readings = [reading for half in halves if (reading := ours.decode(half)) is not None]
    assert readings == [Reading((1, 2, 3, 4, 5, 6), counter) for counter in whole]
    ours.forget()
    assert ours._errors.total() == orphans


def taken(raws):
    """What a sampler makes of these counters, a reading every 10 ms, and what it counts."""
    errors = Counter()
    sampler = Sampler(5000, LEFT_HANDED, errors)
    sampler.full_scales = WRIST
    sampler.started(0)
    samples = [sampler.take(Reading((1, 2, 3, 4, 5, 6), raw), 10**7 * n) for n, raw in enumerate(raws, start=1)]
    return samples, errors


def test_readings_are_numbered_repeated_ones_are_no_news_and_a_restart_lets_the_filter_settle():
    samples, errors = taken((20_000, 20_078, 20_078, 20_312, 5))
    assert [sample and (sample.sequence, sample.settling) for sample in samples] == [
        (1, True), (2, False), None, (3, False), (4, True),
    ]  # fmt: skip
    assert (errors[REPEATED], errors[RESTARTED]) == (1, 1)


def test_counter_that_wraps_is_no_restart():
    samples, errors = taken([raw % 0x10000 for raw in range(65_300, 220_000, 78)])
    assert errors.total() == 0
    assert not samples[-1].settling


@given(st.lists(st.integers(0, 0xFFFF), max_size=60))
def test_sequence_only_ever_increases(raws):
    sequence = [sample.sequence for sample in taken(raws)[0] if sample is not None]
    assert all(after > before for before, after in itertools.pairwise(sequence))


@given(COUNTS, COUNTS)
def test_counts_become_newtons_in_right_handed_axes(force, moment):
    counts = (*force, *moment)
    force_N, torque_Nm = WRIST.wrench(counts, RIGHT_HANDED)
    assert force_N == pytest.approx([x * full / 16384 for x, full in zip(force, (115, 111, 185), strict=True)])
    assert torque_Nm == pytest.approx([x * full / 16384 for x, full in zip(moment, (5.6, 5.2, 6.1), strict=True)])
    (fx, *_), (tx, *_) = WRIST.wrench(counts, LEFT_HANDED)
    assert (fx, tx) == (-force_N[0], -torque_Nm[0])


@pytest.mark.parametrize(
    "wrong",
    [{"cutoff_Hz": 655.36}, {"cutoff_Hz": -1.0}, {"period_us": 500}, {"period_us": 2_000_000}, {"node": 128},
     {"node": 3, "canopen_nodes": (1, 2, 3)}],
)  # fmt: skip
def test_setting_that_cannot_work_is_refused(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        Jr3CanTable(**wrong)


def test_filter_has_the_board_s_units():
    assert settling_ns(200) == pytest.approx(398e6, rel=1e-3)
    assert settling_ns(0) == 0
