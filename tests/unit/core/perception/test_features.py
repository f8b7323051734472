import math

import numpy as np
import pytest
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import Normalisation, PrincipalComponents, SelectedChannels, SelfOrganisingMap
from palpate.core.perception.signal import samples

SIGNAL = tuple(float(i) for i in range(9))
UNIT = Normalisation((0.0,) * 9, (1.0,) * 9)


@pytest.fixture(scope="module")
def table() -> np.ndarray:
    """Nine channels of unlike units that hang together through three causes."""
    generator = np.random.default_rng(3)
    causes = generator.normal(size=(300, 3)) * (3.0, 2.0, 1.0)
    mixed = causes @ generator.normal(size=(3, 9)) + 0.1 * generator.normal(size=(300, 9))
    scaled: np.ndarray = mixed * np.array([1e-3] * 3 + [5.0] * 3 + [1e-2] * 3)
    return scaled


def test_selected_channels_come_in_the_order_asked_for() -> None:
    extractor = SelectedChannels(("tx", "x", "fz"))
    assert extractor.extract(SIGNAL) == (6.0, 0.0, 5.0)
    assert extractor.names == ("tx", "x", "fz")
    assert SelectedChannels(("y",)).extract(SIGNAL) == (1.0,)


@pytest.mark.parametrize("channels", [("x", "roll"), ("x", "x"), (), "x"])
def test_unknown_doubled_or_no_channels_are_refused(channels: tuple[str, ...]) -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.extractor\.channels = .* out of x, y, z, fx"):
        SelectedChannels(channels)


def test_principal_components_agree_with_scikit_learn(table: np.ndarray) -> None:
    fitted = PrincipalComponents.fit(table, 3)
    oracle = make_pipeline(StandardScaler(), PCA(3, svd_solver="full")).fit_transform(table)
    ours = np.array([fitted.extract(tuple(row)) for row in table.tolist()])
    np.testing.assert_allclose(ours, oracle, atol=1e-10)
    assert fitted.names == ("pc1", "pc2", "pc3")


def test_principal_components_may_look_at_some_channels_only(table: np.ndarray) -> None:
    fitted = PrincipalComponents.fit(table, 2, channels=("tx", "fy", "z"))
    oracle = make_pipeline(StandardScaler(), PCA(2, svd_solver="full")).fit_transform(table[:, [6, 4, 2]])
    ours = [fitted.extract(tuple(row)) for row in table.tolist()]
    np.testing.assert_allclose(ours, oracle, atol=1e-10)


@pytest.mark.parametrize("components", [0, 10, 2.0])
def test_components_out_of_range_are_refused(table: np.ndarray, components: int) -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.extractor\.components .* from 1 to 9"):
        PrincipalComponents.fit(table, components)


def test_a_map_is_the_same_for_the_same_seed_only(table: np.ndarray) -> None:
    def fit(seed: int) -> SelfOrganisingMap:
        return SelfOrganisingMap.fit(table, 3, 4, seed, iterations=300)

    state = np.random.get_state()  # noqa: NPY002 - the point is that nobody touches it
    first = fit(7)
    assert first == fit(7)
    assert first != fit(8)
    after = np.random.get_state()  # noqa: NPY002
    assert np.array_equal(state[1], after[1])


def test_a_map_finds_the_best_matching_unit(table: np.ndarray) -> None:
    fitted = SelfOrganisingMap.fit(table, 3, 4, 1, iterations=500)
    assert fitted.names == ("som_row", "som_column")
    normal = (table - table.mean(axis=0)) / table.std(axis=0)
    grid = np.array(fitted.units).reshape(3, 4, 9)
    for row, inputs in zip(table.tolist(), normal, strict=True):
        distance = np.linalg.norm(grid - inputs, axis=2)
        assert fitted.extract(tuple(row)) == np.unravel_index(distance.argmin(), (3, 4))
    used = {fitted.extract(tuple(row)) for row in table.tolist()}
    assert len(used) == 12


def test_training_brings_the_units_nearer_to_the_samples(table: np.ndarray) -> None:
    def error(iterations: int) -> float:
        fitted = SelfOrganisingMap.fit(table, 4, 4, 1, iterations=iterations)
        inputs = fitted.normalisation.apply(table)
        apart = np.linalg.norm(inputs[:, None, :] - np.array(fitted.units), axis=2)
        return float(apart.min(axis=1).mean())

    assert error(3000) < 0.8 * error(1)


def test_nothing_is_nearest_to_nan() -> None:
    fitted = SelfOrganisingMap(UNIT, 1, 2, ((0.0,) * 9, (1.0,) * 9))
    for bad in (math.nan, math.inf):
        with pytest.raises(CommandError, match="finite"):
            fitted.extract((*SIGNAL[:8], bad))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rows": 0}, r"perception\.extractor\.rows"),
        ({"rows": 1, "columns": 1}, r"perception\.extractor\.rows = 1 .* two units or more"),
        ({"columns": 2.5}, r"perception\.extractor\.columns"),
        ({"seed": -1}, r"perception\.seed"),
        ({"iterations": 0}, r"perception\.iterations"),
        ({"channels": ("up",)}, r"perception\.extractor\.channels"),
    ],
)
def test_unusable_map_settings_are_named(table: np.ndarray, change: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        SelfOrganisingMap.fit(table, **{"rows": 2, "columns": 2, "seed": 0, **change})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PrincipalComponents(UNIT, ((1.0,) * 8,)), r"extractor\.components"),
        (lambda: PrincipalComponents(UNIT, ((1.0,),), ("x",)), r"extractor\.normalisation .* of 1 channels"),
        (lambda: PrincipalComponents(None, ((1.0,) * 9,)), r"extractor\.normalisation"),  # type: ignore[arg-type]
        (lambda: SelfOrganisingMap(UNIT, 1, 2, ((1.0,) * 9,) * 3), r"extractor\.units .* 2 rows of 9"),
    ],
)
def test_shapes_that_do_not_fit_together_are_refused(make: object, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        make()  # type: ignore[operator]


@pytest.mark.parametrize(
    "value",
    [[], [[1.0, 2.0]], [[1.0], [2.0]], [[1.0, 2.0], [3.0]], [["a", "b"]] * 2, [1.0, 2.0], np.ones((2, 2, 2))],
)
def test_samples_refuses_other_shapes(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.samples = .* two or more rows of 2"):
        samples(value, 2)  # type: ignore[arg-type]
