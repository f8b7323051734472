"""Finding logs, and holding the trials of a run against each other."""

from dataclasses import replace
from pathlib import Path

import pytest

from palpate.adapters.replay import Replay, Verdict, WhatIf, find_logs, learning_problems, replay_files
from palpate.adapters.replay.lesson import Lesson
from palpate.core.errors import ConfigurationError, LogError

GOLDEN = Path(__file__).parents[3] / "golden"


def test_files_folders_and_patterns_once_each(tmp_path: Path) -> None:
    for name in ("b.mcap", "a.mcap", "deep/c.mcap", "notes.txt", "d.mcap.cut-short-1"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"")
    names = [str(tmp_path / "b.mcap"), str(tmp_path), str(tmp_path / "*.mcap")]
    assert [path.name for path in find_logs(names)] == ["b.mcap", "a.mcap", "c.mcap"]
    # What is named outright is taken, whatever it is called.
    assert len(find_logs([str(tmp_path / "notes.txt")])) == 1


def test_calls_that_are_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="jobs = 0 is refused: a whole number from 1 to 1024"):
        next(replay_files([], WhatIf(), 0))
    with pytest.raises(LogError, match="nowhere: is not there"):
        find_logs([tmp_path / "nowhere"])  # type: ignore[list-item]


def lesson(trial: int, before: str, after: str, *, run: str = "r", folder: str = "logs") -> Replay:
    path = f"{folder}/trial-{trial:05d}.mcap"
    return Replay(path, Verdict.EQUAL, lesson=Lesson(run, trial, before, after))


def test_a_broken_hand_over_is_told() -> None:
    _, problems, _ = learning_problems([lesson(0, "a", "b"), lesson(1, "x", "c")])
    assert problems == ["logs/trial-00001.mcap: does not begin with the values that trial 0 ended with"]


def test_trials_that_do_not_follow_each_other_prove_nothing() -> None:
    runs = [lesson(0, "a", "b"), lesson(2, "c", "d"), lesson(1, "p", "q", run="other"), lesson(1, "u", "v", folder="o")]
    assert learning_problems(runs) == (0, [], ["logs: nothing is known of what came between trials 0 and 2"])
    assert learning_problems([replace(lesson(0, "a", "b"), lesson=None)]) == (0, [], [])
