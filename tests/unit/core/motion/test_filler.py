"""An array that is filled from floats."""

import struct

import numpy as np
import pytest

from palpate.core.motion import filler


def test_sets_every_bit_and_nothing_beside_it() -> None:
    whole = np.full(5, 7.0)
    values = -0.0, 0.1, 1e-310
    filler(whole[1:4])(*values)
    assert whole.tobytes() == np.array([7.0, *values, 7.0]).tobytes()


@pytest.mark.parametrize("count", [2, 4])
def test_refuses_another_number_of_floats(count: int) -> None:
    with pytest.raises(struct.error):
        filler(np.zeros(3))(*[1.0] * count)
