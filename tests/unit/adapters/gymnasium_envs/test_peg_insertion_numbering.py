"""Episodes after a seed are its trials in order, whatever happened before."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from palpate.adapters.gymnasium_envs.peg_insertion import Numbering
from palpate.core.errors import ConfigurationError


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def test_the_episodes_of_a_seed_are_its_trials_in_order() -> None:
    numbering = Numbering()
    seen = []
    for seed in (5, None, None, 9, None, 5):
        seen.append(numbering.next(seed, None, rng()))
        numbering.passed(seen[-1][1])
    assert seen == [(5, 0), (5, 1), (5, 2), (9, 0), (9, 1), (5, 0)]


def test_a_trial_may_be_named_and_those_after_it_follow() -> None:
    numbering = Numbering()
    assert numbering.next(5, {"trial": 7}, rng()) == (5, 7)
    numbering.passed(8)  # the seventh had no decision
    assert numbering.next(None, {}, rng()) == (5, 9)
    assert numbering.next(None, {"trial": 0}, rng()) == (5, 0)


def test_without_any_seed_one_is_drawn_once() -> None:
    numbering, generator = Numbering(), rng()
    drawn, trial = numbering.next(None, None, generator)
    numbering.passed(trial)
    assert trial == 0
    assert numbering.next(None, None, generator) == (drawn, 1)
    assert Numbering().next(None, None, generator)[0] != drawn


@pytest.mark.parametrize(
    ("seed", "options", "message"),
    [
        (None, {"tria": 1}, "options.tria = 1 is refused: no such option; there is trial"),
        (None, {"trial": -1}, "options.trial = -1 is refused: a whole number from 0"),
        (None, {"trial": 1.5}, "options.trial = 1.5 is refused"),
        (None, 5, "options = 5 is refused: a table such as"),
        (2**63, None, "seed = 9223372036854775808 is refused"),
    ],
)
def test_what_is_refused_changes_nothing(seed: int | None, options: Any, message: str) -> None:
    numbering = Numbering()
    numbering.next(4, None, rng())
    numbering.passed(0)
    with pytest.raises(ConfigurationError) as caught:
        numbering.next(seed, options, rng())
    assert str(caught.value).startswith(message)
    assert numbering.next(None, None, rng()) == (4, 1)
