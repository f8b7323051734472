"""What a study asks for: read from a TOML file, and written down in the one form that is compared later."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, Final

from palpate.adapters.config import RunConfig, literal, read_toml
from palpate.adapters.experiments.policies import COMPARATORS
from palpate.adapters.experiments.study.cell import FORMAT, LEARN, StudyCell
from palpate.adapters.experiments.study.fields import FILES, configured, leaves, names_file, plain_value
from palpate.core.errors import ConfigurationError, require_in, require_whole

MOST_CELLS: Final = 10_000_000
_MOST_SEED: Final = 2**63 - 1
_TABLES: Final = ("study", "base", "grid", "cells")
_WRITTEN: Final = ("format", "versions", "files")
"""What a study's folder adds to the file; ignored where such a file is given again."""
_STUDY: Final = ("trials", "seeds", "policies")


@dataclass(frozen=True)
class Study:
    """Every combination of settings, with every policy and every seed.

    Attributes:
        trials: Trials of each run.
        seeds: Seeds, each once; a range where they follow each other.
        policies: Policies, each once.
        base: Settings of all cells, by dotted names.
        listed: Sets of settings; each is combined with all of the grid. One empty set if none are listed.
        grid: Values of each setting that is varied by itself.
    """

    trials: int
    seeds: Sequence[int]
    policies: tuple[str, ...]
    base: Mapping[str, Any]
    listed: tuple[Mapping[str, Any], ...]
    grid: Mapping[str, tuple[Any, ...]]

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
        _require_known(table, (*_TABLES, *_WRITTEN), _TABLES, "")
        if table.get("format", FORMAT) != FORMAT:
            raise ConfigurationError("format", table["format"], f"{FORMAT}, the only one that this version knows")
        head = _table(table, "study")
        _require_known(head, _STUDY, _STUDY, "study.")
        trials = head.get("trials", 350)
        require_whole("study.trials", trials, 1, 1_000_000)
        base = {name: plain_value(name, value) for name, value in leaves(_table(table, "base"), "base").items()}
        grid = {name: _axis(name, values) for name, values in leaves(_table(table, "grid"), "grid").items()}
        listed = _listed(table.get("cells"))
        for one in listed:
            if twice := [name for name in one if name in grid]:
                raise ConfigurationError(f"cells.{twice[0]}", one[twice[0]], "a setting that [grid] does not vary too")
        return cls(trials, _seeds(head.get("seeds", [0])), _policies(head.get("policies", [LEARN])), base, listed, grid)

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
        return configured({**self.base, **fields, "seed": seed}, os.getcwd())

    def files(self) -> dict[str, str]:
        """Files that results depend on, and the setting that names each."""
        found = {name: "policy" for name in self.policies if name not in (LEARN, *COMPARATORS)}
        for field in FILES:
            values = [self.base.get(field), *(one.get(field) for one in self.listed), *self.grid.get(field, ())]
            found |= {value: field for value in values if names_file(field, value)}
        return found

    def text(self, versions: Mapping[str, str], files: Mapping[str, str]) -> str:
        """As TOML; :meth:`read` gives the same study back.

        Args:
            versions: Of what results depend on.
            files: Digests of the files that they depend on.
        """
        lines = [f"format = {FORMAT}\n", "\n[study]\n", f"trials = {self.trials}\n"]
        lines += [f"seeds = {_seeds_text(self.seeds)}\n", f"policies = {literal(self.policies)}\n"]
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


def _require_known(table: Mapping[str, Any], known: Sequence[str], told: Sequence[str], where: str) -> None:
    for key, value in table.items():
        if key not in known:
            near = difflib.get_close_matches(key, told, n=1, cutoff=0.5)
            hint = f"; did you mean {where}{near[0]}?" if near else ""
            raise ConfigurationError(f"{where}{key}", value, f"one of {', '.join(told)}{hint}")


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
    name = "study.seeds"
    if isinstance(value, Mapping):
        _require_known(value, ("first", "count"), ("first", "count"), f"{name}.")
        first, count = value.get("first", 0), value.get("count", 0)
        require_whole(f"{name}.first", first, 0, _MOST_SEED)
        require_whole(f"{name}.count", count, 1, MOST_CELLS)
        require_in(f"{name}.first", first, 0, _MOST_SEED - count)
        return range(first, first + count)
    if not isinstance(value, list) or not value:
        raise ConfigurationError(name, value, "a list of seeds, or { first = 0, count = 20 }")
    for seed in value:
        require_whole(name, seed, 0, _MOST_SEED)
    _once(name, value)
    run = range(value[0], value[0] + len(value))
    return run if list(run) == value else tuple(value)


def _policies(value: Any) -> tuple[str, ...]:
    name = "study.policies"
    accepted = f"{LEARN}, {', '.join(COMPARATORS)}, and policy files"
    if not isinstance(value, list) or not value or not all(isinstance(one, str) and one for one in value):
        raise ConfigurationError(name, value, f"a list of names: {accepted}")
    for one in value:
        if one not in (LEARN, *COMPARATORS) and not Path(one).is_file():
            raise ConfigurationError(name, one, accepted)
    return _once(name, value)


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
