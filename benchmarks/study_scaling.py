"""A study on every engine: whether its bytes are equal, what a killed worker costs, and what two processes gain.

    python -m benchmarks.study_scaling                          # 40 cells; a quarter of an hour on a quiet machine
    python -m benchmarks.study_scaling --seeds 2 --trials 2 --rounds 1

The gain of two processes over one is held against what two processes gain that do nothing but ``mj_step`` on the same
model: two cores share caches, memory and heat, so that is less than two. At least 0.9 of it is asked. All are measured
in turns, because a machine is not equally fast all the time; figures are medians over rounds. Exit code 1: something is
not as asked.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

ASKED = 0.9
STUDY = """
[study]
trials = {trials}
seeds = {{ first = 0, count = {seeds} }}
policies = ["q-learning", "random"]
[base]
task.time_limit_s = {limit}
[grid]
task.start_uncertainty_mm = [1.0, 2.0]
"""


def bare_steps(seconds: float, start: object, counts: object) -> None:
    """Step the model of a cell, and nothing else, for so many seconds."""
    import mujoco

    from palpate.adapters.config.run import RunConfig
    from palpate.adapters.mujoco.rig import SimulatedRig
    from palpate.core.trial import find_ready_pose

    config = RunConfig()
    cell = SimulatedRig(config, find_ready_pose(config.arm, config.task)).cell
    cell.reset(0, 0)
    model, data = cell.model, cell.data
    for _ in range(100):
        mujoco.mj_step(model, data, 20)
    start.wait()
    steps, end = 0, time.perf_counter() + seconds
    while time.perf_counter() < end:
        mujoco.mj_step(model, data, 20)
        steps += 20
    counts.put(steps / seconds)


def bare_rate(processes: int, seconds: float) -> float:
    """Steps a second of so many processes together."""
    context = multiprocessing.get_context("spawn")
    start, counts = context.Barrier(processes), context.Queue()
    workers = [context.Process(target=bare_steps, args=(seconds, start, counts)) for _ in range(processes)]
    for worker in workers:
        worker.start()
    rates = [counts.get() for _ in workers]
    for worker in workers:
        worker.join()
    return sum(rates)


def command(file: Path, out: Path, *words: object) -> list[str]:
    return [sys.executable, "-m", "palpate.adapters.cli.main", "study", str(file), "--out", str(out), *map(str, words)]


def study(file: Path, out: Path, *words: object) -> float:
    """Run the study; returns how long it took, s."""
    begin = time.perf_counter()
    subprocess.run(command(file, out, *words), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - begin


def digest(folder: Path) -> str:
    """Of every file below a folder, names included."""
    whole = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        whole.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return whole.hexdigest()[:16]


def finished(out: Path) -> dict[str, int]:
    """Finished cells, and when each was."""
    cells = out / "cells"
    names = [p for p in cells.iterdir() if p.suffix != ".unfinished"] if cells.exists() else []
    return {path.name: path.stat().st_mtime_ns for path in names}


def kill_in_the_middle(file: Path, out: Path, total: int) -> dict[str, object]:
    """Kill a worker when half of the cells are finished; what was finished must stay as it is."""
    running = subprocess.Popen(
        command(file, out, "--jobs", 2), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    wait_for(lambda: len(finished(out)) >= total // 2 and any(out.glob("cells/*.unfinished")), running)
    before = finished(out)
    children = Path(f"/proc/{running.pid}/task/{running.pid}/children").read_text().split()
    worker = next(c for c in children if b"spawn_main" in Path(f"/proc/{c}/cmdline").read_bytes())
    os.kill(int(worker), signal.SIGKILL)
    _, complaint = running.communicate()
    after = finished(out)
    return {
        "exit_code": running.returncode,
        "finished_when_killed": len(before),
        "of_these_made_again": sum(after.get(name) != at for name, at in before.items()),
        "cells_lost_and_made_anew": complaint.count("a worker died over"),
        "finished_at_the_end": len(after),
    }


def wait_for(condition: Callable[[], bool], process: subprocess.Popen[str]) -> None:
    while not condition():
        assert process.poll() is None, "the study ended before"
        time.sleep(0.01)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10, help="a study of four times as many cells")
    parser.add_argument("--trials", type=int, default=24)
    parser.add_argument("--limit", type=float, default=2.0, help="time limit of a trial, s")
    parser.add_argument("--rounds", type=int, default=3, help="rounds of timing")
    parser.add_argument("--bare-s", type=float, default=10.0, help="seconds of mj_step in each round")
    parser.add_argument("--out", type=Path, help="JSON file for the figures")
    options = parser.parse_args()
    total = 4 * options.seeds
    with tempfile.TemporaryDirectory() as name:
        desk = Path(name)
        file = desk / "study.toml"
        file.write_text(STUDY.format(trials=options.trials, seeds=options.seeds, limit=options.limit))
        digests: dict[str, str] = {}
        seconds: dict[str, list[float]] = {"sequential": [], "1 process": [], "2 processes": []}
        rates: dict[int, list[float]] = {1: [], 2: []}
        calls = {
            "sequential": ("--engine", "sequential"),
            "1 process": ("--jobs", 1),
            "2 processes": ("--jobs", 2),
        }
        for turn in range(options.rounds):
            for processes in rates:
                rates[processes].append(bare_rate(processes, options.bare_s))
            for label, words in calls.items():
                out = desk / f"{label}-{turn}"
                seconds[label].append(study(file, out, *words))
                digests[f"{label}, round {turn + 1}"] = digest(out)
                print(f"round {turn + 1}, {label}: {seconds[label][-1]:.1f} s", flush=True)
            print(f"round {turn + 1}, mj_step: {rates[1][-1]:.0f}/s in one, {rates[2][-1]:.0f}/s in two", flush=True)
        study(file, desk / "4", "--jobs", 4)
        digests["4 processes"] = digest(desk / "4")
        killed = kill_in_the_middle(file, desk / "killed", total)
        digests["2 processes, one killed"] = digest(desk / "killed")
    # Each round has its own ratio: what slows the machine down slows both.
    bare = median(two / one for one, two in zip(rates[1], rates[2], strict=True))
    gain = median(one / two for one, two in zip(seconds["sequential"], seconds["2 processes"], strict=True))
    pooled = median(one / two for one, two in zip(seconds["1 process"], seconds["2 processes"], strict=True))
    figures = {
        "cells": total,
        "trials": options.trials,
        "seconds": {label: round(median(values), 2) for label, values in seconds.items()},
        "gain_of_two_over_sequential": round(gain, 3),
        "gain_of_two_over_one_process": round(pooled, 3),
        "gain_of_two_bare_mj_step": round(bare, 3),
        "share_of_the_bare_gain": round(gain / bare, 3),
        "share_asked": ASKED,
        "digests": digests,
        "killed": killed,
    }
    print(json.dumps(figures, indent=1))
    if options.out:
        options.out.write_text(json.dumps(figures, indent=1) + "\n")
    sound = {
        "all bytes are equal": len(set(digests.values())) == 1,
        "a killed worker loses one cell, and nothing finished": killed
        == {
            "exit_code": 0,
            "finished_when_killed": killed["finished_when_killed"],
            "of_these_made_again": 0,
            "cells_lost_and_made_anew": 1,
            "finished_at_the_end": total,
        },
        f"two processes gain {ASKED} of what bare ones gain": gain >= ASKED * bare,
    }
    for what, holds in sound.items():
        print(f"{'holds' if holds else 'FAILS'}: {what}")
    return 0 if all(sound.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
