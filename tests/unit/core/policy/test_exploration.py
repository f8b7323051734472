from math import isfinite, nan

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.special import softmax
from scipy.stats import chisquare

from palpate.core.policy.exploration import GREEDY_BELOW, TemperatureSchedule, boltzmann, boltzmann_probabilities
from tests.unit.core.policy.bench import refuse

finite = st.floats(allow_nan=False, allow_infinity=False)
rows = st.lists(finite, min_size=1, max_size=12)


class CountingGenerator(np.random.Generator):
    def __init__(self, number: float | None = None) -> None:
        super().__init__(np.random.PCG64(1))
        self.draws, self.number = 0, number

    def random(self, *args, **kwargs):
        self.draws += 1
        drawn = super().random(*args, **kwargs)
        return drawn if self.number is None else self.number


@given(st.lists(st.floats(-50.0, 50.0), min_size=1, max_size=12), st.floats(0.01, 100.0))
def test_probabilities_are_those_of_softmax(values, temperature):
    expected = softmax(np.array(values) / temperature)
    assert boltzmann_probabilities(values, temperature) == pytest.approx(expected, rel=1e-9, abs=1e-300)


@given(rows, st.floats(0.0, 1e300))
def test_probabilities_are_a_distribution_for_any_finite_values(values, temperature):
    probabilities = boltzmann_probabilities(values, temperature)
    assert all(isfinite(p) and 0.0 <= p <= 1.0 for p in probabilities)
    assert sum(probabilities) == pytest.approx(1.0)
    assert probabilities[values.index(max(values))] == max(probabilities)


def test_near_zero_the_best_actions_share_the_probability():
    values = [-1.0, -1.0 - 1e-9, -1.0, -5.0]
    assert boltzmann_probabilities(values, 0.5 * GREEDY_BELOW) == [0.5, 0.0, 0.5, 0.0]


def test_choices_have_the_frequencies_of_the_probabilities():
    values, temperature, n = [0.0, -1.0, -2.0, -0.5], 1.3, 20_000
    rng = np.random.default_rng(11)
    counts = np.bincount([boltzmann(values, temperature, rng) for _ in range(n)], minlength=4)
    assert chisquare(counts, n * softmax(np.array(values) / temperature)).pvalue > 0.01


@given(rows, st.sampled_from([0.0, 1e-7, 1e-6, 0.5, 1e9]))
def test_every_choice_takes_exactly_one_number(values, temperature):
    rng, twin = CountingGenerator(), np.random.Generator(np.random.PCG64(1))
    index = boltzmann(values, temperature, rng)
    twin.random()
    assert rng.draws == 1
    assert rng.bit_generator.state == twin.bit_generator.state
    assert 0 <= index < len(values)


@given(rows, st.floats(0.0, 10.0), st.sampled_from([0.0, 0.5, 1.0 - 2.0**-53]))
def test_an_impossible_action_is_never_chosen_not_even_at_the_ends(values, temperature, number):
    index = boltzmann(values, temperature, CountingGenerator(number))
    assert boltzmann_probabilities(values, temperature)[index] > 0.0


@given(st.floats(0.0, 1e6), st.floats(1e-3, 1.0), st.floats(0.0, 1e6), st.integers(0, 10**6))
def test_the_schedule_is_geometric_above_its_floor(initial, decay, floor, trial):
    assume(floor <= initial)
    schedule = TemperatureSchedule(initial, decay, floor)
    assert schedule.at(0) == initial
    assert schedule.at(trial) == max(floor, initial * decay**trial)
    assert floor <= schedule.at(trial + 1) <= schedule.at(trial)


@pytest.mark.parametrize("floor", [1.1, nan])
def test_a_floor_above_the_beginning_is_refused(floor):
    refuse("policy.temperature.floor", TemperatureSchedule, 1.0, 0.9, floor)
