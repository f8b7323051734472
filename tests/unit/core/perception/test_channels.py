import math

import numpy as np
import pytest

from palpate.core.errors import CommandError, ConfigurationError
from palpate.core.perception import channels as checks


@pytest.mark.parametrize("value", [True, "1", None, [1.0], math.nan, -math.inf, 10**400])
def test_number_refuses_what_is_no_finite_number(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"^here\.it = .* is refused: a finite number$"):
        checks.number("here.it", value)


@pytest.mark.parametrize("value", [True, 2.0, "2", 0, 5])
def test_integer_refuses_other_types_and_values_out_of_range(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"f = .* a whole number from 1 to 4"):
        checks.integer("f", value, 1, 4)


@pytest.mark.parametrize("value", ["12", {1: 2}, 5, [], [1.0], [1.0, 2.0, 3.0], [1.0, math.nan], [1.0, "2"]])
def test_vector_refuses_other_than_its_length_of_numbers(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"^f = .* a list of 2 finite numbers"):
        checks.vector("f", value, 2)


@pytest.mark.parametrize("value", ["ab", [], [[1.0]], [[1.0, 2.0], [1.0]], [1.0, 2.0], 3])
def test_matrix_refuses_other_shapes(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"^f = "):
        checks.matrix("f", value, 2)


def test_matrix_counts_rows_where_asked() -> None:
    assert checks.matrix("f", np.eye(2), 2, rows=2) == ((1.0, 0.0), (0.0, 1.0))
    with pytest.raises(ConfigurationError, match="3 rows of 2"):
        checks.matrix("f", np.eye(2), 2, rows=3)


@pytest.mark.parametrize("value", ["ab", [], ["a", "a"], ["a", ""], ["a", 1], None])
def test_names_refuses_none_doubles_and_what_is_no_text(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"each only once|a list of names"):
        checks.names("f", value)


def test_names_says_what_it_knows() -> None:
    assert checks.names("f", ["b", "a"], ("a", "b", "c")) == ("b", "a")
    with pytest.raises(ConfigurationError, match="out of a, b, c"):
        checks.names("f", ["d"], ("a", "b", "c"))


@pytest.mark.parametrize(
    "value",
    [[], [[1.0, 2.0]], [[1.0], [2.0]], [[1.0, 2.0], [3.0]], [["a", "b"]] * 2, [1.0, 2.0], np.ones((2, 2, 2))],
)
def test_samples_refuses_other_shapes(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.samples = .* two or more rows of 2"):
        checks.samples(value, 2)  # type: ignore[arg-type]


def test_samples_refuses_nan_and_empty_rows() -> None:
    with pytest.raises(ConfigurationError, match="not finite"):
        checks.samples([[1.0, math.nan], [1.0, 1.0]], 2)
    with pytest.raises(ConfigurationError, match="equally many"):
        checks.samples([[], []])


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_require_finite(bad: float) -> None:
    checks.require_finite("a thing", (0.0, -1e300))
    with pytest.raises(CommandError, match="a thing must be finite"):
        checks.require_finite("a thing", (0.0, bad))
