import json
from dataclasses import asdict

import pytest

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, compass_actions
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.sarsa import SarsaParameters
from palpate.core.policy.tabular import QParameters

NAMES = ["go", "stay"]
LEARNED = TableRow.of("a", "learned", "stay", 1, (-2.0, -0.5), (3, 4))
PROGRAMMED = TableRow.of("a", "programmed", "go", 0)
LEARNER = LearnerEntry(
    QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(5.0, 0.96, 0.1), alpha_visits=20.0), 7
)


def read_row(content, *, has_learner):
    row = TableRow.read(json.loads(json.dumps(content)), "row")
    row.require_consistent("row", NAMES, has_learner)
    return row


def test_an_action_is_written_in_millimetres():
    assert ActionEntry.of(Action("go", (0.001, -0.0025))) == ActionEntry("go", (1.0, -2.5))
    assert [ActionEntry.of(a).name for a in compass_actions(0.001, 2)] == ["0deg", "180deg"]


@pytest.mark.parametrize(
    ("row", "value", "visits"),
    [
        (LEARNED, -0.5, 7),
        (PROGRAMMED, None, 0),
        (
            TableRow.of("a", "programmed", "go", 0, (-2.0, -0.5), (3, 4)),
            -2.0,
            7,
        ),  # the assigned action's, not the best
    ],
)
def test_value_and_visits_follow_from_the_row_and_it_reads_back(row, value, visits):
    assert (row.value, row.visits) == (value, visits)
    assert read_row(asdict(row), has_learner=row.q is not None) == row


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
    with pytest.raises(ConfigurationError) as refused:
        read_row(asdict(LEARNED) | change, has_learner=True)
    assert refused.value.field == f"row.{field}"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"source": "learned"}, "source"),
        ({"q": [0.0, 0.0]}, "q"),
        ({"visits_per_action": [0, 0]}, "visits_per_action"),
        ({"value": 0.0}, "value"),
        ({"visits": False}, "visits"),
    ],
)
def test_without_a_learner_nothing_was_learned(change, field):
    with pytest.raises(ConfigurationError) as refused:
        read_row(asdict(PROGRAMMED) | change, has_learner=False)
    assert refused.value.field == f"row.{field}"


@pytest.mark.parametrize("alpha_visits", [20.0, 0.0])
def test_the_learner_reads_back(alpha_visits):
    learner = LearnerEntry(
        QParameters(alpha=0.1, gamma=0.9, temperature=TemperatureSchedule(10.0, 0.97, 0.3), alpha_visits=alpha_visits),
        120,
    )
    assert LearnerEntry.read(json.loads(json.dumps(learner.content()))) == learner


def test_sarsa_reads_back_with_its_traces():
    schedule = TemperatureSchedule(10.0, 0.97, 0.3)
    learner = LearnerEntry(SarsaParameters(alpha=0.1, gamma=0.9, temperature=schedule, trace_decay=0.75), 120)
    content = json.loads(json.dumps(learner.content()))
    assert (content["kind"], content["trace_decay"]) == ("sarsa", 0.75)
    assert LearnerEntry.read(content) == learner
    with pytest.raises(ConfigurationError, match=r"learner\.trace_decay"):
        LearnerEntry.read(content | {"trace_decay": 1.5})


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"kind": "r-max"}, "kind"),
        ({"kind": ["sarsa"]}, "kind"),
        ({"alpha": 0.0}, "alpha"),
        ({"alpha": None}, "alpha"),
        ({"gamma": 2.0}, "gamma"),
        ({"alpha_visits": 0.0}, "alpha_visits"),
        ({"alpha_floor": 0.5}, "alpha_floor"),
        ({"initial_value": "0"}, "initial_value"),
        ({"trials_learned": 1.5}, "trials_learned"),
        ({"temperature": 5.0}, "temperature"),
        ({"temperature": {"initial": 5.0, "decay": 2.0, "floor": 0.1}}, "temperature.decay"),
        ({"temperature": {"initial": 5.0, "decay": 1.0, "floor": None}}, "temperature.floor"),
    ],
)
def test_a_learner_with_settings_out_of_range_is_refused(change, field):
    with pytest.raises(ConfigurationError) as refused:
        LearnerEntry.read(LEARNER.content() | change)
    assert refused.value.field == f"learner.{field}"
