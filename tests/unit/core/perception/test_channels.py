import numpy as np
import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.perception.channels import samples


@pytest.mark.parametrize(
    "value",
    [[], [[1.0, 2.0]], [[1.0], [2.0]], [[1.0, 2.0], [3.0]], [["a", "b"]] * 2, [1.0, 2.0], np.ones((2, 2, 2))],
)
def test_samples_refuses_other_shapes(value: object) -> None:
    with pytest.raises(ConfigurationError, match=r"perception\.samples = .* two or more rows of 2"):
        samples(value, 2)  # type: ignore[arg-type]
