"""Features of the measurement and symbols of features."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import Normalisation, PrincipalComponents, SelectedChannels, SelfOrganisingMap
from palpate.core.perception.signal import samples
from palpate.core.perception.symbols import Clusters, GatedThresholds, RandomPartition, Symboliser, Thresholds
from palpate.core.ports import CHANNELS

SIGNAL = tuple(float(i) for i in range(9))
UNIT = Normalisation((0.0,) * 9, (1.0,) * 9)


@pytest.fixture(scope="module")
def table():
    """Nine channels of unlike units that hang together through three causes."""
    generator = np.random.default_rng(3)
    causes = generator.normal(size=(300, 3)) * (3.0, 2.0, 1.0)
    mixed = causes @ generator.normal(size=(3, 9)) + 0.1 * generator.normal(size=(300, 9))
    scaled = mixed * np.array([1e-3] * 3 + [5.0] * 3 + [1e-2] * 3)
    return scaled


class TestFeatures:
    def test_selected_channels_come_in_the_order_asked_for(self):
        extractor = SelectedChannels(("tx", "x", "fz"))
        assert extractor.extract(SIGNAL) == (6.0, 0.0, 5.0)
        assert extractor.names == ("tx", "x", "fz")
        assert SelectedChannels(("y",)).extract(SIGNAL) == (1.0,)

    @pytest.mark.parametrize("channels", [("x", "roll"), ("x", "x"), ()])
    def test_unknown_doubled_or_no_channels_are_refused(self, channels):
        with pytest.raises(ConfigurationError, match=r"perception\.extractor\.channels.* of x, y, z, fx"):
            SelectedChannels(channels)

    @pytest.mark.parametrize(("channels", "columns"), [(CHANNELS, range(9)), (("tx", "fy", "z"), (6, 4, 2))])
    def test_principal_components_agree_with_scikit_learn(self, table, channels, columns):
        fitted = PrincipalComponents.fit(table, 3, channels)
        oracle = make_pipeline(StandardScaler(), PCA(3, svd_solver="full")).fit_transform(table[:, columns])
        ours = [fitted.extract(tuple(row)) for row in table.tolist()]
        np.testing.assert_allclose(ours, oracle, atol=1e-10)
        assert fitted.names == ("pc1", "pc2", "pc3")

    @pytest.mark.parametrize("components", [0, 10])
    def test_components_out_of_range_are_refused(self, table, components):
        with pytest.raises(ConfigurationError, match=r"perception\.extractor\.components .* from 1 to 9"):
            PrincipalComponents.fit(table, components)

    def test_map_is_the_same_for_the_same_seed_only(self, table):
        def fit(seed):
            return SelfOrganisingMap.fit(table, 3, 4, seed, iterations=300)

        state = np.random.get_state()  # noqa: NPY002 - the point is that nobody touches it
        first = fit(7)
        assert first == fit(7)
        assert first != fit(8)
        after = np.random.get_state()  # noqa: NPY002
        assert np.array_equal(state[1], after[1])

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

    def test_training_brings_the_units_nearer_to_the_samples(self, table):
        def error(iterations):
            fitted = SelfOrganisingMap.fit(table, 4, 4, 1, iterations=iterations)
            inputs = fitted.normalisation.apply(table)
            apart = np.linalg.norm(inputs[:, None, :] - np.array(fitted.units), axis=2)
            return float(apart.min(axis=1).mean())

        assert error(3000) < 0.8 * error(1)

    def test_nothing_is_nearest_to_nan(self):
        fitted = SelfOrganisingMap(UNIT, 1, 2, ((0.0,) * 9, (1.0,) * 9))
        for bad in (math.nan, math.inf):
            with pytest.raises(CommandError, match="finite"):
                fitted.extract((*SIGNAL[:8], bad))

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"rows": 0}, r"perception\.extractor\.rows"),
            ({"rows": 1, "columns": 1}, r"perception\.extractor\.rows = 1 .* two units or more"),
            ({"channels": ("up",)}, r"perception\.extractor\.channels"),
        ],
    )
    def test_unusable_map_settings_are_named(self, table, change, message):
        with pytest.raises(ConfigurationError, match=message):
            SelfOrganisingMap.fit(table, **{"rows": 2, "columns": 2, "seed": 0, **change})  # type: ignore[arg-type]

    @pytest.mark.parametrize(
        ("make", "message"),
        [
            (lambda: PrincipalComponents(UNIT, ((1.0,) * 8,)), r"extractor\.components"),
            (lambda: PrincipalComponents(UNIT, ((1.0,),), ("x",)), r"extractor\.normalisation .* of 1 channels"),
            (lambda: SelfOrganisingMap(UNIT, 1, 2, ((1.0,) * 9,) * 3), r"extractor\.units .* 2 rows of 9"),
        ],
    )
    def test_shapes_that_do_not_fit_together_are_refused(self, make, message):
        with pytest.raises(ConfigurationError, match=message):
            make()  # type: ignore[operator]

    @pytest.mark.parametrize(
        "value",
        [[[1.0, 2.0]], [[1.0, 2.0], [3.0]], [["a", "b"]] * 2, np.ones((2, 2, 2))],
    )
    def test_samples_refuses_other_shapes(self, value):
        with pytest.raises(ConfigurationError, match=r"perception\.samples = .* two or more rows of 2"):
            samples(value, 2)  # type: ignore[arg-type]


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

    @pytest.mark.parametrize("stage", [Thresholds.of(dict.fromkeys("abcd", (-1, 1))), PAPER])
    @pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
    @pytest.mark.parametrize("place", range(4))
    def test_what_is_not_finite_never_gets_a_symbol(self, stage, bad, place):
        features = [5.0] * 4  # outside the gate: even a feature that is not looked at must be sound
        features[place] = bad
        with pytest.raises(CommandError, match="features must be finite"):
            stage.symbol(tuple(features))

    @pytest.mark.parametrize(
        ("thresholds", "message"),
        [
            ({"x": ()}, r"symboliser\.thresholds"),
            ({"x": (1.0, 1.0)}, r"symboliser\.thresholds = .* rising numbers"),
            ({name: range(9) for name in "abcdef"}, r"symboliser\.thresholds = .* at most 100000 symbols"),
        ],
    )
    def test_unusable_thresholds_are_named(self, thresholds, message):
        with pytest.raises(ConfigurationError, match=message):
            Thresholds.of(thresholds)

    def test_thresholds_belong_to_features_and_a_gate_needs_a_middle_and_separate_ones(self):
        with pytest.raises(ConfigurationError, match="each of the 2 features"):
            Thresholds(("x", "y"), ((-1.0, 1.0),))
        with pytest.raises(ConfigurationError, match=r"symboliser\.outer = .* an even number of thresholds"):
            GatedThresholds.of({"x": (0.0,)}, {"tx": (-1, 1)})
        with pytest.raises(ConfigurationError, match="each only once"):
            GatedThresholds.of({"x": (-1, 1)}, {"x": (-1, 1)})

    def test_partition_is_the_same_for_the_same_seed_only(self):
        assert RandomPartition.draw(BOUNDS, 6, 1) == RandomPartition.draw(BOUNDS, 6, 1)
        assert RandomPartition.draw(BOUNDS, 6, 1) != RandomPartition.draw(BOUNDS, 6, 2)

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

    def test_more_clusters_than_different_samples_are_refused(self):
        with pytest.raises(ConfigurationError, match=r"symboliser\.clusters = 3 .* from 1 to 2"):
            Clusters.fit([(0.0, 1.0), (1.0, 1.0)] * 10, 3, 0, ("x", "y"))

    @pytest.mark.parametrize("bad", [math.nan, math.inf])
    def test_nothing_is_nearest_to_what_is_not_finite(self, bad):
        with pytest.raises(CommandError, match="features must be finite"):
            RandomPartition.draw(BOUNDS, 4, 0).symbol((0.0, bad))

    @pytest.mark.parametrize(
        ("bounds", "regions", "seed", "message"),
        [
            ({"x": (1.0, 1.0)}, 4, 0, r"symboliser\.bounds = .* a lower and a higher number"),
            ({"x": (0.0, 1.0)}, 4, -1, r"perception\.seed"),
        ],
    )
    def test_unusable_settings_are_named(self, bounds, regions, seed, message):
        with pytest.raises(ConfigurationError, match=message):
            RandomPartition.draw(bounds, regions, seed)

    def test_shapes_that_do_not_fit_together_are_refused(self):
        good = RandomPartition.draw(BOUNDS, 4, 0)
        with pytest.raises(ConfigurationError, match=r"symboliser\.normalisation = .* of 1 features"):
            RandomPartition(("x",), good.normalisation, good.prototypes)
        with pytest.raises(ConfigurationError, match=r"symboliser\.prototypes"):
            Clusters(good.features, good.normalisation, ((0.0,),))
