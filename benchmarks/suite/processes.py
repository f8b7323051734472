"""Costs of whole processes: start-up, memory, replay, automata and Gymnasium environments."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter, process_time

from benchmarks import environment_overhead, replay
from benchmarks.suite.figures import Form, Row
from palpate.core.ports.values import CONTROL_RATE_HZ

LIBRARIES = "import google.protobuf.message, lz4.frame, mcap.writer, mujoco, numpy, pinocchio, tqdm, tyro, zstandard"
"""What a command that runs trials loads in addition to palpate."""
COMMAND = "import palpate.adapters.cli.run"
CORE = "import palpate.core.control_loop, palpate.core.tasks.insertion, palpate.core.policy, palpate.core.supervision"
SEED = 200


def start_up(form: Form) -> list[Row]:
    palpate = [sys.executable, "-m", "palpate.adapters.cli.main"]
    bare_ms = _wall_ms([sys.executable, "-c", "pass"], form.rounds)
    calls = {
        "import palpate.core": [sys.executable, "-c", "import palpate.core"],
        "what a trial uses of the core": [sys.executable, "-c", CORE],
        "palpate --help": [*palpate, "--help"],
        "palpate train --help": [*palpate, "train", "--help"],
    }
    rows = [Row(name, _wall_ms(call, form.rounds), "ms", "python -c pass", bare_ms) for name, call in calls.items()]
    ours, libraries = (median(_cpu_s(code) for _ in range(form.rounds)) for code in (COMMAND, LIBRARIES))
    return [*rows, Row("imports of palpate run, CPU", 1e3 * ours, "ms", "the libraries in it", 1e3 * libraries)]


def memory(form: Form) -> list[Row]:
    libraries, command = _peak_MB(LIBRARIES), _peak_MB(COMMAND)
    few, many = max(form.trials // 3, 4), form.trials
    with tempfile.TemporaryDirectory() as folder:
        trained = [_peak_MB(_training(Path(folder) / str(trials), trials)) for trials in (few, many)]
    return [
        Row("imports of palpate run", command, "MB", "the libraries in it", libraries),
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
    floor_us = (found.decoding_s + found.stepping_s) * per_tick
    return [
        Row("replay", found.whole_s * per_tick, "us a tick", "decoding and the core's step", floor_us),
        Row("times real time, one core", found.ticks / CONTROL_RATE_HZ / found.whole_s, "(more is better)"),
    ]


def inferred(form: Form) -> list[Row]:
    """Inference from random walks on the paper's first map."""
    from palpate.adapters.experiments.grid import grid_named
    from palpate.core.automata.infer import InferenceSettings, infer
    from palpate.core.automata.training import TrainingSettings
    from palpate.simulation.grid.trial import walk_strings

    strings = walk_strings(grid_named("1", 7), form.walks, SEED, 30)
    began = process_time()
    infer(strings, InferenceSettings(training=TrainingSettings(seed=SEED)))
    return [Row(f"automaton from {form.walks} strings", process_time() - began, "s")]


def environment(form: Form) -> list[Row]:
    """A step of an environment against its physics; published ones too where a cache for them is given."""
    workers, peers = environment_overhead.WORKERS, environment_overhead.PEERS
    pythons = {name: Path(sys.executable) for name in workers if name not in peers}
    if form.cache:
        cache = Path(form.cache).expanduser().resolve()
        pythons |= {peer: environment_overhead.python_of(peer, cache) for peer in peers}
    rows = []
    for name, python in pythons.items():
        rounds = range(max(form.rounds // 3, 1))
        found = [environment_overhead.measured(name, python, form.steps) for _ in rounds]
        value, floor = (median(1e6 * one[what] / one["steps"] for one in found) for what in ("seconds", "floor"))
        rows.append(Row(f"step, {name}", value, "us", "its bare physics", floor))
    return rows


def _wall_ms(command: list[str], runs: int) -> float:
    times = []
    for _ in range(runs):
        began = perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(1e3 * (perf_counter() - began))
    return median(times)


def _cpu_s(code: str) -> float:
    """CPU time of a Python process."""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{code} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def _peak_MB(code: str) -> float:
    """Largest resident memory of a Python process, by its own account.

    What the system reports to its parent also counts the parent, of which the process was once a copy.
    """
    text = f"{code}\nimport sys\nsys.stdout.write('\\n' + open('/proc/self/status').read())"
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("VmHWM:")]
    return float(line.split()[1]) / 1024


def _training(out: Path, trials: int) -> str:
    words = ["train", "--trials", str(trials), "--out", str(out)]
    return f"from palpate.adapters.cli.main import main\nif main({words!r}): raise SystemExit('it failed')"
