"""AALpy and automata-lib find the same minimal machines and the same differences."""

import random

import pytest

from tests.unit.core.automata.others import SORTS, CrossCheck, pair

PAIRS = {sort: 10 if sort == "large" else 80 for sort in SORTS}


@pytest.mark.parametrize("sort", SORTS)
def test_all_agree(sort):
    rng, check = random.Random(sort), CrossCheck()
    for _ in range(PAIRS[sort]):
        one, other = pair(rng, sort)
        check.machine(one)
        check.pair(one, other)
    assert check.disagreements == []
