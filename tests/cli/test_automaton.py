"""``palpate infer`` and ``palpate automaton``, from strings to a policy's states."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from palpate.adapters.cli.main import main
from palpate.core.automata.document import load, save
from palpate.core.automata.machine import Kind, Machine
from tests.integration.command_line import QUICK, palpate, refused_here, succeed

SMALL = ("--training.restarts", 8, "--training.batch", 8, "--training.steps", 60, "--extraction.most-intervals", 6)
EVEN = Machine(Kind.DFA, ("a", "b"), ((1, 0), (0, 1)), (True, False))
"""An even number of a."""
WASTEFUL = Machine(Kind.DFA, ("a", "b"), ((1, 2), (2, 1), (1, 0)), (True, False, True))
"""The same with a state too many."""


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A folder with strings and automata."""
    walks = ["AABBC", "ABBC", "BBAC", "CCB", "BCAB", "ABCABC", "CBA", "BACBAC"] * 6
    (tmp_path / "walks.txt").write_text("\n".join(walks) + "\n")
    words = {"aa": 1, "a": 0, "b": 1, "ab": 0, "aab": 1, "ba": 0, "abab": 1, "bbba": 0}
    (tmp_path / "labelled.txt").write_text("".join(f"{label}\t{word}\n" for word, label in words.items()))
    letters = str.maketrans("01", "ab")
    hopeless = (f"{(k * 7919 >> 3) % 2}\t{format(k, 'b').translate(letters)}\n" for k in range(2, 200))
    (tmp_path / "hopeless.txt").write_text("".join(hopeless))
    save(EVEN, tmp_path / "even.json")
    save(WASTEFUL, tmp_path / "wasteful.json")
    save(Machine(Kind.DFA, ("a", "b"), ((0, 0),), (True,)), tmp_path / "all.json")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    (tmp_path / "one.txt").write_text("AAA\n")
    (tmp_path / "both.txt").write_text("1\tab\n0\tab\n")
    (tmp_path / "broken.json").write_text('{"schema": "palpate.automaton/1"')
    return tmp_path


def test_an_automaton_comes_of_walks_the_same_each_time(desk: Path) -> None:
    for name in ("one", "two"):
        printed = succeed("infer", desk / "walks.txt", "--out", desk / name, *SMALL)
        assert "48 strings, 3 symbols" in printed
    made = {path.name for path in (desk / "one").iterdir()}
    assert made == {"automaton.json", "automaton.dot", "automaton.svg", "network.json", "report.json", "hidden.png",
                    "training.png"}  # fmt: skip
    for name in made:
        assert (desk / "one" / name).read_bytes() == (desk / "two" / name).read_bytes(), name
    report = json.loads((desk / "one" / "report.json").read_text())
    machine = load(desk / "one" / "automaton.json")
    assert report["states"] == len(machine.transitions)
    # A cell makes as many states as symbols lead into it, and the start may be one more.
    assert 3 * report["raw_states"] + 1 >= report["states"] > 1
    assert {extract["q"] for extract in report["by_q"]} == {2, 3, 4, 5, 6}
    assert machine.state_after([machine.symbol(name) for name in "AABBC"]) is not None
    # No walk begins twice with C and goes on to A, so nobody knows what comes of that.
    assert not machine.complete
    drawn = succeed("automaton", "show", desk / "one" / "automaton.json", "--out", desk / "drawn.svg")
    assert "saved in" in drawn
    assert (desk / "drawn.svg").read_bytes().startswith(b"<?xml")


def test_labelled_strings_give_an_acceptor(desk: Path) -> None:
    words = ("--training.steps", 400, "--training.restarts", 32, "--order", 2, "--held-out", 0)
    printed = succeed("infer", desk / "labelled.txt", "--out", desk / "acceptor", *words)
    assert "right about every training string" in printed
    machine = load(desk / "acceptor" / "automaton.json")
    assert machine.kind is Kind.DFA
    assert machine.output_of([0, 0]) is True
    assert machine.output_of([0, 1]) is False


def test_strings_that_no_network_learns_keep_the_best_and_say_so(desk: Path) -> None:
    done = palpate("infer", desk / "hopeless.txt", "--out", desk / "best", *SMALL, "--held-out", 0)
    assert done.returncode == 2
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("palpate: no network became consistent with all 198 training strings; the best is kept in")
    assert "wrong about" in done.stdout
    assert (desk / "best" / "automaton.json").exists()


def test_automata_are_compared_by_what_they_answer(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["automaton", "compare", str(desk / "even.json"), str(desk / "all.json")]) == 1
    assert "they differ, first in the word a" in capsys.readouterr().out
    assert main(["automaton", "compare", str(desk / "even.json"), str(desk / "wasteful.json")]) == 0
    assert "answer every word alike" in capsys.readouterr().out


def test_minimising_goes_beside_the_file_and_never_over_one(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["automaton", "minimise", str(desk / "wasteful.json")]) == 0
    assert main(["automaton", "compare", str(desk / "wasteful.json"), str(desk / "wasteful.minimal.json")]) == 0
    assert main(["automaton", "minimise", str(desk / "wasteful.json")]) == 2
    assert "is there already" in capsys.readouterr().err


def test_a_table_for_reading(desk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["automaton", "show", str(desk / "even.json")]) == 0
    printed = capsys.readouterr().out
    assert printed.splitlines()[0] == "dfa, 2 states, 2 symbols"
    assert "s0 (start)" in printed
    assert main(["automaton", "show", str(desk / "even.json"), "--out", str(desk / "even.dot")]) == 0
    assert main(["automaton", "compare", str(desk / "even.json"), str(desk / "even.dot")]) == 2
    refusal = capsys.readouterr().err
    assert "even.dot' is refused: the automaton's .json file" in refusal
    assert len(refusal.splitlines()) == 1


def test_recorded_trials_are_strings_and_the_automaton_is_a_memory(tmp_path: Path) -> None:
    run = tmp_path / "run"
    words = ("--scenario", "blind", "--policy", "torque", "--trials", 12, "--perception.memory", "none")
    succeed("run", *words, "--out", run)
    printed = succeed("infer", run / "logs", "--out", tmp_path / "felt", *SMALL)
    assert "12 strings" in printed
    automaton = tmp_path / "felt" / "automaton.json"
    learn = ("--scenario", "blind", "--trials", 2, *QUICK, "--learning.back-off-visits", 5)
    succeed("train", *learn, "--perception.memory", automaton, "--out", tmp_path / "learned")
    policy = json.loads((tmp_path / "learned" / "policy.json").read_text())
    assert policy["perception"]["identifier"]["kind"] == "automaton"
    assert policy["learner"]["back_off"]["visits"] == 5.0
    # Nothing of the automaton's file is needed to replay the trials.
    automaton.unlink()
    assert "2 of 2 equal" in succeed("replay", tmp_path / "learned")


@pytest.mark.parametrize(
    ("words", "named", "accepted"),
    [
        ("infer walks.txt", "--out", "a folder"),
        ("infer --out x", "strings", "a file of strings"),
        ("infer gone.txt --out x", "gone.txt", "readable"),
        ("infer full --out x", "full", "with logs"),
        ("infer walks.txt --out full", "full", "holds something"),
        ("infer walks.txt labelled.txt --out x", "walks.txt", "either one text file"),
        ("infer one.txt --out x", "strings", "symbols"),
        ("infer both.txt --out x", "strings", "either accepted or rejected"),
        ("infer walks.txt --out x --hidden 0", "hidden", "from 1"),
        ("infer walks.txt --out x --held-out 1.5", "held_out", "0.9"),
        ("infer walks.txt --out x --held-out-file labelled.txt", "strings", "alphabet"),
        ("automaton draw even.json", "draw", "show, compare, minimise"),
        ("automaton show gone.json", "gone.json", "readable"),
        ("automaton show broken.json", "broken.json", "JSON"),
        ("automaton show even.json --out even.pdf", "even.pdf", ".svg"),
        ("automaton show even.json --out all.json", "all.json", "already"),
        ("automaton compare even.json", "OTHER", "required"),
        ("explore --map ABC/CC/BDF", "map", ""),
        ("train --out x --perception.memory even.json", "perception.memory", "symbols of the machine"),
        ("train --out x --perception.memory sometimes", "perception.memory", "last-2"),
    ],
)
def test_what_cannot_be_used_is_named_in_one_line(
    desk: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: str,
    named: str,
    accepted: str,
) -> None:
    monkeypatch.chdir(desk)
    line = refused_here(words, desk, capsys)
    assert named.lower() in line.lower()
    assert accepted in line
