"""Halves joined, the counter unwrapped, counts scaled, settings checked."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.drivers.errors import SettingError
from palpate.drivers.jr3 import LEFT_HANDED, RIGHT_HANDED, Jr3Settings
from palpate.drivers.jr3.codec_can import Reassembly
from palpate.drivers.jr3.messages import Forces, FullScales, Moments, Reading, Scaling, peak_counts
from palpate.drivers.jr3.sampling import FrameCounter
from palpate.drivers.jr3.settings import check_node, settling_ns

WRIST = FullScales((115, 111, 185), (56, 52, 61))


def f(counter: int) -> Forces:
    return Forces((1, 2, 3), counter)


def m(counter: int) -> Moments:
    return Moments((4, 5, 6), counter)


def joined(*halves: Forces | Moments) -> tuple[list[int], int, int]:
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
def test_only_equal_counters_are_joined(halves: list[Forces | Moments], result: tuple[list[int], int, int]) -> None:
    assert joined(*halves) == result


@given(st.lists(st.builds(f, st.integers(0, 3)) | st.builds(m, st.integers(0, 3)), max_size=40))
def test_every_half_is_accounted_for(halves: list[Forces | Moments]) -> None:
    whole, orphans, duplicates = joined(*halves)
    assert 2 * len(whole) + orphans + duplicates == len(halves)


@pytest.mark.parametrize(
    ("raws", "sequence", "counted"),
    [
        ((0, 78, 78 * 4), [1, 79, 313], {"gaps": 1, "missed": 2}),
        # A flipped bit costs one reading, and little damage is corrected; neither looks like a restart.
        ((0, 78, 156 | 0x8000, 234, 312), [1, 79, None, 235, 313], {"doubted": 1, "restarts": 0}),
        ((1000, 1078 | 0x200, 1156, 1234, 1312), [1, 591, None, 592, 670], {"doubted": 1, "restarts": 0}),
        # A restart that nobody announced, and a long gap, are believed at their second reading.
        ((20_000, 20_078, 5, 83, 161), [1, 79, None, 80, 158], {"restarts": 1}),
        ((0, 20_000, 20_078), [1, None, 20_079], {"gaps": 1, "missed": 257, "restarts": 0}),
        # The counter wraps and the sequence does not.
        ([raw % 0x10000 for raw in range(65_300, 220_000, 78)], list(range(1, 154_701, 78)), {"gaps": 0, "doubted": 0}),
    ],
    ids=["gap", "bit", "damage", "restart", "long gap", "wrap"],
)
def test_the_counter_becomes_a_sequence(raws: list[int], sequence: list[int | None], counted: dict[str, int]) -> None:
    counter = FrameCounter(10_000)
    assert [counter.accept(raw) for raw in raws] == sequence
    assert {name: getattr(counter, name) for name in counted} == counted


def test_after_silence_any_new_counter_will_do_but_not_the_old_one() -> None:
    counter = FrameCounter(10_000)
    counter.accept(30_000)
    counter.resume()
    assert [counter.accept(raw) for raw in (30_000, 100, 178)] == [None, 2, 80]
    assert counter.restarts == 0


@given(st.lists(st.integers(0, 0xFFFF), max_size=60), st.integers(500, 1_000_000))
def test_the_sequence_only_ever_increases(raws: list[int], period_us: int) -> None:
    counter = FrameCounter(period_us)
    sequence = [number for raw in raws if (number := counter.accept(raw)) is not None]
    assert all(after > before for before, after in itertools.pairwise(sequence))


def test_one_count_of_the_wrist_sensor() -> None:
    assert WRIST.lsb_N == pytest.approx((7.02e-3, 6.78e-3, 11.29e-3), rel=1e-3)
    assert WRIST.lsb_Nm == pytest.approx((0.342e-3, 0.317e-3, 0.372e-3), rel=2e-3)


def test_full_scale_is_full_scale() -> None:
    reading = Reading((16384, 16384, -16384), (16384, -16384, 16384), 0)
    assert Scaling(WRIST, RIGHT_HANDED).wrench(reading) == ((115.0, 111.0, -185.0), (5.6, -5.2, 6.1))
    assert Scaling(WRIST, LEFT_HANDED).wrench(reading) == ((-115.0, 111.0, -185.0), (-5.6, -5.2, 6.1))


COUNT = st.integers(-32768, 32767)


@given(st.tuples(COUNT, COUNT, COUNT), st.tuples(COUNT, COUNT, COUNT))
def test_scaling_can_be_undone(force: tuple[int, int, int], moment: tuple[int, int, int]) -> None:
    force_N, torque_Nm = Scaling(WRIST, LEFT_HANDED).wrench(Reading(force, moment, 0))
    signs = LEFT_HANDED
    back = [s * x / lsb for s, x, lsb in zip(signs[:3], force_N, WRIST.lsb_N, strict=True)]
    back += [s * x / lsb for s, x, lsb in zip(signs[3:], torque_Nm, WRIST.lsb_Nm, strict=True)]
    assert [round(x) for x in back] == [*force, *moment]
    assert peak_counts(Reading(force, moment, 0)) == max(abs(x) for x in (*force, *moment))


@pytest.mark.parametrize(
    "wrong",
    [
        {"cutoff_Hz": 655.36},
        {"cutoff_Hz": -1.0},
        {"cutoff_Hz": 0.004},
        {"cutoff_Hz": float("nan")},
        {"period_us": 0},
        {"period_us": 2_000_000},
        {"stall_periods": 1},
        {"signs": (1, 1, 1, 1, 1, 0)},
        {"signs": (1, 1, 1)},
    ],
)
def test_settings_that_cannot_work_say_what_would(wrong: dict[str, object]) -> None:
    with pytest.raises(SettingError, match=r"choose|give"):
        Jr3Settings(**wrong)  # type: ignore[arg-type]


def test_the_filter_in_the_boards_units() -> None:
    assert [Jr3Settings(cutoff_Hz=hz).cutoff_cHz for hz in (0.0, 0.01, 2.0, 10.25, 655.35)] == [0, 1, 200, 1025, 65535]
    assert settling_ns(200) == pytest.approx(398e6, rel=1e-3)
    assert settling_ns(0) == 0


def test_a_node_shared_with_canopen_is_refused() -> None:
    check_node(1)
    check_node(10, range(1, 7))
    with pytest.raises(SettingError, match="for example 127"):
        check_node(3, range(1, 7))
    for node in (0, 128):
        with pytest.raises(SettingError, match="1 to 127"):
            check_node(node)
