import numpy as np
import pytest
from sklearn.preprocessing import StandardScaler

from palpate.core.errors import ConfigurationError
from palpate.core.perception.signal import Normalisation


def test_fit_agrees_with_scikit_learn() -> None:
    table = np.random.default_rng(1).normal([5.0, -3e-3, 100.0], [1e-3, 2.0, 1e4], size=(200, 3))
    fitted = Normalisation.fit(table)
    np.testing.assert_allclose(fitted.apply(table), StandardScaler().fit_transform(table), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("constant", [0.0, 0.1, -1e9])
def test_a_constant_channel_keeps_its_unit(constant: float) -> None:
    # The mean of equal decimals is off by rounding; a gain made from that would be astronomic.
    fitted = Normalisation.fit([(constant, float(i)) for i in range(7)])
    assert fitted.gain[0] == 1.0
    assert fitted.apply([constant, 3.0]) == pytest.approx([0.0, 0.0], abs=1e-6)


def test_equal_numbers_are_equal_objects_whatever_sequence_they_came_in() -> None:
    assert Normalisation([1, 2], np.array([3.0, 4.0])) == Normalisation((1.0, 2.0), (3.0, 4.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("offset", "gain", "message"),
    [
        ((0.0,), (0.0,), r"perception\.normalisation\.gain = .* other than zero"),
        ((0.0, 1.0), (1.0,), r"perception\.normalisation\.gain = .* 2 finite numbers"),
        ((), (), r"perception\.normalisation\.offset"),
        ((float("nan"),), (1.0,), r"perception\.normalisation\.offset"),
    ],
)
def test_unusable_numbers_are_refused(offset: tuple[float, ...], gain: tuple[float, ...], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Normalisation(offset, gain)
