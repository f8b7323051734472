import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception.symbols import Clusters, GatedThresholds, RandomPartition, Symboliser, Thresholds

MM = 1e-3
KGF_MM = 9.80665e-3
PAPER = GatedThresholds.of({"x": (-MM, MM), "y": (-MM, MM)}, {"tx": (-KGF_MM, KGF_MM), "ty": (-KGF_MM, KGF_MM)})


@settings(deadline=None)
@given(st.floats(-1e3, 1e3), st.lists(st.floats(0.1, 100.0), min_size=1, max_size=4, unique=True))
@example(-0.0, [0.5])
@example(0.5, [0.5])
def test_bands_are_mirrored_and_a_threshold_belongs_to_the_inner_one(value: float, sizes: list[float]) -> None:
    sizes.sort()
    stage = Thresholds.of({"x": [-t for t in reversed(sizes)] + sizes})
    last = len(stage.symbols) - 1
    assert stage.symbol((value,)) + stage.symbol((-value,)) == last
    assert stage.symbol((value,)) == len(sizes) + sum(value > t for t in sizes) - sum(value < -t for t in sizes)


def test_the_papers_seventeen_symbols_are_exactly_these_and_all_reachable() -> None:
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
def test_what_is_not_finite_never_gets_a_symbol(stage: Symboliser, bad: float, place: int) -> None:
    features = [5.0] * 4  # outside the gate: even a feature that is not looked at must be sound
    features[place] = bad
    with pytest.raises(CommandError, match="features must be finite"):
        stage.symbol(tuple(features))


@pytest.mark.parametrize(
    ("thresholds", "message"),
    [
        ({}, r"symboliser\.features"),
        ({"x": ()}, r"symboliser\.thresholds"),
        ({"x": (1.0, 1.0)}, r"symboliser\.thresholds = .* rising numbers"),
        ({"x": (1.0, -1.0)}, r"symboliser\.thresholds = .* rising numbers"),
        ({"x": (math.nan,)}, r"symboliser\.thresholds"),
        ({"x": ("1",)}, r"symboliser\.thresholds"),
        ({name: range(9) for name in "abcdef"}, r"symboliser\.thresholds = .* at most 100000 symbols"),
    ],
)
def test_unusable_thresholds_are_named(thresholds: dict[str, tuple[float, ...]], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Thresholds.of(thresholds)


def test_thresholds_belong_to_features_and_a_gate_needs_a_middle_and_separate_ones() -> None:
    with pytest.raises(ConfigurationError, match="each of the 2 features"):
        Thresholds(("x", "y"), ((-1.0, 1.0),))
    with pytest.raises(ConfigurationError, match=r"symboliser\.outer = .* an even number of thresholds"):
        GatedThresholds.of({"x": (0.0,)}, {"tx": (-1, 1)})
    with pytest.raises(ConfigurationError, match="each only once"):
        GatedThresholds.of({"x": (-1, 1)}, {"x": (-1, 1)})
    with pytest.raises(ConfigurationError, match=r"symboliser\.inner = .* 'thresholds'"):
        GatedThresholds(Thresholds.of({"x": (-1, 1)}), None)  # type: ignore[arg-type]


BOUNDS = {"x": (-5e-3, 5e-3), "fz": (-20.0, 0.0)}
CENTRES = np.array([[-2e-3, -10.0], [2e-3, -10.0], [2e-3, 0.0]])


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    """Three clouds, well apart only once the units are made comparable."""
    generator = np.random.default_rng(0)
    return np.concatenate([centre + generator.normal(size=(400, 2)) * (2e-4, 0.5) for centre in CENTRES])


def test_a_partition_is_the_same_for_the_same_seed_only() -> None:
    assert RandomPartition.draw(BOUNDS, 6, 1) == RandomPartition.draw(BOUNDS, 6, 1)
    assert RandomPartition.draw(BOUNDS, 6, 1) != RandomPartition.draw(BOUNDS, 6, 2)


def test_the_prototypes_lie_inside_the_bounds_and_own_themselves() -> None:
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


def test_no_feature_outweighs_another_by_its_unit() -> None:
    in_m = RandomPartition.draw(BOUNDS, 8, 4)
    in_mm = RandomPartition.draw({"x": (-5.0, 5.0), "fz": (-20.0, 0.0)}, 8, 4)
    points = np.random.default_rng(1).uniform((-5e-3, -20.0), (5e-3, 0.0), (200, 2)).tolist()
    symbols = [in_m.symbol((x, fz)) for x, fz in points]
    assert symbols == [in_mm.symbol((1e3 * x, fz)) for x, fz in points]
    assert set(symbols) == set(range(8))


def test_clusters_find_the_clouds_in_reading_order(table: np.ndarray) -> None:
    stage = Clusters.fit(table, 3, 0, ("x", "fz"))
    assert stage.symbols == ("cluster 0", "cluster 1", "cluster 2")
    found = np.array(stage.prototypes) / stage.normalisation.gain + stage.normalisation.offset
    order = [0, *(1 + np.argsort(found[1:, 1]))]
    np.testing.assert_allclose(found[order], CENTRES, atol=0.1)
    np.testing.assert_allclose(found[order, 0], CENTRES[:, 0], atol=1e-4)
    assert np.all(np.diff(found[:, 0]) >= 0)
    labels = [stage.symbol(tuple(row)) for row in table.tolist()]
    assert [len(set(labels[i : i + 400])) for i in (0, 400, 800)] == [1, 1, 1]
    assert len(set(labels)) == 3


def test_clusters_are_the_same_bit_for_bit_for_the_same_seed(table: np.ndarray) -> None:
    cloud = np.random.default_rng(5).normal(size=(2000, 2))
    assert Clusters.fit(cloud, 7, 3, ("a", "b")) == Clusters.fit(cloud, 7, 3, ("a", "b"))


def test_more_clusters_than_different_samples_are_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"symboliser\.clusters = 3 .* from 1 to 2"):
        Clusters.fit([(0.0, 1.0), (1.0, 1.0)] * 10, 3, 0, ("x", "y"))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_nothing_is_nearest_to_what_is_not_finite(bad: float) -> None:
    with pytest.raises(CommandError, match="features must be finite"):
        RandomPartition.draw(BOUNDS, 4, 0).symbol((0.0, bad))


@pytest.mark.parametrize(
    ("bounds", "regions", "seed", "message"),
    [
        ({}, 4, 0, r"symboliser\.bounds"),
        ({"x": (1.0, 1.0)}, 4, 0, r"symboliser\.bounds = .* a lower and a higher number"),
        ({"x": (0.0, math.inf)}, 4, 0, r"symboliser\.bounds\.x"),
        ({"x": (0.0, 1.0)}, 1, 0, r"symboliser\.regions"),
        ({"x": (0.0, 1.0)}, 4, -1, r"perception\.seed"),
    ],
)
def test_unusable_settings_are_named(
    bounds: dict[str, tuple[float, float]], regions: int, seed: int, message: str
) -> None:
    with pytest.raises(ConfigurationError, match=message):
        RandomPartition.draw(bounds, regions, seed)


def test_shapes_that_do_not_fit_together_are_refused() -> None:
    good = RandomPartition.draw(BOUNDS, 4, 0)
    with pytest.raises(ConfigurationError, match=r"symboliser\.normalisation = .* of 1 features"):
        RandomPartition(("x",), good.normalisation, good.prototypes)
    with pytest.raises(ConfigurationError, match=r"symboliser\.prototypes"):
        Clusters(good.features, good.normalisation, ((0.0,),))
