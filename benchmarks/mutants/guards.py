"""Which tests guard a file: those of its room, the golden logs, the contracts."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

Stage = tuple[str, list[str]]
"""A name, and test files in the order in which they are run."""

ELSEWHERE = {"cli": ("tests/cli", "tests/integration/test_cli_{stem}.py")}
"""Tests of rooms that are not below tests/unit: folders, or patterns of files."""
REAL_TIME = ("cia402", "jr3", "zebra")
"""Contracts that may wait on the wall clock for emulated devices: they come last, unless they are the file's own."""


def guards(checkout: Path, file: str) -> list[Stage]:
    """The stages for a source file, the most telling tests first."""
    golden = sorted((checkout / "tests").rglob("test_golden_logs.py"))
    contracts = sorted((checkout / "tests" / "contracts").rglob("test_*.py"))
    contracts.sort(key=lambda path: (not _own(path, file), any(name in path.stem for name in REAL_TIME)))
    stages = ("room", room_tests(checkout, file)), ("golden", golden), ("contracts", contracts)
    return [(name, [str(path.relative_to(checkout)) for path in paths]) for name, paths in stages if paths]


def room_tests(checkout: Path, file: str) -> list[Path]:
    """Unit tests of a file's room: first those that are named like it, then those of its folder, then all others.

    A module directly below the root's package is a room whose tests stand side by side with those of others of its
    kind, in no folder of their own: of these count those that import it.
    """
    root, _, _, *inner = PurePosixPath(file).parts
    unit, stem = checkout / "tests" / "unit" / root, PurePosixPath(file).stem
    same_name = unit / f"test_{stem}.py"
    if len(inner) == 1:
        imported = re.compile(rf"palpate\.{root}(\.{stem}\b| import .*\b{stem}\b)")
        found = [path for path in sorted(unit.glob("test_*.py")) if imported.search(path.read_text(encoding="utf-8"))]
    else:
        folder = unit.joinpath(*inner[:-1])
        same_name = folder / same_name.name if folder.exists() else same_name
        found = [*sorted(folder.glob("test_*.py")), *sorted((unit / inner[0]).rglob("test_*.py"))]
        for pattern in ELSEWHERE.get(inner[0], ()):
            place = checkout / pattern.format(stem=stem)
            found += sorted(place.rglob("test_*.py")) if place.is_dir() else [place]
        found.sort(key=lambda path: path.stem not in (f"test_{stem}", f"test_{inner[0]}_{stem}"))
    return [path for path in dict.fromkeys([same_name, *found]) if path.exists()]


def _own(contract: Path, file: str) -> bool:
    return any(part.startswith(contract.stem.removeprefix("test_")) for part in PurePosixPath(file).parts)
