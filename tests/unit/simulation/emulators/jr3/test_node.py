"""The JR3 firmware model: filter, counter, zero, states and faults, without a wire."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

from palpate.simulation.emulators.jr3.node import BoardState, Jr3Node, Notice, Sample
from palpate.simulation.emulators.jr3.sensor import (
    ASSUMED_NOISE_SHARE,
    FULL_SCALE_COUNTS,
    WRIST_FULL_SCALES,
    ACQUISITION_PERIOD_ns,
    Jr3Config,
    MovingAverage,
    smoothing_factor,
)

MS = 1_000_000
S = 1_000_000_000
FULL = (115.0, 111.0, 185.0, 5.6, 5.2, 6.1)


def node_of(wrench: Any = FULL, seed: int = 1, **config: Any) -> Jr3Node:
    return Jr3Node(Jr3Config(boot_ns=0, eeprom_ns=0, **config), lambda _: wrench, generator=np.random.default_rng(seed))


def ready(wrench: Any = FULL, seed: int = 1, **config: Any) -> Jr3Node:
    node = node_of(wrench, seed, **config)
    assert node.advance(0) == [Notice.BOOTED]
    return node


def samples(node: Jr3Node, until_ns: int) -> list[Sample]:
    return [event for event in node.advance(until_ns) if isinstance(event, Sample)]


@pytest.mark.parametrize(("cut_off_cHz", "alpha"), [(200, 0.001612), (1000, 0.008009), (5000, 0.03880), (0, 1.0)])
def test_smoothing_factors_are_those_of_the_firmware(cut_off_cHz: int, alpha: float) -> None:
    assert smoothing_factor(cut_off_cHz) == pytest.approx(alpha, rel=5e-4)


def test_a_step_of_many_acquisitions_equals_one_by_one() -> None:
    counts = np.array([100.0, -5.0, 3e4, 0.0, 7.0, -2e4])
    at_once, singly = MovingAverage(np.random.default_rng(0)), MovingAverage(np.random.default_rng(0))
    at_once.tune(1000)
    singly.tune(1000)
    at_once.hold(counts, 77, 0.0)
    for _ in range(77):
        singly.value = singly.value + singly.alpha * (counts - singly.value)
    np.testing.assert_allclose(at_once.value, singly.value, rtol=1e-12)


def test_noise_of_a_long_step_has_the_spread_of_single_draws() -> None:
    spread = []
    for seed in range(2000):
        average = MovingAverage(np.random.default_rng(seed))
        average.tune(1000)
        average.hold(np.zeros(6), 5000, 10.0)
        spread.append(average.value)
    alpha = smoothing_factor(1000)
    assert np.std(spread) == pytest.approx(10.0 * math.sqrt(alpha / (2.0 - alpha)), rel=0.03)


def test_one_full_scale_is_16384_counts_and_the_axes_are_left_handed() -> None:
    node = ready()
    node.start(0, 0, period_us=1000)
    assert samples(node, MS)[-1].counts == (-FULL_SCALE_COUNTS, 16384, 16384, -16384, 16384, 16384)
    np.testing.assert_allclose(Jr3Config(left_handed=False).counts(FULL), 16384.0)


def test_counts_saturate() -> None:
    node = ready((-1000.0, -1000.0, 0.0, 0.0, 0.0, 100.0))
    node.start(0, 0, period_us=1000)
    assert samples(node, MS)[-1].counts == (32767, -32767, 0, 0, 0, 32767)


def test_the_filter_starts_from_zero_and_settles() -> None:
    node = ready()
    node.start(1000, 0, period_us=10_000)
    stream = [sample.counts[2] for sample in samples(node, 200 * MS)]
    assert stream[0] == round(16384 * smoothing_factor(1000))
    assert stream == sorted(stream)
    assert stream[2] == pytest.approx(16384 * (1 - math.exp(-2 * math.pi * 10 * 20e-3)), rel=0.01)
    assert stream[-1] == 16384


def test_the_counter_counts_acquisitions_and_wraps() -> None:
    node = ready()
    node.start(200, 0, period_us=10_000)
    stream = samples(node, 9 * S)
    assert stream[1].counter - stream[0].counter in (77, 78)
    steps = {(b.counter - a.counter) & 0xFFFF for a, b in itertools.pairwise(stream)}
    assert steps == {77, 78}
    wrap = next(i for i, (a, b) in enumerate(itertools.pairwise(stream)) if b.counter < a.counter)
    assert wrap * 0.01 == pytest.approx(65536 * ACQUISITION_PERIOD_ns * 1e-9, abs=0.02)


def test_stop_resets_the_counter_and_loses_the_zero() -> None:
    node = ready()
    node.start(0, 0, period_us=1000)
    samples(node, 10 * MS)
    node.zero()
    assert samples(node, 20 * MS)[-1].counts == (0,) * 6
    node.stop()
    assert samples(node, 30 * MS) == []
    node.start(0, 30 * MS, period_us=1000)
    first = samples(node, 31 * MS)[0]
    assert first.counter == 1
    assert first.counts[2] == 16384


def test_start_while_sampling_keeps_zero_and_counter() -> None:
    node = ready()
    node.start(0, 0, period_us=1000)
    samples(node, 10 * MS)
    node.zero()
    node.start(1000, 10 * MS, period_us=2000)
    later = samples(node, 20 * MS)
    assert later[-1].counts == (0,) * 6
    assert later[-1].counter > 100


def test_zeroing_takes_the_filtered_value_so_an_unsettled_filter_leaves_a_rest() -> None:
    node = ready()
    node.start(200, 0, period_us=10_000)
    samples(node, 80 * MS)  # one time constant
    node.zero()
    rest = samples(node, 2 * S)[-1].counts[2]
    assert rest == pytest.approx(16384 * math.exp(-1), rel=0.02)


def test_zeroing_without_sampling_does_nothing() -> None:
    node = ready()
    node.zero()
    node.start(0, 0, period_us=1000)
    assert samples(node, MS)[0].counts[2] == 16384


def test_reset_without_a_sensor_waits_for_one() -> None:
    node = ready()
    assert node.full_scale_words() == WRIST_FULL_SCALES
    node.connected = False
    node.reset(0)
    assert node.advance(60 * S) == []
    assert not node.serving
    node.connected = True
    assert node.advance(61 * S) == [Notice.RESET_DONE]
    assert node.state is BoardState.READY


def test_without_the_sensor_the_stream_repeats_itself() -> None:
    node = ready()
    node.start(0, 0, period_us=1000)
    samples(node, 10 * MS)
    node.connected = False
    assert len(set(samples(node, 20 * MS)[1:])) == 1
    node.connected = True
    assert len(set(samples(node, 30 * MS))) == 10


def test_noise_is_off_by_default_seeded_and_of_the_assumed_size() -> None:
    def stream(seed: int) -> list[Sample]:
        node = ready((0.0,) * 6, seed, noise_share=ASSUMED_NOISE_SHARE)
        node.start(0, 0, period_us=1000)
        return samples(node, 2 * S)

    first = stream(1)
    assert first == stream(1)
    assert first != stream(2)
    assert np.std([sample.counts for sample in first]) == pytest.approx(0.0005 * FULL_SCALE_COUNTS, rel=0.1)


@pytest.mark.parametrize(
    "wrong",
    [{"full_scales": (0, 1, 1, 1, 1, 1)}, {"boot_ns": -1}, {"noise_share": -0.1}, {"shortest_period_ns": 0}],
)
def test_impossible_sensors_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=rf"^{next(iter(wrong))}.* is refused"):
        Jr3Config(**wrong)
