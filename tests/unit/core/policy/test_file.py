import json
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy.base import Action, Law, Spatial, compass_actions
from palpate.core.policy.entries import ActionEntry, LearnerEntry
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.file import PolicyDocument
from palpate.core.policy.tabular import QParameters
from tests.unit.core.json_changes import put, remove, repeat, require_refused

ACTIONS = compass_actions(0.001)
STATES = ("a", "b")

numbers = st.floats(allow_nan=False, allow_infinity=False) | st.sampled_from([-0.0, 5e-324, -5e-324, -1e308])


def document(q=(0.0,) * 8, visits=(0,) * 8, learner=True, **settings) -> PolicyDocument:
    parameters = QParameters(alpha=0.3, gamma=1.0, temperature=TemperatureSchedule(5.0, 0.96, 0.1))
    state = {"q": [list(q)] * 2, "visits": [list(visits)] * 2, "trials_learned": 12}
    made = PolicyDocument(
        created_with={"palpate": "0.1.0"},
        perception={"thresholds_mm": [-1.0, 1.0]},
        states=STATES,
        actions=tuple(ActionEntry.of(action) for action in ACTIONS),
        programmed={"b": "-x"},
        examples={} if learner else {"a": "+x"},
        learner=LearnerEntry("q-learning", parameters, state) if learner else None,
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
    assert list(made) == [
        "schema", "created_with", "perception", "states", "actions", "programmed", "examples", "learner", "foreign",
    ]  # fmt: skip
    assert made["actions"][2] == {"name": "+y", "displacement_mm": [0.0, 1.0], "spatial": None}
    assert list(made["learner"]) == ["kind", "parameters", "state"]
    assert made["learner"]["kind"] == "q-learning"


BAD_FILES = [
    (remove("schema"), "schema"),
    (put("schema", "palpate.policy/2"), "schema"),
    (put("schema", "palpate.run/1"), "schema"),
    *[(remove(key), "policy file") for key in ("created_with", "perception", "states", "actions", "programmed")],
    (put("comment", "hello"), "policy file"),
    (put("created_with", None), "created_with"),
    (put("perception", []), "perception"),
    (put("states", "ab"), "states"),
    (put("states", []), "states"),
    (put("states", 0, 1), "states[0]"),
    (put("states", 0, ""), "states[0]"),
    (put("states", 0, "a\nb"), "states[0]"),
    (repeat("states"), "states[2]"),
    (put("actions", []), "actions"),
    (put("actions", 0, "+x"), "actions[0]"),
    (put("actions", 0, "displacement_mm", [1.0]), "actions[0].displacement_mm"),
    (put("actions", 0, "displacement_mm", ["1", 0.0]), "actions[0].displacement_mm[0]"),
    (put("actions", 0, "displacement_mm", [10**400, 0.0]), "actions[0].displacement_mm[0]"),
    (remove("actions", 3, "name"), "actions[3]"),
    (repeat("actions"), "actions[8]"),
    (put("programmed", "c", "+x"), "policy.programmed"),
    (put("programmed", "b", "up"), "policy.programmed"),
    (put("examples", {"c": "+x"}), "policy.examples"),
    (put("learner", None), "programmed"),
    (put("learner", "q-learning"), "learner"),
    (put("learner", "kind", "r-max"), "learner.kind"),
    (remove("learner", "kind"), "learner"),
    (put("learner", "kind", "sarsa"), "learner.parameters"),
    (put("learner", "parameters", "alpha", 0), "learner.parameters.alpha"),
    (put("learner", "parameters", "alpha_visits", None), "learner.parameters.alpha_visits"),
    (put("learner", "parameters", "trace_decay", 0.9), "learner.parameters"),
    (remove("learner", "parameters", "temperature", "floor"), "learner.parameters.temperature"),
    (put("learner", "parameters", "temperature", "floor", 9.0), "learner.parameters.temperature.floor"),
    (put("learner", "state", []), "learner.state"),
    (remove("learner", "state", "trials_learned"), "learner.state"),
    (put("learner", "state", "trials_learned", None), "learner.state"),
    (remove("learner", "state", "q"), "learner.state"),
    (put("learner", "state", "q", 0, 2, "x"), "learner.q[0][2]"),
    (put("learner", "state", "q", [[0.0] * 8]), "learner.q"),
    (put("learner", "state", "visits", 1, 0, -1), "learner.visits[1][0]"),
]


@pytest.mark.parametrize(("change", "field"), BAD_FILES)
def test_every_bad_file_is_one_clear_line(change, field):
    made = content()
    change(made)
    require_refused(PolicyDocument.from_json_text, made, field)


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
