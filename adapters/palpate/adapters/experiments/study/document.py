"""What a study consists of: read from a TOML file, and written down in the one form that is compared later."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.adapters.config import LEARNERS, RunConfig, literal, overlay, read_toml
from palpate.adapters.experiments.foreign import foreign_code
from palpate.adapters.experiments.policies import COMPARATORS
from palpate.adapters.experiments.study.cell import FORMAT, LEARN, StudyCell
from palpate.adapters.experiments.study.fields import FILES, configured, leaves, names_file, plain_value
from palpate.core.errors import ConfigurationError, require_in
from palpate.core.ports import Holds, Range, Settings, fitted

MOST_CELLS: Final = 10_000_000
_MOST_SEED: Final = 2**63 - 1
_TABLES: Final = ("study", "base", "grid", "cells")
_WRITTEN: Final = ("format", "versions", "files")
"""What a study's folder adds to the file; ignored where such a file is given again."""
_POLICIES: Final = f"{', '.join((*LEARNERS, *COMPARATORS))}, policy files, and package.module:Name"
_Seed: TypeAlias = Annotated[int, Range(0, _MOST_SEED)]


def _are_seeds(value: Any) -> bool:
    return isinstance(value, (tuple, list, Mapping)) and bool(value)


@dataclass(frozen=True)
class _SeedSpan(Settings):
    """Seeds that follow each other."""

    TABLE: ClassVar[str] = "study.seeds"

    first: _Seed = 0
    count: Annotated[int, Range(1, MOST_CELLS)] = 1

    @override
    def check(self) -> None:
        require_in("study.seeds.first", self.first, 0, _MOST_SEED - self.count)


@dataclass(frozen=True)
class _Head(Settings):
    """The table [study]."""

    TABLE: ClassVar[str] = "study"

    trials: Annotated[int, Range(1, 1_000_000)] = 350
    seeds: Annotated[Any, Holds(_are_seeds, "a list of seeds, or { first = 0, count = 20 }")] = (0,)
    job: str = ""
    policies: Annotated[
        tuple[Annotated[str, Holds(bool, _POLICIES)], ...], Holds(bool, f"a list of names: {_POLICIES}")
    ] = (LEARN,)


@dataclass(frozen=True)
class Study:
    """Every combination of settings, with every policy and every seed.

    Attributes:
        seeds: Seeds, each once; a range where they follow each other.
        listed: Sets of settings; each is combined with all of the grid. One empty set if none are listed.
        job: Absolute path of the job file; empty for the paper's job.
    """

    trials: int
    seeds: Sequence[int]
    policies: tuple[str, ...]
    base: Mapping[str, Any]
    listed: tuple[Mapping[str, Any], ...]
    grid: Mapping[str, tuple[Any, ...]]
    job: str = ""

    @classmethod
    def read(cls, path: Path) -> Study:
        """The study in a TOML file.

        Raises:
            ConfigurationError: Something in it cannot be used.
        """
        try:
            table = read_toml(path)
        except ConfigurationError as error:
            raise ConfigurationError("study file", error.value, error.accepted) from error
        if not table:
            raise ConfigurationError("study file", str(path), f"one that is not empty, with a table {_TABLES[0]}")
        for key in table:
            if key not in (*_TABLES, *_WRITTEN):
                near = difflib.get_close_matches(key, _TABLES, n=1, cutoff=0.5)
                hint = f"; did you mean {near[0]}?" if near else ""
                raise ConfigurationError(key, table[key], f"one of {', '.join(_TABLES)}{hint}")
        if table.get("format", FORMAT) != FORMAT:
            raise ConfigurationError("format", table["format"], f"{FORMAT}, the only one that this version knows")
        head = overlay(_Head(), _table(table, "study"))
        base = {name: plain_value(name, value) for name, value in leaves(_table(table, "base"), "base").items()}
        grid = {name: _axis(name, values) for name, values in leaves(_table(table, "grid"), "grid").items()}
        listed = _listed(table.get("cells"))
        for one in listed:
            if twice := [name for name in one if name in grid]:
                raise ConfigurationError(f"cells.{twice[0]}", one[twice[0]], "a setting that [grid] does not vary too")
        job = str(path.resolve().parent / head.job) if head.job else ""
        return cls(head.trials, _seeds(head.seeds), _policies(head.policies), base, listed, grid, job)

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.combinations * len(self.policies) * len(self.seeds)

    @property
    def combinations(self) -> int:
        """Number of different sets of settings."""
        return len(self.listed) * prod(len(values) for values in self.grid.values())

    def settings(self) -> Iterator[dict[str, Any]]:
        """The sets of settings that are varied, in the order of the file."""
        for one in self.listed:
            for values in product(*self.grid.values()):
                yield {**one, **dict(zip(self.grid, values, strict=True))}

    def cells(self) -> Iterator[StudyCell]:
        """All cells, in the order of the file: settings, then policies, then seeds."""
        for fields in self.settings():
            for policy in self.policies:
                for seed in self.seeds:
                    yield StudyCell(fields, policy, seed)

    def config(self, fields: Mapping[str, Any], seed: int = 0) -> RunConfig:
        """The configuration of a cell.

        Raises:
            ConfigurationError: The settings do not go together.
        """
        return configured({**self.base, **fields, "seed": seed}, os.getcwd(), self.job)

    def files(self) -> set[str]:
        """Return the files that results depend on."""
        found = {name for name in self.policies if not _made_by_name(name)} | ({self.job} if self.job else set())
        for field in FILES:
            values = [self.base.get(field), *(one.get(field) for one in self.listed), *self.grid.get(field, ())]
            found |= {value for value in values if names_file(field, value)}
        return found

    def text(self, versions: Mapping[str, str], files: Mapping[str, str]) -> str:
        """As TOML; :meth:`read` gives the same study back."""
        lines = [f"format = {FORMAT}\n", "\n[study]\n", f"trials = {self.trials}\n"]
        lines += [f"seeds = {_seeds_text(self.seeds)}\n", f"policies = {literal(self.policies)}\n"]
        lines += [f"job = {literal(self.job)}\n"] if self.job else []
        tables = [("[base]", self.base), ("[grid]", self.grid)]
        tables += [("[[cells]]", one) for one in self.listed] if self.listed != ({},) else []
        tables += [("[versions]", versions), ("[files]", files)]
        for name, table in tables:
            if table or name == "[[cells]]":
                lines += [f"\n{name}\n", *(f"{literal(key)} = {literal(value)}\n" for key, value in table.items())]
        return "".join(lines)


def _table(table: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = table.get(name, {})
    if not isinstance(value, Mapping):
        raise ConfigurationError(name, value, f"a table, [{name}]")
    return value


def _axis(name: str, values: Any) -> tuple[Any, ...]:
    if not isinstance(values, list):
        plain_value(name, values)
        raise ConfigurationError(f"grid.{name}", values, f"a list of values, as in [{literal(values)}]")
    if not values:
        raise ConfigurationError(f"grid.{name}", values, "at least one value")
    return _once(f"grid.{name}", [plain_value(name, value) for value in values])


def _listed(tables: Any) -> tuple[Mapping[str, Any], ...]:
    if tables is None:
        return ({},)
    if not isinstance(tables, list) or not all(isinstance(one, Mapping) for one in tables):
        raise ConfigurationError("cells", tables, "tables of settings, each under [[cells]]")
    if not tables:
        raise ConfigurationError("cells", tables, "at least one table of settings, under [[cells]]")
    found = [{n: plain_value(n, v) for n, v in sorted(leaves(one, "cells").items())} for one in tables]
    return _once("cells", found)


def _seeds(value: Any) -> Sequence[int]:
    if isinstance(value, Mapping):
        span = overlay(_SeedSpan(), {"count": 0, **value})
        return range(span.first, span.first + span.count)
    seeds = _once("study.seeds", [fitted("study.seeds", seed, _Seed) for seed in value])
    run = range(seeds[0], seeds[0] + len(seeds))
    return run if tuple(run) == seeds else seeds


def _policies(names: Sequence[str]) -> tuple[str, ...]:
    for name in names:
        if not _made_by_name(name) and not os.path.isfile(name):
            raise ConfigurationError("study.policies", name, _POLICIES)
    return _once("study.policies", names)


def _made_by_name(name: str) -> bool:
    return name in (*LEARNERS, *COMPARATORS) or bool(not os.path.isfile(name) and foreign_code(name))


def _once(name: str, values: Sequence[Any]) -> tuple[Any, ...]:
    seen = set()
    for value in values:
        text = repr(value)
        if text in seen:
            raise ConfigurationError(name, value, "each of them once")
        seen.add(text)
    return tuple(values)


def _seeds_text(seeds: Sequence[int]) -> str:
    if isinstance(seeds, range):
        return f"{{ first = {seeds[0]}, count = {len(seeds)} }}"
    return literal(seeds)
