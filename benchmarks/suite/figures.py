"""Figures of the suite, each next to a floor of the same run, and their table."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import floor, log10
from pathlib import Path
from typing import Any

from palpate.adapters.log.provenance import made_with

SCHEMA = "palpate.benchmarks/2"
HEAD = ("figure", "measured", "floor", "ratio")
_BUSY = 1.0
"""Above this load other work counts."""
_PACKAGES = ("palpate", "mujoco", "pin", "numpy", "scipy", "torch")


@dataclass(frozen=True)
class Row:
    """One figure; less is better, except where the unit says otherwise.

    Attributes:
        floor: What it is compared with, measured in the same run; empty for nothing.
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
class Form:
    """How much is measured.

    Attributes:
        trials: Trials of a run that is timed.
        rounds: Repetitions of what is short.
        walks: Strings from which automata are inferred.
        steps: Steps of an environment.
        cache: Folder with the virtual environments of other environments; empty leaves them out.
    """

    name: str
    trials: int
    rounds: int
    walks: int
    steps: int
    cache: str = ""


QUICK = Form("quick", trials=8, rounds=5, walks=300, steps=150)
FULL = Form("full", trials=350, rounds=20, walks=1000, steps=400)


@dataclass(frozen=True)
class Group:
    """Figures of one subject.

    Attributes:
        missing: Why there are no figures; empty where there are.
    """

    title: str
    rows: tuple[Row, ...] = ()
    seconds: float = 0.0
    missing: str = ""


@dataclass(frozen=True)
class Benchmark:
    """One benchmark, by its name on the command line."""

    name: str
    title: str
    measure: Callable[[Form], list[Row]]


def machine() -> dict[str, str]:
    """Processor, memory, system and versions."""
    versions = {name: version for name, version in made_with().items() if name in _PACKAGES}
    memory_GB = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    return {
        "processor": f"{_processor()}, {os.cpu_count()} cores",
        "memory": f"{memory_GB:.0f} GB",
        "system": f"{platform.system()} {platform.release()}",
        "Python": platform.python_version(),
        **versions,
    }


def _as_text(facts: dict[str, str]) -> str:
    """The machine in one line; versions with their names."""
    plain = ("processor", "memory", "system")
    return ", ".join(value if name in plain else f"{name} {value}" for name, value in facts.items())


def as_dict(form: Form, facts: dict[str, str], load: float, groups: list[Group]) -> dict[str, Any]:
    """Plain JSON values, ratios included."""
    described = [
        {**asdict(group), "rows": [{**asdict(row), "ratio": row.ratio} for row in group.rows]} for group in groups
    ]
    return {"schema": SCHEMA, "form": form.name, "machine": facts, "load": load, "groups": described}


def table(form: Form, facts: dict[str, str], load: float, groups: list[Group]) -> str:
    """All figures, in columns."""
    busy = " (busy: times are too long, and ratios less sure)" if load > _BUSY else ""
    parts = [f"{form.name} form; {_as_text(facts)}; load at the beginning {load:.1f}{busy}\n"]
    for group in groups:
        parts.append(f"\n{group.title}  ({group.seconds:.0f} s)\n")
        if group.missing:
            parts.append(f"  not measured: {group.missing}\n")
            continue
        lines = [HEAD, *(_cells(row) for row in group.rows)]
        widths = [max(len(line[column]) for line in lines) for column in range(len(HEAD))]
        for line in lines:
            text = "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))
            parts.append(f"  {text}".rstrip() + "\n")
    return "".join(parts)


def _cells(row: Row) -> tuple[str, str, str, str]:
    against = f"{row.floor}: {_number(row.floor_value)}" if row.floor_value is not None else row.floor
    ratio = "" if row.ratio is None else f"{row.ratio:.3f}" if row.ratio < 0.1 else f"{row.ratio:.2f}"
    return row.name, f"{_number(row.value)} {row.unit}", against, ratio


def _number(value: float) -> str:
    """Three significant digits, without powers of ten."""
    if value == 0.0:
        return "0"
    return f"{value:.{max(2 - floor(log10(abs(value))), 0)}f}"


def _processor(cpuinfo: Path = Path("/proc/cpuinfo")) -> str:
    """The processor's name, as far as the system reports it."""
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
