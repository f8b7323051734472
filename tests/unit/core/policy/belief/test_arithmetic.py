"""Exponential and logarithm that round the same everywhere."""

import numpy as np
import pytest

from palpate.core.policy.belief.arithmetic import exponential, logarithm


def test_the_exponential_is_close_to_numpys() -> None:
    x = np.linspace(-690.0, 5.0, 20_001)
    assert np.abs(exponential(x) / np.exp(x) - 1.0).max() < 2e-7


def test_what_is_far_below_zero_is_nothing_and_no_error() -> None:
    assert exponential(np.array([-1e9, -701.0])) == pytest.approx([0.0, 0.0], abs=1e-300)


def test_the_logarithm_is_close_to_numpys() -> None:
    x = np.exp(np.linspace(-60.0, 60.0, 20_001))
    assert np.abs(logarithm(x) - np.log(x)).max() < 2e-7


def test_both_give_the_bytes_that_they_gave_before() -> None:
    # Of sums, products and powers of two alone: no processor may round them in another way.
    assert exponential(np.array([-0.1, -2.5, -33.3])).tobytes().hex() == EXPONENTIALS
    assert logarithm(np.array([0.1, 2.5, 33.3])).tobytes().hex() == LOGARITHMS


EXPONENTIALS = "9922d5996df4ec3fb8615fc08503b53f949db5b95b16ef3c"
LOGARITHMS = "9521b5bbb16b02c07612e0f04052ed3fb27532ad610b0c40"
