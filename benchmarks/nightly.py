"""Checks that take too long for ``make test``, each with its duration, and a summary table at the end.

    python -m benchmarks.nightly --jobs 2                  (make nightly)
    python -m benchmarks.nightly --only learning gate

Passed checks are stored in ``--out`` and not repeated for the same commit and seed. By default the seed depends on the
date, so that each night tests different parts, mutants and inputs. Python versions that are not installed are skipped
with a message. The exit code is 1 if a check fails.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path
from typing import Final, NamedTuple

from benchmarks.common import table

CHECKOUT: Final = Path(__file__).parents[1]
VERSIONS: Final = ("3.12", "3.13")
"""Python versions in addition to the current one and the one with the lowest versions of dependencies."""
EXTRAS: Final = ("dev", "gymnasium,cluster,video,rerun")
"""Extras for the tests. The second set is used if a package in the first has no wheel for a Python version."""
TOOLS: Final = (
    "pytest>=9.0.1",
    "pytest-xdist>=3.6",
    "pytest-timeout>=2.3",
    "hypothesis>=6.140",
    "pydot>=4.0.1",
    "aalpy>=2.0",
    "netft>=2.0.1",
    "rosbags>=0.11",
    "hatchling>=1.27",
    "grpcio-tools>=1.85",
)
ROOM: Final = 1.15
"""Maximum factor by which a ratio to its floor may exceed the committed ratio."""
_FUZZ_S: Final = 60
_PYTEST: Final = (sys.executable, "-m", "pytest", "-q", "--dist", "loadgroup")


class Settings(NamedTuple):
    """Settings that all checks receive."""

    seed: int
    jobs: int
    out: Path

    def bench(self, name: str, *arguments: object) -> list[str]:
        return [sys.executable, "-m", f"benchmarks.{name}", *map(str, arguments)]


class Result(NamedTuple):
    """Result of a check: passed, failed or skipped, and a one-line summary."""

    verdict: str
    line: str


def run(command: Sequence[object], log: Path) -> tuple[int, str]:
    """Run a command, store its output in a file, and return the exit code and the output."""
    done = subprocess.run(
        [*map(str, command)], cwd=CHECKOUT, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    log.write_text(done.stdout, encoding="utf-8")
    return done.returncode, done.stdout


def of_command(make: Callable[[Settings], Sequence[object]]) -> Callable[[Settings, Path], Result]:
    """Return a check that passes if its command succeeds. Its summary is the last line of the output."""

    def part(settings: Settings, log: Path) -> Result:
        code, output = run(make(settings), log)
        lines = output.strip().splitlines() or [""]
        return Result("passed" if code == 0 else "failed", lines[-1].strip("= "))

    return part


def suite_with(version: str, resolution: str = "highest") -> Callable[[Settings, Path], Result]:
    """Return a check that runs the tests with another Python version or the lowest versions of direct dependencies."""

    def part(settings: Settings, log: Path) -> Result:
        uv, interpreter = Path(sys.executable).with_name("uv"), installed(version)
        if interpreter is None:
            return Result("skipped", f"Python {version} is not installed")
        home = settings.out / f"python-{version}-{resolution}"
        python = home / "bin" / "python"
        pins = ["--resolution", resolution] if resolution != "highest" else ["-c", "constraints.txt"]
        run([uv, "venv", "--quiet", "--clear", "--python", interpreter, home], log)
        said = ""
        for extras in EXTRAS:
            more = TOOLS if extras != "dev" else ()
            code, text = run([uv, "pip", "install", "--python", python, *pins, "-e", f".[{extras}]", *more], log)
            if code == 0:
                break
            said = "; without what has no wheel for it"
        else:
            return Result("failed", f"cannot be installed: {text.strip().splitlines()[-1]}")
        command = [python, *_PYTEST[1:], "-n", settings.jobs]
        code, output = run([*command, "--ignore", "tests/wall_clock", "--ignore", "tests/documents"], log)
        shutil.rmtree(home)
        return Result("passed" if code == 0 else "failed", output.strip().splitlines()[-1].strip("= ") + said)

    return part


def installed(version: str) -> Path | None:
    """Return a working interpreter of this version from the path or from pyenv, or None if there is none."""
    found = [Path(path) for path in [shutil.which(f"python{version}")] if path]
    for path in [*found, *sorted(Path.home().glob(f".pyenv/versions/{version}*/bin/python"))]:
        said = subprocess.run([path, "--version"], text=True, capture_output=True)
        if said.stdout.startswith(f"Python {version}."):
            return path
    return None


def honest_trips(settings: Settings, log: Path) -> Result:
    """Run one evaluated trial of each of 300 random jobs. There are no faults, so every trip is a false alarm."""
    of = ["--parts", 300, "--trials", 2, "--seed", settings.seed, "--only", "best", "--jobs", settings.jobs]
    return _parts(settings, log, of, most_trips=1)


def parts(settings: Settings, log: Path) -> Result:
    """Run nine trials of each of 20 random parts."""
    of = ["--parts", 20, "--trials", 10, "--seed", settings.seed + 1, "--only", "best", "--jobs", settings.jobs]
    return _parts(settings, log, of, most_trips=1)


def _parts(settings: Settings, log: Path, arguments: Sequence[object], most_trips: int) -> Result:
    out = log.with_suffix(".jsonl")
    code, _ = run(settings.bench("parts", *arguments, "--out", out), log)
    if code:
        return Result("failed", f"see {log}")
    cells = [json.loads(line) for line in out.read_text(encoding="utf-8").splitlines()]
    rows = [row for cell in cells for row in cell["found"]["trials"]]
    trips = sum(bool(row["trip"]) for row in rows)
    false = sum(row["false"] for row in rows)
    line = f"{sum(row['in'] for row in rows)} of {len(rows)} inserted, {trips} trips, {false} false"
    return Result("passed" if trips <= most_trips and not false else "failed", line)


def bench(settings: Settings, log: Path) -> Result:
    """Compare the ratios of ``make bench`` with those in ``benchmarks/ratios.json``."""
    out = log.with_suffix(".json")
    code, _ = run(settings.bench("suite", "--quick", "--json", out), log)
    if code:
        return Result("failed", f"see {log}")
    found, kept = ratios(json.loads(out.read_text())), json.loads((CHECKOUT / "benchmarks/ratios.json").read_text())
    worse = [f"{name} {found[name]:.2f}, was {was:.2f}" for name, was in kept.items() if found[name] > ROOM * was]
    return Result("failed" if worse else "passed", "; ".join(worse) or f"{len(kept)} ratios within 15 %")


def ratios(figures: dict[str, list[dict[str, object]]]) -> dict[str, float]:
    """Return the ratio of each figure that has a floor, by the names of its group and the figure."""
    rows = [(group["title"], row) for group in figures["groups"] for row in group["rows"]]  # type: ignore[attr-defined]
    return {f"{title.split(',')[0]}: {row['name']}": row["ratio"] for title, row in rows if row["ratio"] is not None}


PARTS: Final[dict[str, Callable[[Settings, Path], Result]]] = {
    "learning": of_command(
        lambda s: [*_PYTEST, "-n", s.jobs, "-m", "nightly", "--ignore", "tests/wall_clock"],
    ),
    "honest trips": honest_trips,
    "parts": parts,
    "gate": of_command(lambda s: s.bench("gate", "--seeds", s.seed, "--jobs", s.jobs, "--out", s.out / "gate.jsonl")),
    "fuzz rdt": of_command(lambda s: s.bench("fuzz_rdt", "--seconds", _FUZZ_S, "--first-seed", 1000 * s.seed)),
    "fuzz rtde": of_command(lambda s: s.bench("fuzz_rtde", "--seconds", _FUZZ_S, "--first-seed", 1000 * s.seed)),
    "bench": bench,
    "wall clock": of_command(lambda s: [*_PYTEST, "-n", s.jobs, "-m", "not hardware", "tests/wall_clock"]),
    **{f"Python {version}": suite_with(version) for version in VERSIONS},
    "lowest versions": suite_with("3.11", "lowest-direct"),
}


def commit() -> str:
    """Return the commit of the checkout, marked if there are uncommitted changes."""
    said = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=CHECKOUT, text=True, capture_output=True)
    return said.stdout.strip() or "unknown"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=date.today().toordinal(), help="the day's by default")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--only", nargs="+", choices=tuple(PARTS), default=tuple(PARTS), metavar="PART")
    parser.add_argument("--out", type=Path, default=CHECKOUT / "runs" / "nightly")
    options = parser.parse_args()
    out = options.out / f"{commit()}-{options.seed}"
    out.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in options.only:
        stem = re.sub(r"\W+", "-", name)
        kept = out / f"{stem}.result.json"
        if kept.exists():
            row = json.loads(kept.read_text())
        else:
            print(f"{name} ...", flush=True)
            began = time.monotonic()
            result = PARTS[name](Settings(options.seed, options.jobs, out), out / f"{stem}.log")
            row = [name, result.verdict, f"{time.monotonic() - began:.0f} s", result.line]
            if result.verdict == "passed":
                kept.write_text(json.dumps(row) + "\n", encoding="utf-8")
        rows.append(row)
    print(table(("part", "verdict", "time", "figure"), rows))
    return int(any(row[1] == "failed" for row in rows))


if __name__ == "__main__":
    sys.exit(main())
