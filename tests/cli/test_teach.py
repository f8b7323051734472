"""``palpate teach``: keys typed ahead into a pseudo-terminal."""

import csv
import os
import pty
import re
from collections.abc import Callable, Iterator
from math import hypot
from pathlib import Path
from threading import Timer

import pytest

from palpate.adapters.cli import opening
from palpate.adapters.experiments.teaching import Gamepad, Keys
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import DeviceError
from palpate.core.policy import Observation
from tests.command_line import CommandLine
from tests.unit.adapters.experiments.teaching.gamepad_pipe import AXIS, BUTTON, Pad

RIG = Path(__file__).parents[2] / "rigs" / "zebra-nmc-jr3.toml"
CELL = ("--seed", 1, "--cell.hole-uncertainty-mm", 0)


@pytest.fixture
def pad(tmp_path: Path) -> Iterator[Pad]:
    made = Pad(tmp_path / "js0")
    yield made
    os.close(made.fd)


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


def test_on_a_rig_a_gamepad_leads_the_peg_in_while_its_button_is_held(
    palpate: CommandLine, pad: Pad, monkeypatch: pytest.MonkeyPatch
) -> None:
    wait, step = Gamepad.wait, Gamepad.step

    def begin(self: Gamepad) -> None:
        pad.send(BUTTON, 4, 0)
        Timer(0.05, pad.send, (BUTTON, 4, 1)).start()
        wait(self)

    def look_and_lead(self: Gamepad, observation: Observation) -> int | None:
        x, y, _ = observation.reference_m
        for axis, value in ((0, -y), (1, x)):
            pad.send(AXIS, axis, round(32767 * value / hypot(x, y)))
        return step(self, observation)

    monkeypatch.setattr(Gamepad, "wait", begin)
    monkeypatch.setattr(Gamepad, "step", look_and_lead)
    # A rig that is simulated, and virtual time: over wires it is benchmarks/lesson.py.
    monkeypatch.setattr(opening, "open_rig", lambda config, ready, rig: SimulatedRig(config, ready))
    monkeypatch.setattr(opening, "warm_up", lambda config, ready: None)
    words = ("--rig", RIG, "--gamepad", pad.path, "--trials", 1, "--out", "lesson")
    done = palpate("teach", "--seed", 1, *words)
    assert (done.code, done.stderr.count("inserted")) == (0, 1), done
    assert "any key stops the arm" in done.stderr
    assert "travel_speed_mm_s = 8.9" in Path("lesson/run.toml").read_text()
    shown = [row["state"] for row in csv.DictReader(Path("lesson/examples.csv").read_text().splitlines())]
    table = palpate.succeed("show", "lesson/policy.json")
    assert all(re.search(rf"^{re.escape(state)} +examples", table, re.MULTILINE) for state in shown)
    assert "1 of 1 equal in every bit" in palpate.succeed("replay", "lesson")


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
