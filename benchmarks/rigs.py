"""Insertion over emulated wires in real time, beside the same policy and seeds in the bare simulator.

    python -m benchmarks.rigs --policy runs/paper/policy.json            20 trials a rig, then a sweep over backlash
    python -m benchmarks.rigs --policy runs/paper/policy.json --trials 5 --no-sweep

What counts as inserted is what the emulated cell saw: the peg at full depth. The trials' own account stands beside.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.emulated_rig import PALPATE, EmulatedRig
from palpate.adapters.log.reader import read_log

RIGS = (("zebra-nmc", "jr3-can"), ("cia402", "jr3-can"))


def times_of(out: Path) -> list[float]:
    if not (out / "trials.csv").exists():
        return []
    with (out / "trials.csv").open() as stream:
        return [float(row["exploration_time_s"]) for row in csv.DictReader(stream)]


def outcomes_of(out: Path) -> list[str]:
    with (out / "trials.csv").open() as stream:
        return [row["outcome"] for row in csv.DictReader(stream)]


def run_on_rig(
    folder: Path, policy: str, trials: int, seed: int, words: tuple[str, ...], more: tuple[str, ...] = ()
) -> tuple[int, Path, str]:
    """Trials on an emulated rig; how often the peg really went in, the run's folder, and what went wrong."""
    out = folder / "run"
    with EmulatedRig(folder, *words) as rig:
        call = [*PALPATE, "run", "--rig", str(rig.path), "--policy", policy, "--trials", str(trials)]
        call += ["--seed", str(seed), "--out", str(out), *more]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
    return rig.inserted, out, "" if done.returncode == 0 else done.stderr.strip().splitlines()[-1]


def latencies(out: Path) -> str:
    """How old samples were when the core saw them, and how late ticks were."""
    joints, late = [], []
    for path in sorted((out / "logs").glob("*.mcap")):
        for record in read_log(path).records():
            if record.joints is None or record.time_ns is None or record.deadline_ns is None:
                continue
            joints.append((record.time_ns - record.joints.source_time_ns) * 1e-6)
            late.append((record.time_ns - record.deadline_ns) * 1e-6)
    age, lateness = np.array(joints), np.array(late)
    return (
        f"joint angles {np.median(age):.1f} ms old (p99 {np.quantile(age, 0.99):.1f});"
        f" ticks late by {np.median(lateness):.2f} ms (p99.9 {np.quantile(lateness, 0.999):.2f})"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policy", required=True)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=500)
    parser.add_argument("--no-sweep", action="store_true")
    parser.add_argument("--only-sweep", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        bare = base / "bare"
        call = [*PALPATE, "run", "--policy", options.policy, "--trials", str(options.trials)]
        subprocess.run([*call, "--seed", str(options.seed), "--out", str(bare)], check=True, capture_output=True)
        reference = np.array(times_of(bare))
        print(
            f"bare simulator: {outcomes_of(bare).count('inserted')} of {options.trials} inserted,"
            f" median {np.median(reference):.2f} s, mean {reference.mean():.2f} s",
            flush=True,
        )
        for arm, force in () if options.only_sweep else RIGS:
            folder = base / arm
            folder.mkdir()
            words = ("--arm", arm, "--force", force)
            inserted, out, problem = run_on_rig(folder, options.policy, options.trials, options.seed, words)
            times = np.array(times_of(out))
            beside = ", ".join(f"{a:.1f}/{b:.1f}" for a, b in zip(times, reference, strict=False))
            print(f"{arm} and {force}: {inserted} of {options.trials} inserted {problem}")
            print(f"  median {np.median(times):.2f} s, mean {times.mean():.2f} s; {latencies(out)}")
            print(f"  seconds of exploration, rig/bare: {beside}", flush=True)
        if options.no_sweep:
            return
        for backlash in ("0.01", "0.02", "0.05", "0.1"):
            folder = base / f"backlash-{backlash}"
            folder.mkdir()
            words = ("--wrist-backlash-deg", backlash)
            inserted, out, problem = run_on_rig(folder, options.policy, options.trials // 2, options.seed, words)
            times = np.array(times_of(out) or [np.nan])
            tried = len(times_of(out))
            print(
                f"wrist backlash {backlash} deg: {inserted} of {tried} inserted,"
                f" median {np.median(times):.2f} s {problem}"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    main()
