import json
from dataclasses import asdict

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.entries import TableRow

NAMES = ["go", "stay"]
LEARNED = TableRow.of("a", "learned", "stay", 1, (-2.0, -0.5), (3, 4))
PROGRAMMED = TableRow.of("a", "programmed", "go", 0)


def read_row(content, *, has_learner):
    row = TableRow.read(json.loads(json.dumps(content)), "row")
    row.require_consistent("row", NAMES, has_learner)


def refused(row, change, *, has_learner):
    """The field by which a row is refused."""
    with pytest.raises(ConfigurationError) as caught:
        read_row(asdict(row) | change, has_learner=has_learner)
    return caught.value.field


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"source": "guessed"}, "source"),
        ({"action": "fly"}, "action"),
        ({"action": "go", "value": -2.0}, "action"),  # not the best one
        ({"value": -0.25}, "value"),
        ({"value": None}, "value"),
        ({"visits": 8}, "visits"),
        ({"q": [-2.0]}, "q"),
        ({"q": None}, "q"),
        ({"q": [-2.0, "x"]}, "q[1]"),
        ({"visits_per_action": [3, -4]}, "visits_per_action[1]"),
        ({"visits_per_action": [3, 4, 0]}, "visits_per_action"),
    ],
)
def test_a_row_that_is_wrong_or_contradicts_itself_is_refused(change, field):
    assert refused(LEARNED, change, has_learner=True) == f"row.{field}"


@pytest.mark.parametrize(
    "change",
    [{"source": "learned"}, {"q": [0.0, 0.0]}, {"visits_per_action": [0, 0]}, {"value": 0.0}, {"visits": False}],
)
def test_without_a_learner_nothing_was_learned(change):
    assert refused(PROGRAMMED, change, has_learner=False) == f"row.{next(iter(change))}"
