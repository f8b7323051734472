"""What whole processes take: to start, to import, to keep in memory; several at once; and replaying what they left."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from benchmarks import cost, replay
from benchmarks.suite.rows import Form, MissingError, Row
from palpate.core.task_config import CONTROL_RATE_HZ

LIBRARIES = "import google.protobuf.message, lz4.frame, mcap.writer, mujoco, numpy, pinocchio, tqdm, tyro, zstandard"
"""What a command that runs trials loads besides palpate."""
COMMAND = "import palpate.adapters.cli.run"
PALPATE = (sys.executable, "-m", "palpate.adapters.cli.main")


def start_up(form: Form) -> list[Row]:
    """Wall time of whole processes."""
    seconds = cost.start_up_seconds(form.rounds)
    bare = seconds.pop("python -c pass")
    rows = [Row(name, 1e3 * value, "ms", "python -c pass", 1e3 * bare) for name, value in seconds.items()]
    ours, libraries = (median(_usage(code)[0] for _ in range(form.rounds)) for code in (COMMAND, LIBRARIES))
    return [*rows, Row("all that palpate run imports, CPU", 1e3 * ours, "ms", "the libraries in it", 1e3 * libraries)]


def memory(form: Form) -> list[Row]:
    """Largest resident memory."""
    libraries, command = _usage(LIBRARIES)[1], _usage(COMMAND)[1]
    few, many = max(form.trials // 3, 4), form.trials
    with tempfile.TemporaryDirectory() as folder:
        trained = [_trained_MB(Path(folder) / str(trials), trials) for trials in (few, many)]
    return [
        Row("all that palpate run imports", command, "MB", "the libraries in it", libraries),
        Row(f"palpate train, {few} trials", trained[0], "MB", "what it imports", command),
        Row(f"palpate train, {many} trials", trained[1], "MB", f"{few} trials", trained[0]),
    ]


def replayed(form: Form) -> list[Row]:
    """Replay against reading the logs and the core's own steps."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        replay.train(run, form.trials)
        found = replay.replay_speed(sorted((run / "logs").glob("*.mcap")))
    per_tick = 1e6 / found.ticks
    floor = (found.decoding_s + found.stepping_s) * per_tick
    return [
        Row("replay", found.whole_s * per_tick, "us a tick", "decoding and the core's step", floor),
        Row("times real time, one core", found.ticks / CONTROL_RATE_HZ / found.whole_s, "(more is better)"),
    ]


def environment(form: Form) -> list[Row]:
    """A step of a Gymnasium environment against its physics; published ones beside it where they are installed."""
    _require("gymnasium")
    from benchmarks import environment_overhead

    pythons = {
        name: Path(sys.executable) for name in environment_overhead.WORKERS if name not in environment_overhead.PEERS
    }
    if form.cache:
        cache = Path(form.cache).expanduser().resolve()
        pythons |= {peer: environment_overhead.python_of(peer, cache) for peer in environment_overhead.PEERS}
    rows = []
    rounds = max(form.rounds // 3, 1)
    for name, python in pythons.items():
        found = [
            environment_overhead.measured(name, python, 400 if form.name == "full" else 150) for _ in range(rounds)
        ]
        value, floor = (median(1e6 * one[what] / one["steps"] for one in found) for what in ("seconds", "floor"))
        rows.append(Row(f"step, {name}", value, "us", "its bare physics", floor))
    return rows


def scaling(form: Form) -> list[Row]:
    """Wall time of a study on several processes, against its share of the time on one."""
    seeds = 4
    trials = form.trials * 2
    text = f'[study]\ntrials = {trials}\nseeds = {{ first = 0, count = {seeds} }}\npolicies = ["torque"]\n'
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        file.write_text(text)
        one_s = _study_s(file, "--engine", "sequential", "--out", f"{folder}/one")
        many_s = _study_s(file, "--jobs", str(form.jobs), "--out", f"{folder}/many")
    name = f"{seeds} runs of {trials} trials, {form.jobs} processes"
    return [Row(name, many_s, "s", f"one process, its time over {form.jobs}", one_s / form.jobs)]


def _study_s(file: Path, *options: str) -> float:
    began = time.perf_counter()
    _run([*PALPATE, "study", str(file), *options])
    return time.perf_counter() - began


def _require(module: str) -> None:
    if importlib.util.find_spec(module) is None:
        raise MissingError(f"{module} is not installed")


def _usage(code: str) -> tuple[float, float]:
    """CPU seconds and largest resident memory in MB of a Python process."""
    return _run([sys.executable, "-c", code])


def _trained_MB(out: Path, trials: int) -> float:
    return _run([*PALPATE, "train", "--trials", str(trials), "--out", str(out)])[1]


def _run(words: list[str]) -> tuple[float, float]:
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(words)} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
