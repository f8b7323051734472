"""What benchmarks find, as plain values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

SCHEMA = "palpate.benchmarks/1"


@dataclass(frozen=True)
class Row:
    """One figure.

    Attributes:
        name: What was measured.
        value: The figure; less is better, except where the unit says otherwise.
        unit: Its unit.
        floor: What it is held against, measured in the same run; empty where nothing is.
        floor_value: The same figure of that, in the same unit.
    """

    name: str
    value: float
    unit: str
    floor: str = ""
    floor_value: float | None = None

    @property
    def ratio(self) -> float | None:
        """Value over floor; None without a floor."""
        return self.value / self.floor_value if self.floor_value else None


@dataclass(frozen=True)
class Group:
    """What belongs together.

    Attributes:
        title: What it is about.
        rows: The figures.
        notes: What has to be said about them.
        seconds: Wall time that measuring took.
        missing: Why there are no figures; empty where there are.
        failed: Whether they are missing because something broke.
    """

    title: str
    rows: tuple[Row, ...] = ()
    notes: str = ""
    seconds: float = 0.0
    missing: str = ""
    failed: bool = False


@dataclass(frozen=True)
class Suite:
    """All of a run.

    Attributes:
        form: ``quick`` or ``full``.
        machine: Description of the machine, by what.
        groups: The figures.
        busy: Load of the machine at the beginning: processes that were running or waited to, mean over a minute.
    """

    form: str
    machine: dict[str, str]
    groups: tuple[Group, ...]
    busy: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON values, ratios included."""
        told = {"schema": SCHEMA, **asdict(self)}
        for group, rows in zip(told["groups"], self.groups, strict=True):
            for row, figure in zip(group["rows"], rows.rows, strict=True):
                row["ratio"] = figure.ratio
        return told

    @classmethod
    def of(cls, told: dict[str, Any]) -> Suite:
        """Back from plain JSON values.

        Raises:
            ValueError: They are not those of a suite.
        """
        schema = told.get("schema") if isinstance(told, dict) else None
        if schema != SCHEMA:
            raise ValueError(f"schema {schema!r}, not {SCHEMA!r}")
        groups = []
        for group in told["groups"]:
            rows = tuple(Row(**{name: row[name] for name in Row.__dataclass_fields__}) for row in group["rows"])
            groups.append(Group(**{**group, "rows": rows}))
        return cls(told["form"], told["machine"], tuple(groups), told["busy"])


@dataclass(frozen=True)
class Form:
    """How much is measured.

    Attributes:
        name: ``quick`` or ``full``.
        trials: Trials of a run that is timed.
        rounds: Repetitions of what is short.
        restarts: Networks that are trained.
        walks: Strings that they are trained on.
        machines: Automata that are minimised.
        cache: Folder with the peers' virtual environments; empty leaves these peers out.
    """

    name: str
    trials: int
    rounds: int
    restarts: int
    walks: int
    machines: int
    cache: str = ""


QUICK = Form("quick", trials=8, rounds=5, restarts=64, walks=300, machines=600)
FULL = Form("full", trials=350, rounds=20, restarts=64, walks=1000, machines=10_000)


class MissingError(Exception):
    """Something is not there that a benchmark needs; the others can do without it."""


@dataclass(frozen=True)
class Benchmark:
    """One benchmark.

    Attributes:
        name: How it is called on the command line.
        title: What it is about.
        measure: Measures.
        notes: What has to be said about its figures.
    """

    name: str
    title: str
    measure: Callable[[Form], list[Row]]
    notes: str = field(default="")
