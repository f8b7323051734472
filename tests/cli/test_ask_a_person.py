"""examples/ask_a_person.py: keys typed ahead into a pseudo-terminal choose the actions, and the trials replay."""

import csv
import os
import pty
from pathlib import Path

import pytest

CELL = ("--seed", 1, "--cell.hole-uncertainty-mm", 0)
ASK = ("--policy", "examples.ask_a_person:Person")


@pytest.fixture
def typed(monkeypatch):
    ours, theirs = pty.openpty()
    with os.fdopen(theirs) as terminal:
        monkeypatch.setattr("sys.stdin", terminal)
        yield lambda keys: os.write(ours, keys) and None
    os.close(ours)


def test_keys_choose_the_actions_and_the_trials_replay(palpate, typed):
    # From the start of this trial two steps along -x and one along y; Escape ends the second trial.
    typed(b"xxd?\x1b")
    done = palpate("run", *CELL, *ASK, "--trials", 2, "--out", "asked")
    assert done.code == 130
    assert "x+ y0: -x" in done.stderr
    with Path("asked/decisions.csv").open() as rows:
        assert [(row["action"], row["source"]) for row in csv.DictReader(rows)] == [
            ("-x", "person"),
            ("-x", "person"),
            ("+y", "person"),
        ]
    replayed = palpate.succeed("replay", "asked/logs/trial-00000.mcap")
    assert "1 of 1 equal in every bit" in replayed
    assert "a person chose the actions" in replayed
    train = ("train", "--learning.examples", "asked/decisions.csv", "--trials", 1, "--task.time-limit-s", 0.5)
    palpate.succeed(*train, "--out", "shown")
    assert "x+ y0    examples  -x" in palpate.succeed("show", "shown/policy.json")


def test_end_of_the_input_ends_the_run(palpate, monkeypatch):
    with open(os.devnull) as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        assert palpate("run", *CELL, *ASK, "--trials", 2, "--out", "asked").code == 130
