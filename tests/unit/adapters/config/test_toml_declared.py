"""Every declared setting, on every way in: what is out of its range is refused by its name, the ends are taken."""

from dataclasses import replace
from typing import Any

import pytest

from palpate.adapters.cli.arguments import parse
from palpate.adapters.cli.options import TrainOptions
from palpate.adapters.config import RunConfig, field_value, overlay
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.ports.settings import Settings
from tests.unit.adapters.config.declared import TABLES, ends, leaves, wrong_values

tables = pytest.mark.parametrize("base", TABLES.values(), ids=TABLES)


def nested(name: str, value: Any) -> dict[str, Any]:
    """The table that sets one field, given by its dotted name."""
    for part in reversed(name.split(".")):
        value = {part: value}
    return value


def refusal(make: Any) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        make()
    assert "\n" not in str(caught.value)
    return caught.value


def test_the_tables_are_about_something() -> None:
    assert sum(1 for _ in leaves(RunConfig())) > 100
    assert sum(len(wrong_values(kind)) for base in TABLES.values() for _, _, kind in leaves(base)) > 1000


@tables
def test_what_is_wrong_is_refused_by_name_in_python_and_toml(base: Settings) -> None:
    for table, field, kind in leaves(base):
        for value in wrong_values(kind):
            error = refusal(lambda t=table, f=field, v=value: replace(t, **{f: v}))
            assert error.field.startswith(table.dotted(field)), (field, value)
            assert error.accepted, (field, value)
            # A table of TOML is laid over by the same check.
            laid = refusal(lambda t=table, f=field, v=value: overlay(t, {f: v}))
            assert str(laid) == str(error)


def test_the_whole_tree_is_reached_by_dotted_names() -> None:
    for table, field, kind in leaves(RunConfig()):
        name = table.dotted(field)
        value = wrong_values(kind)[0]
        for way in (lambda n=name, v=value: overlay(RunConfig(), nested(n, v)),
                    lambda n=name, v=value: field_value(RunConfig(), n, v)):  # fmt: skip
            assert refusal(way).field.startswith(name)


@tables
def test_the_ends_of_a_range_are_in_it(base: Settings) -> None:
    for table, field, kind in leaves(base):
        for value in ends(kind):
            field_value(table, field, value)


@tables
def test_an_unknown_key_is_refused_in_every_table(base: Settings) -> None:
    for table in {type(one): one for one, _, _ in leaves(base)}.values():
        name = table.dotted("no_such_setting")
        assert refusal(lambda t=table: overlay(t, {"no_such_setting": 1})).field == name
        with pytest.raises(TypeError, match="no_such_setting"):
            replace(table, no_such_setting=1)


def test_a_flag_is_refused_by_the_same_words() -> None:
    # One setting of each table: the way from flag to field is the parser's, and the same for all.
    one_each = {type(table): (table, field, kind) for table, field, kind in leaves(RunConfig()) if ends(kind)}
    for table, field, kind in one_each.values():
        name = table.dotted(field)
        value = next(v for v in reversed(wrong_values(kind)) if isinstance(v, (int, float, str)))
        expected = refusal(lambda t=table, f=field, v=value: replace(t, **{f: v}))
        learner = next((one for one in ("belief", "hmm") if f".{one}." in name), "q-learning")
        with pytest.raises((UsageError, ConfigurationError)) as caught:
            parse(TrainOptions, "train", [f"--{name.replace('_', '-')}={value}", f"--learner={learner}"])
        assert str(caught.value) == str(expected)
