"""Records are read by their old names, and what they lack means what was done then."""

import copy
from tomllib import loads
from typing import Any

import pytest

from palpate.adapters.config import RENAMED, RunConfig, field_value, overlay, scenario, to_toml
from palpate.adapters.config.records import UNTOLD, recorded, recorded_config
from palpate.core.errors import ConfigurationError
from tests.unit.adapters.config.declared import leaves


def value_of(config: Any, name: str) -> Any:
    for part in name.split("."):
        config = getattr(config, part)
    return config


@pytest.mark.parametrize("config", [RunConfig(), scenario("blind"), RunConfig(seed=3)])
def test_a_record_of_today_comes_back(config: RunConfig) -> None:
    assert recorded_config(loads(to_toml(config))) == config


@pytest.mark.parametrize("old", RENAMED)
def test_an_old_name_is_read_in_a_record_and_refused_elsewhere(old: str) -> None:
    value = value_of(RunConfig(), RENAMED[old][0])
    table: dict[str, Any] = {old.rpartition(".")[2]: value}
    for part in reversed(old.split(".")[:-1]):
        table = {part: table}
    before = copy.deepcopy(table)
    config = recorded_config(table)
    assert table == before
    for name in RENAMED[old]:
        assert value_of(config, name) == value
        # What it is called now is the name of a setting.
        field_value(RunConfig(), name, value)
    with pytest.raises(ConfigurationError, match=f"^{old} = .* is refused: it is called .*{RENAMED[old][-1]} now$"):
        overlay(RunConfig(), table)


def test_what_a_record_lacks_is_what_was_done_then_whatever_the_defaults_are_now() -> None:
    names = {table.dotted(field) for table, field, _ in leaves(RunConfig())}
    assert set(UNTOLD) <= names
    for name, value in UNTOLD.items():
        assert value_of(recorded_config({}), name) == value


def test_options_that_a_record_of_a_task_lacks_are_those_of_then() -> None:
    told = {"task": {"name": "insertion-6dof", "options": {"corners": 4.0, "down_share": 0.5}}}
    untold = {"wobble_deg_s": 0.0, "unanswered_N": 0.0}
    assert recorded_config(told).task.options == {"corners": 4.0, "down_share": 0.5} | untold
    # Nothing of one record is left for the next.
    assert recorded_config({}).task.options == {}


def test_what_a_record_holds_wins() -> None:
    table = {"learning": {"back_off_visits": 9.0}, "perception": {"memory": "last-2"}}
    config = recorded_config(table)
    assert (config.learning.back_off_visits, config.perception.memory) == (9.0, "last-2")


@pytest.mark.parametrize("table", [{"learning": 3}, {"supervision": [1]}, {"tusk": {}}])
def test_a_damaged_record_is_refused(table: dict[str, Any]) -> None:
    assert recorded(table) != {}
    with pytest.raises(ConfigurationError):
        recorded_config(table)
