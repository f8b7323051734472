"""Insertion over emulated connections in real time, compared with the same policy and seed in the bare simulator.

    python -m benchmarks.rigs --policy runs/paper/policy.json
    python -m benchmarks.rigs --policy runs/paper/policy.json --trials 10

A trial counts as an insertion if the peg is at full depth in the emulated cell.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.common import table
from benchmarks.emulated_rig import PALPATE, EmulatedRig
from palpate.adapters.log.reader import read_log

RIGS = (("zebra-nmc", "jr3-can"), ("cia402", "jr3-can"))
HEAD = (
    "rig",
    "inserted",
    "median s",
    "mean s",
    "age of joint angles, median, p99, ms",
    "ticks late, median, p99.9, ms",
)


def times_of(out: Path) -> list[float]:
    if not (out / "trials.csv").exists():
        return []
    with (out / "trials.csv").open() as stream:
        return [float(row["exploration_time_s"]) for row in csv.DictReader(stream)]


def run(out: Path, policy: str, trials: int, seed: int, *words: str) -> str:
    """Run trials of a policy, and return the error message, or an empty string on success."""
    call = [*PALPATE, "run", "--policy", policy, "--trials", str(trials), "--seed", str(seed), "--out", str(out)]
    done = subprocess.run([*call, *words], capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else done.stderr.strip().splitlines()[-1]


def latencies(out: Path) -> tuple[str, str]:
    """Return the age of samples when the core received them, and how late ticks were."""
    ages_ms, late_ms = [], []
    for path in sorted((out / "logs").glob("*.mcap")):
        for record in read_log(path).records():
            if record.joints is not None and record.time_ns is not None and record.deadline_ns is not None:
                ages_ms.append((record.time_ns - record.joints.source_time_ns) * 1e-6)
                late_ms.append((record.time_ns - record.deadline_ns) * 1e-6)
    if not ages_ms:
        return "", ""
    spreads = [np.quantile(values, marks) for values, marks in ((ages_ms, (0.5, 0.99)), (late_ms, (0.5, 0.999)))]
    return f"{spreads[0][0]:.1f}, {spreads[0][1]:.1f}", f"{spreads[1][0]:.2f}, {spreads[1][1]:.2f}"


def line(name: str, inserted: int, trials: int, out: Path) -> tuple[object, ...]:
    times_s = times_of(out) or [float("nan")]
    return name, f"{inserted} of {trials}", float(np.median(times_s)), float(np.mean(times_s)), *latencies(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policy", required=True)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=500)
    parser.add_argument("--priority", type=int, default=60, help="of the emulated devices")
    options = parser.parse_args()
    rigs = [(f"{arm} and {force}", ("--arm", arm, "--force", force)) for arm, force in RIGS]
    with tempfile.TemporaryDirectory() as name:
        bare = Path(name) / "bare"
        problems = [run(bare, options.policy, options.trials, options.seed)]
        with (bare / "trials.csv").open() as stream:
            inserted = sum(row["outcome"] == "inserted" for row in csv.DictReader(stream))
        rows = [line("bare simulator", inserted, options.trials, bare)]
        for number, (title, words) in enumerate(rigs):
            folder = Path(name) / str(number)
            folder.mkdir()
            with EmulatedRig(folder, *words, "--priority", str(options.priority)) as rig:
                more = ("--rig", str(rig.path), "--real-time.scheduling")
                problems.append(run(folder / "run", options.policy, options.trials, options.seed, *more))
            rows.append(line(title, rig.inserted, options.trials, folder / "run"))
    print(table(HEAD, rows))
    print("\n".join(filter(None, problems)))


if __name__ == "__main__":
    main()
