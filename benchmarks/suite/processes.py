"""What whole processes take: to start, to import, to keep in memory; several at once; and replaying what they left."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

from benchmarks import cost, replay
from benchmarks.suite.rows import Form, MissingError, Row
from palpate.core.ports.values import CONTROL_RATE_HZ

LIBRARIES = "import google.protobuf.message, lz4.frame, mcap.writer, mujoco, numpy, pinocchio, tqdm, tyro, zstandard"
"""What a command that runs trials loads besides palpate."""
COMMAND = "import palpate.adapters.cli.run"


def start_up(form: Form) -> list[Row]:
    """Wall time of whole processes."""
    seconds = cost.start_up_seconds(form.rounds)
    bare = seconds.pop("python -c pass")
    rows = [Row(name, 1e3 * value, "ms", "python -c pass", 1e3 * bare) for name, value in seconds.items()]
    ours, libraries = (median(cpu_s(code) for _ in range(form.rounds)) for code in (COMMAND, LIBRARIES))
    return [*rows, Row("all that palpate run imports, CPU", 1e3 * ours, "ms", "the libraries in it", 1e3 * libraries)]


def memory(form: Form) -> list[Row]:
    """Largest resident memory."""
    libraries, command = peak_MB(LIBRARIES), peak_MB(COMMAND)
    few, many = max(form.trials // 3, 4), form.trials
    with tempfile.TemporaryDirectory() as folder:
        trained = [peak_MB(_training(Path(folder) / str(trials), trials)) for trials in (few, many)]
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
    """Wall time of a study on two processes, against what two processes of bare physics gain."""
    if importlib.util.find_spec("benchmarks.study_scaling") is None:
        raise MissingError("benchmarks/study_scaling.py is not there")
    from benchmarks import study_scaling

    full = form.name == "full"
    seeds, trials, bare_s = (4, 12, 10.0) if full else (1, 12, 2.0)
    one_s, two_s, gains = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "study.toml"
        file.write_text(study_scaling.STUDY.format(trials=trials, seeds=seeds, limit=2.0))
        for turn in range(3 if full else 1):
            gains.append(study_scaling.bare_rate(2, bare_s) / study_scaling.bare_rate(1, bare_s))
            one_s.append(study_scaling.study(file, Path(folder) / f"one-{turn}", "--engine", "sequential"))
            two_s.append(study_scaling.study(file, Path(folder) / f"two-{turn}", "--jobs", 2))
    floor = median(one / gain for one, gain in zip(one_s, gains, strict=True))
    name = f"{4 * seeds} runs of {trials} trials, two processes"
    return [
        Row(name, median(two_s), "s", "one after the other, over the gain of bare mj_step", floor),
        Row("gain of two processes of bare mj_step", median(gains), "(2 at best)"),
    ]


def _require(module: str) -> None:
    if importlib.util.find_spec(module) is None:
        raise MissingError(f"{module} is not installed")


def cpu_s(code: str) -> float:
    """CPU time of a Python process."""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{code} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def peak_MB(code: str) -> float:
    """Largest resident memory of a Python process, by its own word.

    What the system tells its parent also counts the parent itself, of which the process was once a copy.
    """
    told = f"{code}\nimport sys\nsys.stdout.write('\\n' + open('/proc/self/status').read())"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("VmHWM:")]
    return float(line.split()[1]) / 1024


def _training(out: Path, trials: int) -> str:
    words = ["train", "--trials", str(trials), "--out", str(out)]
    return f"from palpate.adapters.cli.main import main\nif main({words!r}): raise SystemExit('it failed')"
