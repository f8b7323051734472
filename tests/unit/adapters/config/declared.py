"""Every table of settings that a person may write, for tests that go by their declarations."""

from collections.abc import Iterator
from math import inf, isfinite, nan, nextafter
from typing import Any, get_args, get_origin

from palpate.adapters.config import GridLearning, RealTimeConfig, RunConfig
from palpate.adapters.config.rig import OperatorTable, WatchdogTable
from palpate.adapters.hardware.ati import NetFtTable
from palpate.adapters.hardware.cia402 import Cia402Table
from palpate.adapters.hardware.jr3 import Jr3CanTable
from palpate.adapters.hardware.zebra_zero import ZebraTable
from palpate.core.automata import InferenceSettings, TrainingSettings
from palpate.core.automata.choice import ExtractionSettings
from palpate.core.policy import SarsaParameters, TemperatureSchedule
from palpate.core.ports.settings import OneOf, Range, Settings, kinds_of, optional_of, parts_of

TABLES: dict[str, Settings] = {
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


def leaves(base: Settings) -> Iterator[tuple[Settings, str, Any]]:
    """Every setting that holds no others: the table that it stands in, its field, and its annotation."""
    for name, kind in kinds_of(type(base)).items():
        value = getattr(base, name)
        if isinstance(value, Settings):
            yield from leaves(value)
        else:
            yield base, name, kind


def wrong_values(kind: Any) -> list[Any]:
    """Values that a setting of that kind must refuse, whatever other settings are."""
    base, marks = parts_of(kind)
    if (inner := optional_of(base)) is not None:
        return [value for value in wrong_values(inner) if value is not None]
    wrong: list[Any] = [None, b"bytes"]
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


def _beyond(mark: Range, *, whole: bool) -> list[tuple[bool, Any]]:
    if whole:
        return [(True, mark.low - 1), (True, mark.high + 1)]
    low = mark.low if mark.above else nextafter(mark.low, -inf)
    high = mark.high if mark.below else nextafter(mark.high, inf)
    return [(isfinite(mark.low), low), (isfinite(mark.high), high)]


def ends(kind: Any) -> list[Any]:
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
