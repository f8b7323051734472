"""Replay of a whole training run bit for bit, detection of changes by the regression gate, and the speed of a replay.

    python -m benchmarks.replay                              350 trials, 1000 changes of each kind
    python -m benchmarks.replay --trials 3 --changes 10      the same, smaller
    python -m benchmarks.replay --run DIR                    a run that is there already

The floor for the speed is reading and decoding the same logs and running the bare core on the same snapshots in the
same process, without ports, comparison or anything else.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import palpate.core
from palpate.adapters.log.container import RawMessage
from palpate.adapters.log.reader import read_log
from palpate.adapters.log.records import TickRecord
from palpate.adapters.replay.batch import replay_file
from palpate.adapters.replay.engine import Replay, Verdict
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.ports.values import CONTROL_RATE_HZ, Snapshot
from tests.support.log_surgery import changed, indices, messages_of, one_ulp, write_log

Change = Callable[[Any], None]
PALPATE = [sys.executable, "-m", "palpate.adapters.cli.main"]


def whole_run(run: Path) -> None:
    """Replay every log in new processes, with one and with two workers."""
    outputs = []
    for jobs in (1, 2):
        done = subprocess.run(
            [*PALPATE, "replay", str(run), "--jobs", str(jobs), "--verbose"],
            capture_output=True,
            text=True,
            check=False,
        )
        lines = done.stdout.splitlines()
        print(f"fresh process, {jobs} worker{'s' * (jobs > 1)}: exit code {done.returncode}; " + "; ".join(lines[-3:]))
        outputs.append(re.sub(r"in .* s with .*", "", done.stdout))
    print(f"both say the same: {outputs[0] == outputs[1]}", flush=True)


@dataclass(frozen=True)
class Kind:
    """A kind of mutant: its channel, its change, and the field that the replay must report."""

    name: str
    topic: str
    make: Callable[[random.Random], tuple[Change, str]]


def _vector(field: str, length: int) -> Callable[[random.Random], tuple[Change, str]]:
    def make(rng: random.Random) -> tuple[Change, str]:
        place = rng.randrange(length)
        return one_ulp(field, place, rng.random() < 0.5), f"{field}[{place}]"

    return make


def _scalar(field: str) -> Callable[[random.Random], tuple[Change, str]]:
    return lambda rng: (one_ulp(field, None, rng.random() < 0.5), field)


OUTPUTS = (
    Kind("command asked", "/tick", _vector("requested_rad", 6)),
    Kind("command applied", "/tick", _vector("applied_rad", 6)),
    Kind("decision's temperature", "/decision", _scalar("temperature")),
    Kind("decision's reinforcement", "/reinforcement", _scalar("reinforcement")),
)


def _inner(message: str, field: str, length: int) -> Callable[[random.Random], tuple[Change, str]]:
    def make(rng: random.Random) -> tuple[Change, str]:
        place, upwards = rng.randrange(length), rng.random() < 0.5
        return lambda made: one_ulp(field, place, upwards)(getattr(made, message)), ""

    return make


INPUTS = (
    Kind("force sample", "/tick", _inner("wrench", "force_N", 3)),
    Kind("torque sample", "/tick", _inner("wrench", "torque_Nm", 3)),
    Kind("joint sample", "/tick", _inner("joints", "position_rad", 6)),
)


def mutants(logs: list[Path], count: int) -> None:
    """Change numbers by one unit in the last place, with valid checksums, and count the changes that are detected."""
    rng, rebuilder = random.Random(0), Rebuilder()
    taken = rng.sample(logs, min(10, len(logs)))
    apart = {log: messages_of(log) for log in taken}
    for kind in OUTPUTS:
        results = Counter[str]()
        for _ in range(count):
            messages = apart[rng.choice(taken)]
            index = rng.choice(indices(messages, kind.topic))
            change, field = kind.make(rng)
            one = _replayed(changed(messages, index, change), rebuilder)
            tick = _tick_of(messages[index])
            results["caught"] += one.verdict is Verdict.DIVERGED
            where = one.first is not None and (one.first.tick, one.first.channel, one.first.field)
            results["right tick and field"] += where == (tick, kind.topic, field)
        print(f"{kind.name} changed by one ulp, {count} times: {dict(results)}", flush=True)
    for kind in INPUTS:
        altered = 0
        for _ in range(count):
            messages = apart[rng.choice(taken)]
            index = rng.choice(indices(messages, kind.topic))
            one = _replayed(changed(messages, index, kind.make(rng)[0]), rebuilder)
            altered += one.verdict is not Verdict.EQUAL
        print(f"{kind.name} changed by one ulp, {count} times: alters an output in {altered}", flush=True)


def _replayed(messages: list[RawMessage], rebuilder: Rebuilder) -> Replay:
    with tempfile.TemporaryDirectory() as folder:
        return replay_file(write_log(Path(folder) / "mutant.mcap", messages), rebuilder)


def _tick_of(message: RawMessage) -> int:
    found: list[int] = []
    changed([message], 0, lambda made: found.append(made.tick))
    return found[0]


def changed_core(log: Path) -> None:
    """Change a gain in a copy of the core by one part in 10^12, and check that the gate fails with this copy."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "palpate" / "core"
        shutil.copytree(Path(str(palpate.core.__file__)).parent, copy)
        source = copy / "motion" / "controllers.py"
        text = source.read_text()
        gain = "1.0 / damping_N_s_per_m"
        if gain not in text:
            raise SystemExit(f"{source.name} no longer says {gain}")
        source.write_text(text.replace(gain, f"(1.0 + 1e-12) * {gain}"))
        done = subprocess.run(
            [*PALPATE, "replay", str(log)],
            capture_output=True,
            text=True,
            check=False,
            env=os.environ | {"PYTHONPATH": folder},
        )
        print(f"gate on the changed core: exit code {done.returncode}")
        print("\n".join(line for line in done.stdout.splitlines() if "/tick" in line))


@dataclass(frozen=True)
class Speed:
    """CPU time of replaying logs, and of the same work without ports and comparison.

    Attributes:
        ticks: Number of control ticks.
        whole_s: Time for the replay.
        decoding_s: Time for reading and decoding the logs.
        stepping_s: Time for running the core on the same snapshots.
    """

    ticks: int
    whole_s: float
    decoding_s: float
    stepping_s: float


def replay_speed(logs: list[Path]) -> Speed:
    rebuilder = Rebuilder()
    replay_file(logs[0], rebuilder)
    began = time.process_time()
    ticks = sum(replay_file(path, rebuilder).ticks for path in logs)
    whole = time.process_time() - began
    decoding = stepping = 0.0
    for path in logs:
        began = time.process_time()
        log = read_log(path)
        records = list(log.records())
        decoding += time.process_time() - began
        rebuilt = rebuilder.rebuild(log)
        snapshots = _snapshots(records)
        task = rebuilt.task
        task.begin(rebuilt.setup)
        began = time.process_time()
        for snapshot in snapshots:
            task.sense(snapshot)
            task.act()
        stepping += time.process_time() - began
    return Speed(ticks, whole, decoding, stepping)


def speed(logs: list[Path]) -> None:
    """Return the speed relative to real time on one core, and that of the same work without ports and comparison."""
    found = replay_speed(logs)
    ticks, whole = found.ticks, found.whole_s
    real = ticks / CONTROL_RATE_HZ
    print(f"{len(logs)} logs, {ticks} ticks, {real:.0f} s of trials replayed in {whole:.2f} CPU s on one core")
    print(f"{real / whole:.0f} times real time (at least 80, aim 200); {whole / ticks * 1e6:.1f} us a tick")
    decoding_us, stepping_us = found.decoding_s / ticks * 1e6, found.stepping_s / ticks * 1e6
    print(f"floor: decoding {decoding_us:.1f} us and the core's step {stepping_us:.1f} us a tick")
    floor = found.decoding_s + found.stepping_s
    print(f"replay over floor: {whole / floor:.2f}; the floor itself is {real / floor:.0f} times real time", flush=True)


def _snapshots(records: list[TickRecord]) -> list[Snapshot]:
    snapshots, applied = [], None
    for r in records:
        if r.wrench is None or r.joints is None or r.time_ns is None:
            raise SystemExit(f"tick {r.tick} is not whole")
        snapshots.append(Snapshot(r.tick, r.time_ns, r.wrench, r.joints, applied))
        applied = r.applied
    return snapshots


def train(run: Path, trials: int) -> None:
    """Record a training run."""
    call = [*PALPATE, "train", "--trials", str(trials), "--seed", "300", "--out", str(run)]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=350)
    parser.add_argument("--changes", type=int, default=1000, help="of each kind")
    parser.add_argument("--run", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        run = options.run
        if run is None:
            run = Path(folder) / "run"
            train(run, options.trials)
        logs = sorted((run / "logs").glob("*.mcap"))
        whole_run(run)
        speed(logs)
        changed_core(logs[-1])
        mutants(logs, options.changes)


if __name__ == "__main__":
    main()
