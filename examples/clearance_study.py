"""Run a study of two policies, two clearances and two seeds from a TOML file, and write a report.

The script shows a progress bar for the eight conditions in ``clearance.toml``. It then prints the success rate and the
median time for each policy and clearance. If you stop it with Ctrl-C, run it again to continue. It takes a minute or
two. With ``--quick`` it makes two runs of two short trials in a few seconds.

``palpate study examples/clearance.toml`` followed by ``palpate report runs/clearance`` does the same.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from statistics import mean

from palpate.adapters.cli.main import main as palpate

STUDY = Path(__file__).with_name("clearance.toml")
HOLE = "part.hole_mm"
QUICK = {"trials = 40": "trials = 2", "seeds = [0, 1]": "seeds = [0]", "[29.1, 29.3]": "[29.3]"}


def quick_copy(folder: Path) -> Path:
    """Return the same study with fewer and shorter trials."""
    text = STUDY.read_text(encoding="utf-8")
    for before, after in QUICK.items():
        text = text.replace(before, after)
    path = folder / "clearance.toml"
    path.write_text(text.replace("[grid]", "task.time_limit_s = 2.0\n\n[grid]"), encoding="utf-8")
    return path


def print_table(table: Path) -> None:
    """Print the means over the seeds, from the study's table of all runs."""
    groups: defaultdict[tuple[str, str], list[dict[str, str]]] = defaultdict(list)
    with table.open(encoding="utf-8", newline="") as stream:
        for row in csv.DictReader(stream):
            groups[row["policy"], row[HOLE]].append(row)
    for (policy, hole), rows in groups.items():
        success, time_s = (mean(float(row[name]) for row in rows) for name in ("success", "median_s"))
        print(f"{policy}, hole of {hole} mm: {success:.0%} inserted, median {time_s:.2f} s")


def main() -> None:
    """Parse the command line, and run the script."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="make only two runs of two short trials")
    parser.add_argument("--out", type=Path, default=Path("runs/clearance"), help="folder of the study")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        file = quick_copy(Path(scratch)) if options.quick else STUDY
        code = palpate(["study", str(file), "--out", str(options.out), "--jobs", "1" if options.quick else "0"])
    if code:
        sys.exit(code)
    print_table(options.out / "summary.csv")
    if code := palpate(["report", str(options.out)]):
        sys.exit(code)
    print(f"look at {options.out}/report.html")


if __name__ == "__main__":
    main()
