"""Every declared setting, on every way in: what is out of its range is refused by its name, the ends are taken.

Tests that go by the declaration cannot see that it is wrong: the last one compares it with a copy that a person keeps.
After a change on purpose write the copy again with ``PALPATE_SNAPSHOT=write``, and look at the difference.
"""

import json
import os
from dataclasses import replace
from math import inf, isfinite, nan, nextafter
from pathlib import Path
from typing import get_args, get_origin

import pytest

from palpate.adapters.cli.arguments import parse
from palpate.adapters.cli.options import TrainOptions
from palpate.adapters.config import (
    GridLearning,
    OperatorTable,
    RealTimeConfig,
    RunConfig,
    WatchdogTable,
    field_value,
    overlay,
)
from palpate.adapters.hardware.ati import NetFtTable
from palpate.adapters.hardware.cia402 import Cia402Table
from palpate.adapters.hardware.jr3 import Jr3CanTable
from palpate.adapters.hardware.zebra_zero import ZebraTable
from palpate.core.automata import InferenceSettings, TrainingSettings
from palpate.core.automata.choice import ExtractionSettings
from palpate.core.errors import ConfigurationError, UsageError
from palpate.core.policy import SarsaParameters, TemperatureSchedule
from palpate.core.ports.settings import OneOf, Range, Settings, kinds_of, optional_of, parts_of

TABLES = {
    "run": RunConfig(),
    "policy": SarsaParameters(alpha=0.5, gamma=1.0, temperature=TemperatureSchedule(1.0, 1.0, 0.0)),
    "explore": GridLearning(),
    "infer": InferenceSettings(),
    "extract": ExtractionSettings(),
    "train an automaton": TrainingSettings(),
    "real time": RealTimeConfig(),
    "rig operator": OperatorTable(),
    "rig watchdog": WatchdogTable(),
    "arm zebra-nmc": ZebraTable(),
    "arm cia402": Cia402Table(),
    "force jr3-can": Jr3CanTable(),
    "force ati-netft": NetFtTable(),
}


def leaves(base):
    """Every setting that holds no others: the table that it stands in, its field, and its annotation."""
    for name, kind in kinds_of(type(base)).items():
        value = getattr(base, name)
        if isinstance(value, Settings):
            yield from leaves(value)
        else:
            yield base, name, kind


def wrong_values(kind):
    """Values that a setting of that kind must refuse, whatever other settings are."""
    base, marks = parts_of(kind)
    if (inner := optional_of(base)) is not None:
        return [value for value in wrong_values(inner) if value is not None]
    wrong = [None, b"bytes"]
    origin = get_origin(base) or base
    if origin is float:
        wrong += [nan, inf, -inf, "wide", True, [1.0], 10**400]
    elif origin is int:
        wrong += [nan, 1.5, "many", True, [1]]
    elif origin is bool:
        wrong += [1, 0.0, "yes"]
    elif origin is str:
        wrong += [3, 1.0, True, ["x"]]
    elif origin is tuple:
        items = [item for item in get_args(base) if item is not ...]
        wrong += [3, "x", *([value] * len(items) for value in wrong_values(items[0]))]
        wrong += [] if get_args(base)[-1] is ... else [[]]
    elif origin is dict:
        wrong += [3, ["x"], {"x": "y" if get_args(base)[1] is float else 1}]
    for mark in marks:
        if isinstance(mark, OneOf):
            wrong += ["no such name"] if origin is str else [0, 17]
        if isinstance(mark, Range):
            wrong += [value for low, value in _beyond(mark, whole=origin is int) if low]
    return wrong


def _beyond(mark, *, whole):
    if whole:
        return [(True, mark.low - 1), (True, mark.high + 1)]
    low = mark.low if mark.above else nextafter(mark.low, -inf)
    high = mark.high if mark.below else nextafter(mark.high, inf)
    return [(isfinite(mark.low), low), (isfinite(mark.high), high)]


def ends(kind):
    """The outermost values of a setting's range."""
    base, marks = parts_of(kind)
    kind = optional_of(base)
    marks = marks if kind is None else parts_of(kind)[1]
    found = []
    for mark in marks:
        if isinstance(mark, Range):
            found += [] if mark.above else [mark.low]
            found += [] if mark.below or not isfinite(mark.high) else [mark.high]
        if isinstance(mark, OneOf):
            found += mark.values
    return found


tables = pytest.mark.parametrize("base", TABLES.values(), ids=TABLES)


def nested(name, value):
    """The table that sets one field, given by its dotted name."""
    for part in reversed(name.split(".")):
        value = {part: value}
    return value


def refusal(make):
    with pytest.raises(ConfigurationError) as caught:
        make()
    assert "\n" not in str(caught.value)
    return caught.value


@tables
def test_wrong_value_is_refused_by_name_in_python_and_toml(base):
    for table, field, kind in leaves(base):
        for value in wrong_values(kind):
            error = refusal(lambda t=table, f=field, v=value: replace(t, **{f: v}))
            assert error.field.startswith(table.dotted(field)), (field, value)
            assert error.accepted, (field, value)
            # A table of TOML is laid over by the same check.
            laid = refusal(lambda t=table, f=field, v=value: overlay(t, {f: v}))
            assert str(laid) == str(error)


def test_whole_tree_is_reached_by_dotted_names():
    for table, field, kind in leaves(RunConfig()):
        name = table.dotted(field)
        value = wrong_values(kind)[0]
        for way in (lambda n=name, v=value: overlay(RunConfig(), nested(n, v)),
                    lambda n=name, v=value: field_value(RunConfig(), n, v)):  # fmt: skip
            assert refusal(way).field.startswith(name)


@tables
def test_ends_of_a_range_are_in_it(base):
    for table, field, kind in leaves(base):
        for value in ends(kind):
            field_value(table, field, value)


@tables
def test_unknown_key_is_refused_in_every_table(base):
    for table in {type(one): one for one, _, _ in leaves(base)}.values():
        name = table.dotted("no_such_setting")
        assert refusal(lambda t=table: overlay(t, {"no_such_setting": 1})).field == name
        with pytest.raises(TypeError, match="no_such_setting"):
            replace(table, no_such_setting=1)


def test_flag_is_refused_by_the_same_words():
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


SNAPSHOT = Path(__file__).parents[3] / "golden" / "settings.json"


def declared(table):
    """Each setting of a table as a line, or as a table of its own."""
    found = {}
    for name, kind in kinds_of(type(table)).items():
        value = getattr(table, name)
        found[name] = declared(value) if isinstance(value, Settings) else f"{_kind(kind)} = {value!r}"
    return found


def _kind(kind):
    base, marks = parts_of(kind)
    if (inner := optional_of(base)) is not None:
        return f"{_kind(inner)}, or none"
    units = [mark.unit for mark in marks if isinstance(mark, Range) and mark.unit]
    return ", ".join([_named(base), *(mark.words(base) for mark in marks), *units])


def _named(base):
    if get_origin(base) not in (tuple, dict):
        return " or ".join(one.__name__ for one in get_args(base) or (base,))
    items = ("..." if item is ... else _kind(item) for item in get_args(base))
    return f"{base.__name__}[{'; '.join(items)}]"


def test_declared_settings_are_those_of_the_snapshot():
    found = {name: declared(base) for name, base in TABLES.items()}
    text = json.dumps(found, indent=1, ensure_ascii=False) + "\n"
    if os.environ.get("PALPATE_SNAPSHOT") == "write":
        SNAPSHOT.write_text(text, encoding="utf-8")
    assert text == SNAPSHOT.read_text(encoding="utf-8")
