"""Lines and branches covered by the tests, by package, from the JSON report of coverage.py (make coverage).

    python -m benchmarks.covered runs/coverage.json --least 90

With ``--least``, the exit code is 1 if the branch coverage of supervision, motion, ports or drivers is lower.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from benchmarks.common import table

GUARDED: Final = ("core/supervision", "core/motion", "core/ports", "drivers/")


def by_package(files: Mapping[str, Any]) -> dict[str, tuple[int, int, int, int]]:
    """Return the covered and total lines and the covered and total branches of each package."""
    sums: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    for path, found in files.items():
        package = "/".join(Path(path).parts[2:4]) if path.count("/") > 3 else "/".join(Path(path).parts[2:3])
        one = found["summary"]
        for place, name in enumerate(("covered_lines", "num_statements", "covered_branches", "num_branches")):
            sums[package][place] += one[name]
    return {name: (each[0], each[1], each[2], each[3]) for name, each in sorted(sums.items())}


def percent(part: int, whole: int) -> float:
    return 100.0 * part / whole if whole else 100.0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path)
    parser.add_argument("--least", type=float, default=0.0, help="percent of the branches")
    options = parser.parse_args()
    packages = by_package(json.loads(options.report.read_text(encoding="utf-8"))["files"])
    rows = [
        (name, lines, f"{percent(ran, lines):.1f} %", branches, f"{percent(taken, branches):.1f} %")
        for name, (ran, lines, taken, branches) in packages.items()
    ]
    print(table(("package", "lines", "run", "branches", "taken"), rows))
    low = [
        name for name, (_, _, taken, branches) in packages.items()
        if name.startswith(GUARDED) and percent(taken, branches) < options.least
    ]  # fmt: skip
    if low:
        print(f"below {options.least:g} % of the branches: {', '.join(low)}")
    return int(bool(low))


if __name__ == "__main__":
    sys.exit(main())
