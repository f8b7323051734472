import math

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.ports import number, vector


@pytest.mark.parametrize("value", [True, "1", None, [1.0], math.nan, -math.inf, 10**400])
def test_number_refuses_what_is_no_finite_number(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"^here\.it = .* is refused: a finite number$"):
        number("here.it", value)


@pytest.mark.parametrize("value", ["12", {1: 2}, 5, [], [1.0], [1.0, 2.0, 3.0], [1.0, math.nan], [1.0, "2"]])
def test_vector_refuses_other_than_its_length_of_numbers(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"^f = .* a list of 2 finite numbers"):
        vector("f", value, 2)
