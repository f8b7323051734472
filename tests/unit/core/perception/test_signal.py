import math

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.preprocessing import StandardScaler

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError
from palpate.core.perception.signal import Normalisation, SignalProcessor

ZERO = (0.0,) * 6
ORDERS = pytest.mark.parametrize("order", [1, 2])
reading = st.tuples(*[st.floats(-1e4, 1e4)] * 6)


def noise(rows, seed=0):
    return np.random.default_rng(seed).normal(size=(rows, 6))


def run(processor, table):
    return np.array([processor.update(tuple(row)) for row in table.tolist()])


@ORDERS
@settings(deadline=None, max_examples=40)
@given(rate_Hz=st.floats(1.0, 1e5), part=st.floats(0.002, 0.49), seed=st.integers(0, 99))
def test_the_output_is_scipys(order, rate_Hz, part, seed):
    table = noise(150, seed)
    processor = SignalProcessor(rate_Hz, part * rate_Hz, order)
    processor.reset(ZERO)
    sections = scipy.signal.butter(order, part * rate_Hz, fs=rate_Hz, output="sos")
    np.testing.assert_allclose(run(processor, table), scipy.signal.sosfilt(sections, table, axis=0), atol=1e-9)


@ORDERS
@settings(deadline=None)
@given(raw=reading, cutoff_Hz=st.floats(0.01, 69.9))
def test_after_a_reset_a_constant_passes_unchanged_to_the_last_bit(order, raw, cutoff_Hz):
    processor = SignalProcessor(140.0, cutoff_Hz, order)
    processor.reset(raw)
    assert all(processor.update(raw) == raw for _ in range(20))


@ORDERS
def test_tare_then_scale_then_normalisation_then_filter(order):
    scale = (2.0, -1.0, 9.80665, 1e-3, 1.0, 0.5)
    normal = Normalisation((0.1, 0.2, 0.3, -0.4, 0.5, 0.6), (3.0, 1.0, 2.0, 4.0, 0.1, 7.0))
    bias = (1.0, 2.0, 3.0, 4.0, 5.0, -6.0)
    whole = SignalProcessor(140.0, 4.0, order, scale, normal)
    bare = SignalProcessor(140.0, 4.0, order)
    whole.tare(bias)
    table = noise(50)
    expected = ((table - bias) * scale - normal.offset) * normal.gain
    whole.reset(table[0].tolist())
    bare.reset(expected[0].tolist())
    np.testing.assert_allclose(run(whole, table), run(bare, expected), atol=1e-12)


@ORDERS
def test_the_state_is_the_tare_and_what_the_filter_remembers(order):
    processor = SignalProcessor(140.0, 4.0, order)
    processor.tare((0.1, 0.2, 0.3, 0.4, 0.5, 0.6))
    assert processor.get_state() == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    processor.reset(noise(1, 5)[0].tolist())
    before = processor.get_state()
    assert len(before) == 6 * (1 + order)
    run(processor, noise(20))
    assert processor.get_state()[:6] == before[:6]
    assert processor.get_state() != before


@ORDERS
def test_an_update_without_a_past_is_refused(order):
    with pytest.raises(LifecycleError, match=r"call reset\(\)"):
        SignalProcessor(140.0, 4.0, order).update(ZERO)


@ORDERS
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_sample_that_is_not_finite_is_refused_and_leaves_no_trace(order, bad):
    processor = SignalProcessor(140.0, 4.0, order)
    processor.reset((1.0,) * 6)
    state = processor.get_state()
    for channel in range(6):
        raw = [0.0] * 6
        raw[channel] = bad
        with pytest.raises(CommandError, match="finite"):
            processor.update(tuple(raw))  # type: ignore[arg-type]
        with pytest.raises(CommandError, match="finite"):
            processor.reset(raw)
    assert processor.get_state() == state


def test_a_reset_and_a_tare_take_six_numbers():
    processor = SignalProcessor(140.0, 4.0)
    with pytest.raises(CommandError, match="six"):
        processor.reset((0.0,) * 5)
    with pytest.raises(ConfigurationError, match=r"perception\.tare"):
        processor.tare((0.0,) * 7)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cutoff_Hz": 70.0}, r"perception\.cutoff_Hz = 70\.0 is refused: .* below half the rate, 70"),
        ({"scale": (1.0,) * 5 + (0.0,)}, r"perception\.scale = .* other than zero"),
        ({"normalisation": Normalisation((0.0,), (1.0,))}, r"perception\.normalisation = .* six channels"),
    ],
)
def test_unusable_settings_are_named(settings, message):
    with pytest.raises(ConfigurationError, match=message):
        SignalProcessor(**{"rate_Hz": 140.0, "cutoff_Hz": 4.0, **settings})
    with pytest.raises(ConfigurationError, match=r"normalisation\.gain = .* 2 finite numbers"):
        Normalisation((0.0, 1.0), (1.0,))


def test_fit_agrees_with_scikit_learn():
    table = np.random.default_rng(1).normal([5.0, -3e-3, 100.0], [1e-3, 2.0, 1e4], size=(200, 3))
    fitted = Normalisation.fit(table)
    np.testing.assert_allclose(fitted.apply(table), StandardScaler().fit_transform(table), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("constant", [0.0, 0.1, -1e9])
def test_a_constant_channel_keeps_its_unit(constant):
    # The mean of equal decimals is off by rounding; a gain made from that would be astronomic.
    fitted = Normalisation.fit([(constant, float(i)) for i in range(7)])
    assert fitted.gain[0] == 1.0
    assert fitted.apply([constant, 3.0]) == pytest.approx([0.0, 0.0], abs=1e-6)
