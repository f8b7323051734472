"""Study conditions, read from a TOML file."""

from __future__ import annotations

import importlib
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final
from urllib.parse import quote

from threadpoolctl import threadpool_limits
from typing_extensions import override

from palpate.adapters.config import LEARNERS, RunConfig, configured, field_value, nested, overlay, read_toml
from palpate.adapters.experiments.build import needs_fitting, plain_perception
from palpate.adapters.experiments.fitting import configured_perception
from palpate.adapters.experiments.policies import BASELINES
from palpate.adapters.experiments.run import Run
from palpate.adapters.experiments.third_party import third_party_code, third_party_entry, third_party_policy
from palpate.adapters.experiments.training import Subject, run_toml
from palpate.adapters.files import new_folder
from palpate.adapters.log import LOG_FOLDER
from palpate.core.errors import ConfigurationError, OutputError, did_you_mean
from palpate.core.ports import Holds, Range, Settings

SUMMARY: Final = "summary.json"
"""File that marks a folder as finished."""


@dataclass(frozen=True)
class Condition:
    """A run in a study, with the varied settings and the absolute path to a policy file (empty if none)."""

    name: str
    fields: Mapping[str, Any]
    policy: str
    config: RunConfig
    trials: int
    file: str = ""

    @property
    def what(self) -> str:
        """Name of the policy, valid in any working folder."""
        return self.file or self.policy

    @property
    def learns(self) -> bool:
        """True if the policy is trained."""
        if self.policy in LEARNERS or self.file or not (code := third_party_code(self.policy)):
            return self.policy in LEARNERS
        perception = plain_perception(self.config)
        return third_party_policy(third_party_entry(code), self.config, perception, frozen=True).learns

    def record(self) -> str:
        """Return the text of ``run.toml``."""
        return run_toml(self.config, "train" if self.learns else "run", trials=self.trials, policy=self.what)

    def require_possible(self) -> None:
        """Check the condition before the study starts.

        Raises:
            ConfigurationError: A setting is invalid, the job is out of the arm's reach, or the policy does not fit.
        """
        run = Run(self.config)
        run.chosen("random" if self.learns else self.what)
        if self.learns and (perception := configured_perception(self.config)) is not None:
            Subject.of(self.config, self.policy).policy(self.config, perception)


def make(condition: Condition, study: Path) -> None:
    """Run a condition and write its folder in ``study``; the folder appears only when it is complete.

    Raises:
        PalpateError: A trial failed.
        OutputError: The folder cannot be created, or a trial cannot be recorded.
    """
    if not study.is_dir():
        raise OutputError(str(study), "is not there", "all workers need the folder of the study under one name")
    place = study / condition.name
    try:
        with _one_thread(condition.config), new_folder(place) as path:
            run = Run(condition.config)
            if condition.learns:
                result = run.train(condition.trials, path, condition.policy)
            else:
                result = run.evaluate(condition.trials, condition.what, path)
            if result.losses:
                remedy = "make room and run the same command again: it continues"
                raise OutputError(LOG_FOLDER, result.losses[0], remedy)
            if not result.finished:
                raise KeyboardInterrupt
    except OutputError:
        # Another worker, which the scheduler considered dead, finished first.
        if not (place / SUMMARY).exists():
            raise


@contextmanager
def _one_thread(config: RunConfig) -> Iterator[None]:
    """Limit numerical libraries to one thread: workers share processors, and sums depend on the number of threads."""
    if needs_fitting(config):
        # The limit affects only libraries that are already loaded.
        for name in ("sklearn.cluster", "sklearn.decomposition"):
            importlib.import_module(name)
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(1)
    with threadpool_limits(limits=1):
        yield


def policy_file(name: str) -> str:
    """Return the absolute path to the policy file with this name, or an empty string if there is none."""
    return os.path.abspath(name) if os.path.isfile(name) else ""


_MOST: Final = 10_000
"""Maximum number of conditions in a study."""
_LONGEST: Final = 200
"""Maximum length of a folder name, which is a few characters longer while the condition runs."""
_TABLES: Final = ("study", "base", "grid")
_POLICIES: Final = f"{', '.join((*LEARNERS, *BASELINES))}, policy files, and package.module:Name"


def _are_seeds(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return bool(value) and all(type(seed) is int and 0 <= seed < 2**63 for seed in value)
    return type(value) is int and 1 <= value <= _MOST


@dataclass(frozen=True)
class _Head(Settings):
    """The [study] table."""

    TABLE: ClassVar[str] = "study"

    trials: Annotated[int, Range(1, 1_000_000)] = 350
    seeds: Annotated[Any, Holds(_are_seeds, f"a list of seeds, or their number, 1 to {_MOST}")] = 1
    job: str = ""
    policies: Annotated[tuple[str, ...], Holds(bool, f"a list of names: {_POLICIES}")] = ("q-learning",)

    @override
    def check(self) -> None:
        for name in self.policies:
            known = name in (*LEARNERS, *BASELINES) or policy_file(name) or third_party_code(name)
            self.require("policies", bool(known), _POLICIES + did_you_mean(name, (*LEARNERS, *BASELINES)))


@dataclass(frozen=True)
class Study:
    """Every combination of settings, policies and seeds.

    Attributes:
        base: Settings for all conditions, by dotted name. Paths are relative to the working folder.
        grids: Values for the varied settings; the study has all combinations in each grid.
        job: Absolute path to the job file; empty for the paper's job.
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
            ConfigurationError: The file is invalid.
        """
        table = read_toml(path, "study file")
        if not table:
            raise ConfigurationError("study file", str(path), f"a file that is not empty, with a table {_TABLES[0]}")
        for key in table:
            if key not in _TABLES:
                accepted = f"one of {', '.join(_TABLES)}{did_you_mean(key, _TABLES)}"
                raise ConfigurationError(key, table[key], accepted)
        head = overlay(_Head(), _table("study", table.get("study", {})))
        base, grids = dict(_settings(_table("base", table.get("base", {})))), table.get("grid", {})
        for name, value in base.items():
            # A value given for a table would be lost if a grid varies settings in that table.
            if isinstance(setting_of(RunConfig(), name), Settings):
                raise ConfigurationError(name, value, "a table")
        grids = [dict(_settings(_table("grid", grid))) for grid in (grids if isinstance(grids, list) else [grids])]
        if any("seed" in settings for settings in (base, *grids)):
            raise ConfigurationError(
                "seed", "[base] or [grid]", "given as seeds in the table [study]: seeds = [0, 1, 2]"
            )
        seeds = range(head.seeds) if isinstance(head.seeds, int) else tuple(head.seeds)
        job = str(path.resolve().parent / head.job) if head.job else ""
        values = tuple({name: _values(name, found) for name, found in grid.items()} for grid in grids)
        study = cls(head.trials, seeds, head.policies, base, values, job)
        if study.count > _MOST:
            raise ConfigurationError("study", f"{study.count} conditions", f"a file with at most {_MOST}")
        return study

    @property
    def count(self) -> int:
        """Number of conditions."""
        combinations = sum(prod(len(values) for values in grid.values()) for grid in self.grids)
        return combinations * len(self.policies) * len(self.seeds)

    @property
    def fields(self) -> tuple[str, ...]:
        """Dotted names of the settings that are varied, in file order."""
        return tuple(dict.fromkeys(name for grid in self.grids for name in grid))

    def conditions(self) -> Iterator[Condition]:
        """Yield all conditions in file order: settings, then policies, then seeds.

        Raises:
            ConfigurationError: Settings are incompatible, or two conditions are identical.
        """
        short = {name: name.rpartition(".")[2] for name in self.fields}
        if len(set(short.values())) < len(short):
            short = dict(zip(short, short, strict=True))
        seen = set[str]()
        sets = [dict(zip(grid, values, strict=True)) for grid in self.grids for values in product(*grid.values())]
        for fields, policy in product(sets, self.policies):
            config = self._config(fields, policy)
            texts = (
                each if isinstance(each, str) else json.dumps(each, ensure_ascii=False) for each in fields.values()
            )
            words = [policy, *(f"{short[name]}={text}" for name, text in zip(fields, texts, strict=True))]
            for seed in self.seeds:
                name = ",".join(quote(word, safe="=+") for word in (*words, f"seed={seed}"))
                if name in seen:
                    raise ConfigurationError(
                        "study",
                        name,
                        "a file with each combination of settings, policy and seed once",
                    )
                if len(name) > _LONGEST:
                    accepted = (
                        f"a file with fewer or shorter settings in its grid: names have at most {_LONGEST} characters"
                    )
                    raise ConfigurationError("study", name, accepted)
                seen.add(name)
                own = replace(config, seed=seed)
                yield Condition(name, fields, policy, own, self.trials, policy_file(policy))

    def _config(self, fields: Mapping[str, Any], policy: str) -> RunConfig:
        """Return the configuration for a condition; trials are recorded only if the file enables it."""
        table = nested({"recording.enabled": False, **self.base, **fields})
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
        raise ConfigurationError(name, value, "a table")
    return value


def _settings(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield settings by dotted name from nested tables or dotted keys."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _settings(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _values(name: str, values: Any) -> tuple[Any, ...]:
    """Return a grid setting's values in a canonical form: 1 becomes 1.0 for a float."""
    if not isinstance(values, list) or not values:
        raise ConfigurationError(f"grid.{name}", values, "a list of at least one value")
    return tuple(_plain(field_value(RunConfig(), name, value)) for value in values)


def setting_of(config: RunConfig, name: str) -> Any:
    """Return the value of a setting, given by its dotted name."""
    value: Any = config
    for part in name.split("."):
        value = getattr(value, part, None)
    return _plain(value)


def _plain(value: Any) -> Any:
    return [_plain(item) for item in value] if isinstance(value, (tuple, list)) else value


def _absolute(path: str) -> str:
    return os.path.abspath(path) if path else ""
