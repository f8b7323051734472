"""Verdicts of the gate that are kept: each for the core and the logs on which it was reached, and for nothing else."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.mutants import gate, golden
from benchmarks.mutants.core_mutants import Candidate

FILE = "core/palpate/core/ports/made_up.py"
SOURCE = "def f(a, b):\n    c = a + b\n    d = a - b\n    return c * d\n"
LINES = {FILE: {2: {"one"}, 3: {"one", "two"}, 4: {"one", "two"}}}


@dataclass
class MadeUp:
    """A checkout whose mutants die in the log that runs the fewest of their lines; those of its last line survive.

    Attributes:
        root: Where it is.
        out: Where verdicts are kept.
        judged_: Ids of what was judged, a line each: in processes of its own, so it is a file.
    """

    root: Path
    out: Path
    judged_: Path

    def judge(self, checkout: Path, one: Candidate, logs: Sequence[Path]) -> tuple[str, str]:
        with self.judged_.open("a") as stream:
            stream.write(f"{one.mutant.id}\n")
        if one.mutant.line == 4:
            return "survived", ""
        name = "one" if one.mutant.line == 2 else "two"
        return ("killed", f"{name}: tick 3") if name in {log.stem for log in logs} else ("survived", "")

    def run(self) -> int:
        """Run the gate; how many mutants it judged."""
        self.judged_.write_text("")
        gate.run(self.root, self.out, 1, 1)
        return len(self.judged_.read_text().splitlines())


@pytest.fixture
def made_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> MadeUp:
    for name, text in {FILE: SOURCE, "tests/golden/one.mcap": "1", "tests/golden/two.mcap": "22"}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    made = MadeUp(tmp_path, tmp_path / "out.jsonl", tmp_path / "judged")
    monkeypatch.setattr(gate, "lines_run", lambda *_: LINES)
    monkeypatch.setattr(gate, "replayed", lambda *_: "")
    monkeypatch.setattr(gate, "_judged", made.judge)
    return made


def test_a_verdict_that_holds_is_not_reached_anew(made_up: MadeUp, capsys: pytest.CaptureFixture[str]) -> None:
    assert made_up.run() == 6
    table = capsys.readouterr().out.partition("mutants of")
    assert made_up.run() == 0
    assert capsys.readouterr().out.partition("mutants of")[2] == table[2]


@pytest.mark.parametrize(
    ("changed", "anew"),
    [
        ("tests/golden/one.mcap", {2, 4}),  # what it killed, and what no log kills
        ("tests/golden/two.mcap", {3, 4}),
        ("tests/golden/three.mcap", {4}),
        (FILE, {2, 3, 4}),
        ("adapters/palpate/adapters/replay/engine.py", {2, 3, 4}),
    ],
)
def test_what_a_verdict_was_reached_on_has_changed(made_up: MadeUp, changed: str, anew: set[int]) -> None:
    made_up.run()
    lines = {one["id"]: one["line"] for one in map(json.loads, made_up.out.read_text().splitlines())}
    (made_up.root / changed).parent.mkdir(parents=True, exist_ok=True)
    with (made_up.root / changed).open("a") as stream:
        stream.write("\n")
    made_up.run()
    ids = made_up.judged_.read_text().split()
    assert {lines[id_] for id_ in ids} == anew
    assert len(ids) == sum(line in anew for line in lines.values())


def test_a_changed_function_has_other_mutants(made_up: MadeUp) -> None:
    made_up.run()
    (made_up.root / FILE).write_text(SOURCE.replace("a - b", "b - a"))
    assert made_up.run() == 6
    assert len({json.loads(line)["id"] for line in made_up.out.read_text().splitlines()}) == 12


@pytest.mark.parametrize("whole", [0, 2, 5])
def test_broken_off_and_begun_again_it_comes_to_the_same(
    made_up: MadeUp, capsys: pytest.CaptureFixture[str], whole: int
) -> None:
    made_up.run()
    table = capsys.readouterr().out.partition("mutants of")[2]
    written = made_up.out.read_text().splitlines(keepends=True)
    made_up.out.write_text("".join(written[:whole]) + written[whole][:40])
    assert made_up.run() == 6 - whole
    assert capsys.readouterr().out.partition("mutants of")[2] == table


def test_lines_are_traced_once_for_a_core_and_its_logs(made_up: MadeUp, monkeypatch: pytest.MonkeyPatch) -> None:
    def traced(*_: object) -> dict[str, dict[int, list[str]]]:
        with made_up.judged_.open("a") as stream:
            stream.write("traced\n")
        return {FILE: {2: ["one"]}}

    monkeypatch.setattr(golden, "_traced", traced)
    kept = made_up.root / "out.lines.json"
    assert golden.lines_run(made_up.root, kept) == golden.lines_run(made_up.root, kept) == {FILE: {2: {"one"}}}
    assert made_up.judged_.read_text() == "traced\n"
    (made_up.root / "tests/golden/one.mcap").write_text("another")
    golden.lines_run(made_up.root, kept)
    assert made_up.judged_.read_text() == "traced\ntraced\n"
