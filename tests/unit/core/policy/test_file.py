import json
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import ConfigurationError
from palpate.core.policy import file as file_module
from palpate.core.policy.base import Action, Law, Spatial, compass_actions
from palpate.core.policy.entries import ActionEntry, LearnerEntry, TableRow
from palpate.core.policy.exploration import TemperatureSchedule
from palpate.core.policy.file import SCHEMA, SPATIAL_SCHEMA, PolicyDocument
from palpate.core.policy.sarsa import SarsaParameters
from palpate.core.policy.tabular import QParameters
from palpate.core.ports.settings import Range, kinds_of, parts_of
from tests.unit.core.json_changes import put, remove, repeat, require_refused

ACTIONS = compass_actions(0.001)
STATES = ("a", "b")
FORMAT = json.loads(Path(file_module.__file__).with_name("policy.schema.json").read_text(encoding="utf-8"))

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


def disagreements(value, schema, where="$"):
    """Tiny check of the parts of JSON Schema that ours uses."""
    if "$ref" in schema:
        yield from disagreements(value, FORMAT["$defs"][schema["$ref"].rsplit("/", 1)[1]], where)
    kinds = {
        "object": dict,
        "array": list,
        "string": str,
        "number": (int, float),
        "integer": int,
        "boolean": bool,
        "null": type(None),
    }
    accepted = schema.get("type", list(kinds))
    accepted = [accepted] if isinstance(accepted, str) else accepted
    if not any(isinstance(value, kinds[kind]) for kind in accepted):
        yield f"{where}: not {accepted}"
    if value != schema.get("const", value) or value not in schema.get("enum", [value]):
        yield f"{where}: not const or enum"
    if isinstance(value, dict) and "properties" in schema:
        yield from (f"{where}: {key} missing" for key in schema["required"] if key not in value)
        for key, item in value.items():
            if key in schema["properties"]:
                yield from disagreements(item, schema["properties"][key], f"{where}.{key}")
            elif not schema["additionalProperties"]:
                yield f"{where}: {key} unknown"
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            yield f"{where}: length"
        if schema.get("uniqueItems") and len(value) != len({json.dumps(item) for item in value}):
            yield f"{where}: repeated"
        for item in value:
            yield from disagreements(item, schema.get("items", {}), f"{where}[]")
    if isinstance(value, str) and len(value) < schema.get("minLength", 0):
        yield f"{where}: too short"
    if isinstance(value, int | float):
        if not schema.get("minimum", value) <= value <= schema.get("maximum", value):
            yield f"{where}: range"
        if "exclusiveMinimum" in schema and value <= schema["exclusiveMinimum"]:
            yield f"{where}: range"


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
    assert made["schema"] == "palpate.policy/1"
    assert list(made) == ["schema", "created_with", "perception", "states", "actions", "table", "learner"]
    assert made["actions"][2] == {"name": "+y", "displacement_mm": [0.0, 1.0]}
    assert set(made["table"][0]) == {"state", "source", "action", "value", "visits", "q", "visits_per_action"}
    assert made["learner"]["kind"] == "q-learning"
    assert made["learner"]["trials_learned"] == 12


def _ends(mark):
    if not isinstance(mark, Range):
        return {}
    low, high = "exclusiveMinimum" if mark.above else "minimum", "exclusiveMaximum" if mark.below else "maximum"
    return {key: end for key, end in ((low, mark.low), (high, mark.high)) if -inf < end < 1e6}


def test_the_json_schema_has_the_declared_ranges_of_a_learner():
    written = FORMAT["properties"]["learner"]["properties"]
    # In the file a rate that stays is null, and what is not set is not there.
    declared = {"alpha_visits": {"exclusiveMinimum": 0}, "in_use": {"minimum": 0}}
    for table, schema in ((SarsaParameters, written), (TemperatureSchedule, written["temperature"]["properties"])):
        for name, kind in kinds_of(table).items():
            ends = {key: value for mark in parts_of(kind)[1] for key, value in _ends(mark).items()}
            given = {key: value for key, value in schema[name].items() if "imum" in key}
            assert given == declared.get(name, ends), name


@pytest.mark.parametrize("learner", [True, False])
def test_written_files_agree_with_the_json_schema(learner):
    assert list(disagreements(content(learner=learner), FORMAT)) == []


# What a schema can see is refused by both; the rest by the reader alone.
SEEN_BY_SCHEMA = [
    (remove("schema"), "schema"),
    (put("schema", "palpate.policy/3"), "schema"),
    (put("schema", "palpate.run/1"), "schema"),
    *[(remove(key), "policy file") for key in FORMAT["required"] if key != "schema"],
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
    (put("learner", "alpha", 0), "learner.alpha"),
    (put("learner", "alpha_visits", -1.0), "learner.alpha_visits"),
    (remove("learner", "temperature", "floor"), "learner.temperature"),
]
SEEN_BY_READER = [
    (put("learner", "kind", "sarsa"), "learner"),
    (put("learner", "trace_decay", 0.9), "learner"),
    (repeat("actions"), "actions[8]"),
    (put("states", 0, "a\nb"), "states[0]"),
    (put("actions", 0, "displacement_mm", [10**400, 0.0]), "actions[0].displacement_mm[0]"),
    (repeat("table"), "table[2].state"),
    (put("table", 1, "state", "c"), "table[1].state"),
    (remove("table", 1), "table"),
    (put("table", []), "table"),
    (put("table", 0, "action", "up"), "table[0].action"),
    (put("learner", None), "table[0].source"),
    (put("learner", "temperature", "floor", 9.0), "learner.temperature.floor"),
]


@pytest.mark.parametrize(("change", "field"), SEEN_BY_SCHEMA + SEEN_BY_READER)
def test_every_bad_file_is_one_clear_line(tmp_path, change, field):
    made = content()
    change(made)
    require_refused(PolicyDocument.load, tmp_path / "policy.json", made, field)


@pytest.mark.parametrize("change", [change for change, _ in SEEN_BY_SCHEMA])
def test_the_json_schema_refuses_them_too(change):
    made = content()
    change(made)
    assert list(disagreements(made, FORMAT))


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


def test_the_schema_file_has_the_id_of_the_code():
    assert FORMAT["$id"] == SCHEMA
    assert FORMAT["properties"]["schema"]["enum"] == [SCHEMA, SPATIAL_SCHEMA]


def test_actions_in_six_degrees_of_freedom_are_of_schema_2_and_those_across_stay_what_they_were() -> None:
    spatial = Spatial(Law.PUSH, 1e-3, (0.1, -0.2, 0.3), (3.0, -1.0), (20e-3, 0.0))
    actions = (*ACTIONS[:-1], Action(ACTIONS[-1].name, (1e-3, 0.0), spatial))
    made = document(actions=tuple(map(ActionEntry.of, actions)))
    assert (made.schema, document().schema) == (SPATIAL_SCHEMA, SCHEMA)
    text = made.to_json_text()
    assert PolicyDocument.from_json_text(text) == made
    assert not list(disagreements(json.loads(text), FORMAT))
    assert Spatial.of(spatial.law.value, spatial.numbers) == spatial
    made.check_matches(STATES, actions)
    with pytest.raises(ConfigurationError, match=r"actions\[7\].displacement_mm"):
        made.check_matches(STATES, ACTIONS)
    turned = replace(actions[-1], displacement_m=(1e-3, 0.0), spatial=replace(spatial, turn_rad=(0.1, -0.2, 0.31)))
    with pytest.raises(ConfigurationError, match=r"actions\[7\].turn_deg"):
        made.check_matches(STATES, (*actions[:-1], turned))
