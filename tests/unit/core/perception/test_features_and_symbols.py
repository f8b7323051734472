"""Features of the measurement and symbols of features."""

import itertools
import math

import numpy as np
import pytest
import scipy.signal
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from palpate.core.errors import CommandError, ConfigurationError, LifecycleError
from palpate.core.perception import PrincipalComponents, SelectedChannels, SelfOrganisingMap
from palpate.core.perception.signal import Normalisation, SignalProcessor, samples
from palpate.core.perception.symbols import Clusters, GatedThresholds, RandomPartition, Symboliser, Thresholds
from palpate.core.ports import CHANNELS

SIGNAL = tuple(float(i) for i in range(9))


@pytest.fixture(scope="module")
def table():
    """Nine channels of unlike units that hang together through three causes."""
    generator = np.random.default_rng(3)
    causes = generator.normal(size=(300, 3)) * (3.0, 2.0, 1.0)
    mixed = causes @ generator.normal(size=(3, 9)) + 0.1 * generator.normal(size=(300, 9))
    return mixed * np.array([1e-3] * 3 + [5.0] * 3 + [1e-2] * 3)


class TestFeatures:
    def test_selected_channels_come_in_the_order_asked_for(self):
        extractor = SelectedChannels(("tx", "x", "fz"))
        assert extractor.extract(SIGNAL) == (6.0, 0.0, 5.0)
        assert extractor.names == ("tx", "x", "fz")
        assert SelectedChannels(("y",)).extract(SIGNAL) == (1.0,)

    @pytest.mark.parametrize(("channels", "columns"), [(CHANNELS, range(9)), (("tx", "fy", "z"), (6, 4, 2))])
    def test_principal_components_agree_with_scikit_learn(self, table, channels, columns):
        fitted = PrincipalComponents.fit(table, 3, channels)
        oracle = make_pipeline(StandardScaler(), PCA(3, svd_solver="full")).fit_transform(table[:, columns])
        ours = [fitted.extract(tuple(row)) for row in table.tolist()]
        np.testing.assert_allclose(ours, oracle, atol=1e-10)
        assert fitted.names == ("pc1", "pc2", "pc3")

    def test_map_finds_the_best_matching_unit(self, table):
        fitted = SelfOrganisingMap.fit(table, 3, 4, 1, iterations=500)
        assert fitted.names == ("som_row", "som_column")
        normal = (table - table.mean(axis=0)) / table.std(axis=0)
        grid = np.array(fitted.units).reshape(3, 4, 9)
        for row, inputs in zip(table.tolist(), normal, strict=True):
            distance = np.linalg.norm(grid - inputs, axis=2)
            assert fitted.extract(tuple(row)) == np.unravel_index(distance.argmin(), (3, 4))
        used = {fitted.extract(tuple(row)) for row in table.tolist()}
        assert len(used) == 12

    @pytest.mark.parametrize("value", [[[1.0, 2.0]], [[1.0, 2.0], [3.0]], [["a", "b"]] * 2, np.ones((2, 2, 2))])
    def test_samples_refuses_other_shapes(self, value):
        with pytest.raises(ConfigurationError, match=r"perception\.samples must be two or more rows of 2"):
            samples(value, 2)


MM = 1e-3
KGF_MM = 9.80665e-3
PAPER = GatedThresholds.of({"x": (-MM, MM), "y": (-MM, MM)}, {"tx": (-KGF_MM, KGF_MM), "ty": (-KGF_MM, KGF_MM)})
BOUNDS = {"x": (-5e-3, 5e-3), "fz": (-20.0, 0.0)}
CENTRES = np.array([[-2e-3, -10.0], [2e-3, -10.0], [2e-3, 0.0]])


@pytest.fixture(scope="module")
def clouds():
    """Three clouds, well apart only once the units are made comparable."""
    generator = np.random.default_rng(0)
    return np.concatenate([centre + generator.normal(size=(400, 2)) * (2e-4, 0.5) for centre in CENTRES])


class TestSymbols:
    @settings(deadline=None)
    @given(st.floats(-1e3, 1e3), st.lists(st.floats(0.1, 100.0), min_size=1, max_size=4, unique=True))
    @example(-0.0, [0.5])
    @example(0.5, [0.5])
    def test_bands_are_mirrored_and_a_threshold_belongs_to_the_inner_one(self, value, sizes):
        sizes.sort()
        stage = Thresholds.of({"x": [-t for t in reversed(sizes)] + sizes})
        last = len(stage.symbols) - 1
        assert stage.symbol((value,)) + stage.symbol((-value,)) == last
        assert stage.symbol((value,)) == len(sizes) + sum(value > t for t in sizes) - sum(value < -t for t in sizes)

    def test_papers_seventeen_symbols_are_exactly_these_and_all_reachable(self):
        outside = [f"x{a} y{b}" for a, b in itertools.product("-0+", repeat=2) if a + b != "00"]
        inside = [f"tx{a} ty{b}" for a, b in itertools.product("-0+", repeat=2)]
        assert PAPER.symbols == (*outside, *inside)
        assert len(PAPER.symbols) == 17
        size = {"-": -2.0, "0": 0.0, "+": 2.0}
        seen = set()
        for a, b, c, d in itertools.product("-0+", repeat=4):
            number = PAPER.symbol((size[a] * MM, size[b] * MM, size[c] * KGF_MM, size[d] * KGF_MM))
            assert PAPER.symbols[number] == (f"tx{c} ty{d}" if a + b == "00" else f"x{a} y{b}")
            seen.add(number)
        assert seen == set(range(17))

    @pytest.mark.parametrize(
        "stage",
        [
            Thresholds.of(dict.fromkeys("abcd", (-1, 1))),
            PAPER,
            RandomPartition.draw(dict.fromkeys("abcd", (-1.0, 2.0)), 5, 0),
        ],
    )
    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    @pytest.mark.parametrize("place", range(4))
    def test_what_is_not_finite_never_gets_a_symbol(self, stage, bad, place):
        features = [5.0] * 4  # outside the gate: even a feature that is not looked at must be sound
        features[place] = bad
        with pytest.raises(CommandError, match="features must be finite"):
            stage.symbol(tuple(features))

    def test_prototypes_lie_inside_the_bounds_and_own_themselves(self):
        stage = RandomPartition.draw(BOUNDS, 50, 3)
        low, high = np.array(list(BOUNDS.values())).T
        for i, prototype in enumerate(np.array(stage.prototypes)):
            place = low + prototype * (high - low)
            assert np.all((low <= place) & (place <= high))
            assert stage.symbol(tuple(place.tolist())) == i
        assert stage.features == ("x", "fz")
        assert stage.symbols[:2] == ("region 0", "region 1")
        assert len(stage.symbols) == 50
        assert isinstance(stage, Symboliser)

    def test_no_feature_outweighs_another_by_its_unit(self):
        in_m = RandomPartition.draw(BOUNDS, 8, 4)
        in_mm = RandomPartition.draw({"x": (-5.0, 5.0), "fz": (-20.0, 0.0)}, 8, 4)
        points = np.random.default_rng(1).uniform((-5e-3, -20.0), (5e-3, 0.0), (200, 2)).tolist()
        symbols = [in_m.symbol((x, fz)) for x, fz in points]
        assert symbols == [in_mm.symbol((1e3 * x, fz)) for x, fz in points]
        assert set(symbols) == set(range(8))

    def test_clusters_find_the_clouds_in_reading_order(self, clouds):
        stage = Clusters.fit(clouds, 3, 0, ("x", "fz"))
        assert stage.symbols == ("cluster 0", "cluster 1", "cluster 2")
        found = np.array(stage.prototypes) / stage.normalisation.gain + stage.normalisation.offset
        order = [0, *(1 + np.argsort(found[1:, 1]))]
        np.testing.assert_allclose(found[order], CENTRES, atol=0.1)
        np.testing.assert_allclose(found[order, 0], CENTRES[:, 0], atol=1e-4)
        assert np.all(np.diff(found[:, 0]) >= 0)
        labels = [stage.symbol(tuple(row)) for row in clouds.tolist()]
        assert [len(set(labels[i : i + 400])) for i in (0, 400, 800)] == [1, 1, 1]
        assert len(set(labels)) == 3


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
            processor.update(tuple(raw))
        with pytest.raises(CommandError, match="finite"):
            processor.reset(raw)
    assert processor.get_state() == state


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
