"""Folders of results, made by real short runs: for tests of reports, and for looking at reports in a browser.

`python -m tests.browser.sample_folders DIR` makes one of each kind in a new folder.
"""

import random
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from palpate.adapters.log.schema import BY_ID, message_class
from tests.command_line import CommandLine
from tests.support.log_surgery import messages_of, write_log


def make_study(folder: Path, steps_mm: Sequence[float], seeds: Sequence[int], trials: int, time_limit_s: float) -> Path:
    """A study over one setting, with a policy that learns and one that does not."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    file = folder.with_suffix(".toml")
    file.write_text(
        f'[study]\ntrials = {trials}\nseeds = {list(seeds)}\npolicies = ["q-learning", "torque"]\n\n'
        f'[base]\n"task.time_limit_s" = {time_limit_s}\n\n[grid]\n"task.step_mm" = {list(steps_mm)}\n'
    )
    CommandLine().succeed("study", file, "--out", folder, "--engine", "sequential")
    return folder


def in_real_time(log: Path) -> None:
    """Change a log of the simulator into one whose ticks began late, as on a real clock."""
    messages = messages_of(log)
    chance = random.Random(0)
    changed = []
    for message in messages:
        kind = BY_ID[message.channel].message
        if kind == "Tick":
            made: Any = message_class(kind)()
            made.ParseFromString(message.payload)
            made.deadline_ns = made.time_ns
            made.time_ns += round(chance.expovariate(1 / 60e3)) + 2_000_000 * (chance.random() < 0.002)
            message = message._replace(payload=made.SerializeToString(deterministic=True))
        changed.append(message)
    log.unlink()
    write_log(log, changed)


def make_all(desk: Path) -> None:
    """A folder of every kind."""
    palpate = CommandLine().succeed
    palpate("train", "--trials", 25, "--out", desk / "train")
    palpate("run", "--policy", "torque", "--trials", 6, "--out", desk / "run")
    for log in sorted((desk / "run" / "logs").glob("*.mcap")):
        in_real_time(log)
    # A name that would break a layout which trusts names, and a state space of another kind.
    long_name = desk / ("a-run-whose-name-is-long-because-somebody-wrote-all-settings-into-it-" * 2 + "<b>&amp;")
    palpate("train", "--trials", 5, "--task.time-limit-s", 1, "--perception.memory", "last-2", "--out", long_name)
    palpate("compare", "--trials", 4, "--out", desk / "compare", "--policy", desk / "train" / "policy.json")
    study = make_study(desk / "study", (0.4, 0.6, 0.8), (0, 1, 2), 10, 3.0)
    (study / "cells" / "torque-step_mm-1.0-seed-000.0123abcd.unfinished").mkdir()


if __name__ == "__main__":
    make_all(Path(sys.argv[1]))
