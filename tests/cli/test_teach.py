"""``palpate teach``: keys typed ahead into a pseudo-terminal."""

import os
import pty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from palpate.adapters.experiments.teaching import Keys
from palpate.core.errors import DeviceError
from palpate.core.policy import Observation
from tests.command_line import CommandLine

CELL = ("--seed", 1, "--cell.hole-uncertainty-mm", 0)


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bytes], None]]:
    ours, theirs = pty.openpty()
    with os.fdopen(theirs) as terminal:
        monkeypatch.setattr("sys.stdin", terminal)
        yield lambda keys: os.write(ours, keys) and None
    os.close(ours)


def test_what_was_shown_is_a_table_a_file_of_examples_and_a_policy(
    palpate: CommandLine, typed: Callable[[bytes], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    # From the start of this trial two steps along -x and one along y; the second trial is left by Escape.
    typed(b"xxd\x1b")
    done = palpate("teach", *CELL, "--trials", 2, "--out", "lesson")
    assert done.code == 130
    assert "trial 1 of 2: inserted, 3 examples" in done.stderr
    assert "x+ y0    -x  " in done.stdout
    assert Path("lesson/examples.csv").read_text().startswith("trial,number,state,action\n0,0,x+ y0,-x\n")
    assert "1 of 1 equal in every bit" in palpate.succeed("replay", "lesson/logs/trial-00000.mcap")
    palpate.succeed("log", "export", "lesson", "--to", "lerobot", "--fps", 30, "--out", "dataset")
    assert "3 examples of 1 episode in again.csv" in palpate.succeed("log", "import", "dataset", "--out", "again.csv")
    assert Path("again.csv").read_text() == Path("lesson/examples.csv").read_text()
    assert "x+ y0    examples  -x" in palpate.succeed("show", "lesson/policy.json")


def test_what_was_shown_outlives_a_device_that_fails(
    palpate: CommandLine, typed: Callable[[bytes], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = iter((4, 4, 2))

    def step(self: Keys, observation: Observation) -> int:
        if (way := next(steps, None)) is None:
            raise DeviceError("gamepad", "is gone")
        return way

    monkeypatch.setattr(Keys, "step", step)
    done = palpate("teach", *CELL, "--trials", 2, "--out", tmp_path / "lesson")
    assert (done.code, done.stderr.splitlines()[-1]) == (1, "palpate: gamepad: is gone")
    assert len((tmp_path / "lesson/examples.csv").read_text().splitlines()) == 4


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--gamepad", "js9"), "a gamepad's device that can be read"),
        (("--guide-N", "3"), "0 without --rig"),
        (("--rig", "rig.toml"), "rig.toml"),
        (("--task.directions", "4"), "actions = '0deg, 90deg, 180deg, 270deg' is refused: the eight steps"),
        (("--task=insertion-6dof", "--learner", "skills"), "without skills"),
        (("--learning.programmed", "x+", "+x"), "learning.programmed = 'x+' is refused: a state of this task"),
        (("--learning.examples", "mine.csv"), "none: a lesson leaves its own"),
    ],
)
@pytest.mark.usefixtures("typed")
def test_what_cannot_be_taught_with_is_one_line(
    palpate: CommandLine, words: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert said in palpate.refusal("teach", *words)
