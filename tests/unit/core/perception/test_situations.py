"""Situations of a peg with corners, told apart by what the task adds to the nine channels."""

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.perception import (
    FACTS,
    IdentityState,
    Perception,
    Situations,
    TaskFacts,
    perception_from_dict,
    perception_to_dict,
)

NINE = (0.0,) * 9
CORNERS = Perception(TaskFacts(FACTS), Situations(), IdentityState(Situations.symbols))


@pytest.mark.parametrize(
    ("facts", "situation"),
    [
        ((0.0, -1.0, -1.0, 0.0, 0.0), "upright in the air"),
        ((0.1, 0.0, 0.0, 0.0, 0.0), "upright on the plate"),
        ((0.0, 1.2, 1.2, 0.0, 0.0), "upright in the hole"),
        ((1.0, -1.0, -3.0, 0.0, 0.0), "leaning in the air"),
        ((1.0, 0.8, -1.8, 0.0, 0.0), "leaning on the plate"),
        ((1.0, 2.0, 1.2, 0.9, 0.0), "corner turning"),
        ((1.0, 2.0, 1.2, 2.0, -1.2), "corner turning"),
        ((1.0, 2.0, 0.9, 2.0, 0.0), "corner wedged"),
        ((1.0, 2.0, 1.2, 2.0, 0.0), "corner caught"),
    ],
)
def test_situations_are_told_apart_by_lean_depth_walls_and_torque(facts: tuple[float, ...], situation: str) -> None:
    assert CORNERS.symbols[CORNERS.observe(NINE + facts)[0]] == situation


def test_they_come_back_from_a_file_with_their_thresholds() -> None:
    finer = Perception(TaskFacts(FACTS), Situations(caught=2.0), CORNERS.identifier)
    assert perception_from_dict(perception_to_dict(finer)) == finer
    with pytest.raises(ConfigurationError, match=r"symboliser\.wall"):
        Situations(wall=float("nan"))


def test_where_the_task_adds_nothing_the_facts_are_zeros() -> None:
    assert TaskFacts(("lean", "depth")).extract(NINE) == (0.0, 0.0)
