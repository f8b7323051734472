"""What a study consists of, read from a TOML file."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final
from urllib.parse import quote

from typing_extensions import override

from palpate.adapters.config import (
    LEARNERS,
    RunConfig,
    configured,
    field_value,
    literal,
    merged,
    overlay,
    read_toml,
)
from palpate.adapters.experiments.foreign import foreign_code
from palpate.adapters.experiments.policies import BASELINES
from palpate.adapters.experiments.study.condition import Condition, policy_file
from palpate.core.errors import ConfigurationError, did_you_mean
from palpate.core.ports import Holds, Range, Settings, fitted

_MOST: Final = 10_000
"""Conditions of a study."""
_LONGEST: Final = 200
"""Length of a folder's name, which gets some characters more while it is made."""
_TABLES: Final = ("study", "base", "grid")
_DEFAULTS: Final = RunConfig()
_NO_SEED: Final = "seeds in the table [study]: seeds = [0, 1, 2]"
_POLICIES: Final = f"{', '.join((*LEARNERS, *BASELINES))}, policy files, and package.module:Name"
_SEEDS: Final = f"a list of seeds, or their number, 1 to {_MOST}"


@dataclass(frozen=True)
class _Head(Settings):
    """The table [study]."""

    TABLE: ClassVar[str] = "study"

    trials: Annotated[int, Range(1, 1_000_000)] = 350
    seeds: Annotated[Any, Holds(bool, _SEEDS)] = 1
    job: str = ""
    policies: Annotated[
        tuple[Annotated[str, Holds(bool, _POLICIES)], ...], Holds(bool, f"a list of names: {_POLICIES}")
    ] = ("q-learning",)

    @override
    def check(self) -> None:
        for name in self.policies:
            known = name in (*LEARNERS, *BASELINES) or policy_file(name) or foreign_code(name)
            self.require("policies", bool(known), _POLICIES)


@dataclass(frozen=True)
class Study:
    """Every combination of settings, with every policy and every seed.

    Attributes:
        base: Settings of all conditions, as nested tables. Files are named from the working folder.
        grids: Values of the settings that are varied; the study has all combinations of each grid.
        job: Absolute path of the job file; empty for the paper's job.
    """

    trials: int
    seeds: Sequence[int]
    policies: tuple[str, ...]
    base: Mapping[str, Any]
    grids: tuple[Mapping[str, tuple[Any, ...]], ...]
    job: str = ""

    @classmethod
    def read(cls, path: Path) -> Study:
        """Return the study in a TOML file.

        Raises:
            ConfigurationError: Something in it cannot be used.
        """
        table = read_toml(path, "study file")
        if not table:
            raise ConfigurationError("study file", str(path), f"one that is not empty, with a table {_TABLES[0]}")
        for key in table:
            if key not in _TABLES:
                accepted = f"one of {', '.join(_TABLES)}{did_you_mean(key, _TABLES)}"
                raise ConfigurationError(key, table[key], accepted)
        head = overlay(_Head(), _table("study", table.get("study", {})))
        base = _nested(_table("base", table.get("base", {})))
        if "seed" in base:
            raise ConfigurationError("seed", base["seed"], _NO_SEED)
        grids = table.get("grid", {})
        grids = tuple(_grid(grid) for grid in (grids if isinstance(grids, list) else [grids]))
        for name in (name for grid in grids for name in grid):
            _require_tables(base, name)
        job = str(path.resolve().parent / head.job) if head.job else ""
        study = cls(head.trials, _seeds(head.seeds), head.policies, base, grids, job)
        if study.count > _MOST:
            raise ConfigurationError("study", f"{study.count} conditions", f"at most {_MOST}")
        return study

    @property
    def count(self) -> int:
        """Number of conditions."""
        combinations = sum(prod(len(values) for values in grid.values()) for grid in self.grids)
        return combinations * len(self.policies) * len(self.seeds)

    @property
    def fields(self) -> tuple[str, ...]:
        """Dotted names of the settings that are varied, in the order of the file."""
        return tuple(dict.fromkeys(name for grid in self.grids for name in grid))

    def conditions(self) -> Iterator[Condition]:
        """Return all conditions in the order of the file: settings, then policies, then seeds.

        Raises:
            ConfigurationError: Settings do not go together, or two conditions are equal.
        """
        short = {name: name.rpartition(".")[2] for name in self.fields}
        if len(set(short.values())) < len(short):
            short = dict(zip(short, short, strict=True))
        seen = set[str]()
        sets = [dict(zip(grid, values, strict=True)) for grid in self.grids for values in product(*grid.values())]
        for fields, policy in product(sets, self.policies):
            config = self._config(fields, policy)
            words = [policy, *(f"{short[name]}={_word(value)}" for name, value in fields.items())]
            for seed in self.seeds:
                name = ",".join(quote(word, safe="=+") for word in (*words, f"seed={seed}"))
                if name in seen:
                    raise ConfigurationError("study", name, "each combination of settings, policy and seed once")
                if len(name) > _LONGEST:
                    accepted = f"fewer settings in a grid, or shorter values: a folder of at most {_LONGEST} characters"
                    raise ConfigurationError("study", name, accepted)
                seen.add(name)
                own = replace(config, seed=seed)
                yield Condition(name, fields, policy, own, self.trials, policy_file(policy))

    def _config(self, fields: Mapping[str, Any], policy: str) -> RunConfig:
        """The configuration of a condition; trials are not recorded unless the file says so."""
        table = merged({"recording": {"enabled": False}}, self.base, _nested(fields))
        learner = policy if policy in LEARNERS else ""
        config = configured(self.job or None, learner=learner, policy=policy, settings=table)
        memory, examples = config.perception.memory, config.learning.examples
        return replace(
            config,
            perception=replace(config.perception, memory=_absolute(memory) if memory.endswith(".json") else memory),
            learning=replace(config.learning, examples=_absolute(examples)),
        )


def _table(name: str, value: Any) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigurationError(name, value, f"a table, [{name}]")
    return value


def _nested(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table whose keys may be dotted names as tables in tables."""
    tables = []
    for name, value in table.items():
        inner: Any = _nested(value) if isinstance(value, Mapping) else value
        for key in reversed(name.split(".")):
            inner = {key: inner}
        tables.append(inner)
    return merged(*tables)


def _require_tables(base: Mapping[str, Any], name: str) -> None:
    """Refuse what a setting of a grid would replace without a word."""
    table: Any = base
    path = name.split(".")[:-1]
    for count, key in enumerate(path, start=1):
        table = table.get(key, {})
        if not isinstance(table, Mapping):
            raise ConfigurationError(".".join(path[:count]), table, "a table")


def _grid(table: Any) -> dict[str, tuple[Any, ...]]:
    return dict(_axes(_table("grid", table)))


def _axes(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, tuple[Any, ...]]]:
    for key, values in table.items():
        name = f"{before}{key}"
        if isinstance(values, Mapping):
            yield from _axes(values, f"{name}.")
            continue
        if name == "seed":
            raise ConfigurationError(name, values, _NO_SEED)
        if not isinstance(values, list):
            plain = _plain(field_value(_DEFAULTS, name, values))
            raise ConfigurationError(f"grid.{name}", values, f"a list of values, as in [{literal(plain)}]")
        if not values:
            raise ConfigurationError(f"grid.{name}", values, "at least one value")
        # In one form: 1 is 1.0 where a float is meant.
        yield name, tuple(_plain(field_value(_DEFAULTS, name, value)) for value in values)


def setting_of(config: RunConfig, name: str) -> Any:
    """Return the value of a setting by its dotted name."""
    value: Any = config
    for part in name.split("."):
        value = getattr(value, part)
    return _plain(value)


def _plain(value: Any) -> Any:
    return [_plain(item) for item in value] if isinstance(value, (tuple, list)) else value


def _absolute(path: str) -> str:
    return os.path.abspath(path) if path else ""


def _seeds(value: Any) -> Sequence[int]:
    if isinstance(value, (list, tuple)):
        return tuple(fitted("study.seeds", seed, Annotated[int, Range(0, 2**63 - 1)]) for seed in value)
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= _MOST:
        raise ConfigurationError("study.seeds", value, _SEEDS)
    return range(value)


def _word(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
