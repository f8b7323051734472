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


def test_both_are_close_in_single_precision() -> None:
    x = np.linspace(-59.0, 5.0, 20_001)
    assert (
        np.abs(exponential(x.astype(np.float32)) / np.exp(x.astype(np.float32).astype(np.float64)) - 1.0).max() < 5e-6
    )
    y = np.exp(np.linspace(-30.0, 30.0, 20_001)).astype(np.float32)
    assert np.abs(logarithm(y) - np.log(y.astype(np.float64))).max() < 3e-6
    assert exponential(np.array([-1e9], np.float32)) == pytest.approx([0.0], abs=1e-26)


def test_both_give_the_bytes_that_they_gave_before() -> None:
    # Of sums, products and powers of two alone: no processor may round them in another way.
    assert exponential(np.array([-0.1, -2.5, -33.3])).tobytes().hex() == EXPONENTIALS
    assert logarithm(np.array([0.1, 2.5, 33.3])).tobytes().hex() == LOGARITHMS
    assert exponential(np.array([-0.1, -2.5, -33.3], np.float32)).tobytes().hex() == SINGLE_EXPONENTIALS
    assert logarithm(np.array([0.1, 2.5, 33.3], np.float32)).tobytes().hex() == SINGLE_LOGARITHMS


EXPONENTIALS = "9922d5996df4ec3fb8615fc08503b53f949db5b95b16ef3c"
LOGARITHMS = "9521b5bbb16b02c07612e0f04052ed3fb27532ad610b0c40"
SINGLE_EXPONENTIALS = "6da3673f291ca83deab27827"
SINGLE_LOGARITHMS = "8e5d13c008926a3f0d5b6040"
