import json
from dataclasses import replace
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, Law, Spatial, compass_actions
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.file import PolicyDocument
from palpate.core.policy.tabular import QParameters
from palpate.core.ports.settings import Range
from tests.unit.core.json_changes import put, remove, repeat, require_refused

ACTIONS = compass_actions(0.001)
STATES = ("a", "b")

numbers = st.floats(allow_nan=False, allow_infinity=False) | st.sampled_from([-0.0, 5e-324, -5e-324, -1e308])


def document(q=(0.0,) * 8, visits=(0,) * 8, learner=True, **settings) -> PolicyDocument:
    best = q.index(max(q))
    first = TableRow.of("a", "learned", ACTIONS[best].name, best, tuple(q), tuple(visits))
    second = TableRow.of("b", "programmed", "-x", 4, tuple(q), tuple(visits))
    parameters = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(5.0, 0.96, 0.1))
    if not learner:
        first, second = (TableRow.of(r.state, "examples", r.action, 0) for r in (first, second))
    made = PolicyDocument(
        created_with={"palpate": "0.1.0"},
        perception={"thresholds_mm": [-1.0, 1.0]},
        states=STATES,
        actions=tuple(ActionEntry.of(action) for action in ACTIONS),
        table=(first, second),
        learner=LearnerEntry(parameters, 12) if learner else None,
    )
    return replace(made, **settings) if settings else made


def content(**settings):
    return json.loads(document(**settings).to_json_text())


@given(st.lists(numbers, min_size=8, max_size=8), st.lists(st.integers(0, 10**9), min_size=8, max_size=8))
def test_a_file_reads_back_to_the_bit(q, visits):
    made = document(tuple(q), tuple(visits))
    text = made.to_json_text()
    read = PolicyDocument.from_json_text(text)
    assert read == made
    assert [value.hex() for value in read.table[0].q] == [value.hex() for value in q]
    assert read.to_json_text() == text


def test_the_file_looks_as_documented():
    made = content()
    assert made["schema"] == "palpate.policy/3"
    assert list(made) == ["schema", "created_with", "perception", "states", "actions", "table", "learner"]
    assert made["actions"][2] == {"name": "+y", "displacement_mm": [0.0, 1.0], "spatial": None}
    assert set(made["table"][0]) == {"state", "source", "action", "value", "visits", "q", "visits_per_action"}
    assert list(made["learner"]) == ["kind", "parameters", "trials_learned"]
    assert made["learner"]["kind"] == "q-learning"


def _ends(mark):
    if not isinstance(mark, Range):
        return {}
    low, high = "exclusiveMinimum" if mark.above else "minimum", "exclusiveMaximum" if mark.below else "maximum"
    return {key: end for key, end in ((low, mark.low), (high, mark.high)) if -inf < end < 1e6}


BAD_FILES = [
    (remove("schema"), "schema"),
    (put("schema", "palpate.policy/2"), "schema"),
    (put("schema", "palpate.run/1"), "schema"),
    *[(remove(key), "policy file") for key in ("created_with", "perception", "states", "actions", "table", "learner")],
    (put("comment", "hello"), "policy file"),
    (put("created_with", None), "created_with"),
    (put("perception", []), "perception"),
    (put("states", "ab"), "states"),
    (put("states", []), "states"),
    (put("states", 0, 1), "states[0]"),
    (put("states", 0, ""), "states[0]"),
    (repeat("states"), "states[2]"),
    (put("actions", []), "actions"),
    (put("actions", 0, "+x"), "actions[0]"),
    (put("actions", 0, "displacement_mm", [1.0]), "actions[0].displacement_mm"),
    (put("actions", 0, "displacement_mm", ["1", 0.0]), "actions[0].displacement_mm[0]"),
    (remove("actions", 3, "name"), "actions[3]"),
    (put("table", {}), "table"),
    (remove("table", 1, "q"), "table[1]"),
    (put("table", 1, "comment", ""), "table[1]"),
    (put("table", 0, "source", "magic"), "table[0].source"),
    (put("table", 0, "q", 2, "x"), "table[0].q[2]"),
    (put("table", 0, "visits_per_action", 0, -1), "table[0].visits_per_action[0]"),
    (put("learner", "q-learning"), "learner"),
    (put("learner", "kind", "r-max"), "learner.kind"),
    (remove("learner", "kind"), "learner"),
    (put("learner", "trials_learned", -1), "learner.trials_learned"),
    (put("learner", "parameters", "alpha", 0), "learner.parameters.alpha"),
    (put("learner", "parameters", "alpha_visits", None), "learner.parameters.alpha_visits"),
    (remove("learner", "parameters", "temperature", "floor"), "learner.parameters.temperature"),
    (put("learner", "kind", "sarsa"), "learner.parameters"),
    (put("learner", "parameters", "trace_decay", 0.9), "learner.parameters"),
    (repeat("actions"), "actions[8]"),
    (put("states", 0, "a\nb"), "states[0]"),
    (put("actions", 0, "displacement_mm", [10**400, 0.0]), "actions[0].displacement_mm[0]"),
    (repeat("table"), "table[2].state"),
    (put("table", 1, "state", "c"), "table[1].state"),
    (remove("table", 1), "table"),
    (put("table", []), "table"),
    (put("table", 0, "action", "up"), "table[0].action"),
    (put("learner", None), "table[0].source"),
    (put("learner", "parameters", "temperature", "floor", 9.0), "learner.parameters.temperature.floor"),
]


@pytest.mark.parametrize(("change", "field"), BAD_FILES)
def test_every_bad_file_is_one_clear_line(tmp_path, change, field):
    made = content()
    change(made)
    require_refused(PolicyDocument.load, tmp_path / "policy.json", made, field)


@pytest.mark.parametrize(
    ("states", "actions", "field", "accepted"),
    [
        (("a", "c"), ACTIONS, "states[1]", "'c'"),
        (("b", "a"), ACTIONS, "states[0]", "'b'"),
        (("a", "b", "c"), ACTIONS, "states", "3 of them"),
        (("a",), ACTIONS, "states", "1 of them"),
        (STATES, compass_actions(0.001, 4), "actions[0]", "'0deg'"),
        (STATES, ACTIONS[:7], "actions", "7 of them"),
        (STATES, compass_actions(0.0005), "actions[0].displacement_mm", "(0.5, 0.0)"),
        (STATES, (*ACTIONS[:7], Action("+x-y", (0.0, 0.0))), "actions[7].displacement_mm", "(0.0, 0.0)"),
    ],
)
def test_another_task_is_refused_with_the_first_difference(states, actions, field, accepted):
    with pytest.raises(ConfigurationError) as refused:
        document().check_matches(states, actions)
    assert refused.value.field == field
    assert accepted in refused.value.accepted


def test_actions_in_six_degrees_of_freedom_read_back() -> None:
    spatial = Spatial(Law.PUSH, 1e-3, (0.1, -0.2, 0.3), (3.0, -1.0), (20e-3, 0.0))
    actions = (*ACTIONS[:-1], Action(ACTIONS[-1].name, (1e-3, 0.0), spatial))
    made = document(actions=tuple(map(ActionEntry.of, actions)))
    text = made.to_json_text()
    assert PolicyDocument.from_json_text(text) == made
    assert Spatial.of(spatial.law.value, spatial.numbers) == spatial
    made.check_matches(STATES, actions)
    with pytest.raises(ConfigurationError, match=r"actions\[7\].displacement_mm"):
        made.check_matches(STATES, ACTIONS)
    turned = replace(actions[-1], displacement_m=(1e-3, 0.0), spatial=replace(spatial, turn_rad=(0.1, -0.2, 0.31)))
    with pytest.raises(ConfigurationError, match=r"actions\[7\].spatial.turn_deg"):
        made.check_matches(STATES, (*actions[:-1], turned))
