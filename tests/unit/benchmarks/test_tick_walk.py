"""Ticks cut out of a made-up loop."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.tick_setups import Parts
from benchmarks.tick_walk import Call, Figures, Walker, drawn, found, quietest, text

PORTS = """
class Clock:
    def __init__(self, inner=None):
        self.inner = inner

    def sleep_until(self, deadline):
        if self.inner is not None:
            self.inner.sleep_until(deadline)

    def read(self):
        return 1.0
"""
TASK = """
class Task:
    def __init__(self, phases, Phase):
        self.phases, self.phase = phases, None
        self.Phase = Phase

    def sense(self, number):
        return self.felt(number) if self.phases[number] == "EXPLORE" else None

    def felt(self, number):
        return sorted([2, 1], key=lambda x: x) if number % 2 else None


def run(task, clock):
    for number, name in enumerate(task.phases):
        clock.sleep_until(number)
        clock.read()
        task.phase = task.Phase(name=name)
        task.sense(number)
    clock.sleep_until(number + 1)
"""


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    for file, content in (("adapters/palpate/adapters/ports.py", PORTS), ("core/palpate/core/task.py", TASK)):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).write_text(content)
    return tmp_path


def executed(checkout: Path, file: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile((checkout / file).read_text(), str(checkout / file), "exec"), names)
    return names


@pytest.fixture
def trial(checkout: Path) -> Callable[..., None]:
    ports, core = (executed(checkout, f) for f in ("adapters/palpate/adapters/ports.py", "core/palpate/core/task.py"))

    def run(*phases: str) -> None:
        core["run"](core["Task"](phases, SimpleNamespace), ports["Clock"](ports["Clock"]()))

    return run


def test_a_tick_is_from_one_outermost_sleep_to_the_next(checkout: Path, trial: Callable[..., None]) -> None:
    walker, before = Walker(checkout), sys.getprofile()
    walker.walk(lambda: trial("LIFT", "EXPLORE", "EXPLORE", "INSERT"))
    assert sys.getprofile() is before
    busy, quiet = walker.ticks
    assert [call.name for call in quiet] == [
        "Clock.sleep_until", "Clock.sleep_until", "Clock.read", "Task.sense", "Task.felt",
    ]  # fmt: skip
    assert {call.file for call in quiet} == {"adapters/palpate/adapters/ports.py", "core/palpate/core/task.py"}
    assert Figures.of(quiet) == Figures(files=2, changes=1, calls=5)
    assert Figures.of(busy) == Figures(files=2, changes=1, calls=7)
    assert quietest(walker.ticks) is quiet
    assert drawn(quiet).splitlines()[1] == "  Clock.sleep_until  adapters/palpate/adapters/ports.py"


def test_the_quietest_and_the_usual_tick_are_told() -> None:
    ticks = [[Call(0, file, "f") for file in files] for files in ("abab", "abab", "aab")]
    figures = found("made up", ticks)
    assert (figures.quietest, figures.usual) == (Figures(2, 1, 3), Figures(2, 3, 4))
    assert figures.entered == ["a", "b"]
    assert "quietest        2                1      3" in text(figures)


def test_no_exploring_tick_is_an_error() -> None:
    with pytest.raises(SystemExit, match="no tick of the phase EXPLORE"):
        found("made up", [])


def test_a_checkout_of_no_known_layout_is_refused(tmp_path: Path) -> None:
    path = list(sys.path)
    with pytest.raises(SystemExit, match="none of the layouts"):
        Parts(tmp_path, tmp_path)
    assert sys.path == path
