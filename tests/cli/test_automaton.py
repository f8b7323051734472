"""``palpate infer``: from strings to a policy's states; automata shown and compared."""

import json

import pytest

from palpate.adapters.experiments import load_automaton
from palpate.core.automata.document import to_json_text
from palpate.core.automata.machine import Kind, Machine
from tests.command_line import QUICK, files_in

SMALL = ("--training.restarts", 4, "--training.batch", 4, "--training.steps", 60, "--extraction.most-intervals", 6)
EVEN = Machine(Kind.DFA, ("a", "b"), ((1, 0), (0, 1)), (True, False))
"""An even number of a."""
WASTEFUL = Machine(Kind.DFA, ("a", "b"), ((1, 2), (2, 1), (1, 0)), (True, False, True))
"""The same with a state too many."""


@pytest.fixture
def desk(tmp_path):
    """A folder with strings and automata."""
    walks = ["AABBC", "ABBC", "BBAC", "CCB", "BCAB", "ABCABC", "CBA", "BACBAC"] * 6
    (tmp_path / "walks.txt").write_text("\n".join(walks) + "\n")
    words = {"aa": 1, "a": 0, "b": 1, "ab": 0, "aab": 1, "ba": 0, "abab": 1, "bbba": 0}
    (tmp_path / "labelled.txt").write_text("".join(f"{label}\t{word}\n" for word, label in words.items()))
    letters = str.maketrans("01", "ab")
    hopeless = (f"{(k * 7919 >> 3) % 2}\t{format(k, 'b').translate(letters)}\n" for k in range(2, 200))
    (tmp_path / "hopeless.txt").write_text("".join(hopeless))
    (tmp_path / "even.json").write_text(to_json_text(EVEN))
    (tmp_path / "wasteful.json").write_text(to_json_text(WASTEFUL))
    (tmp_path / "all.json").write_text(to_json_text(Machine(Kind.DFA, ("a", "b"), ((0, 0),), (True,))))
    return tmp_path


@pytest.mark.nightly
def test_an_automaton_comes_of_walks(palpate, desk):
    assert "48 strings, 3 symbols" in palpate.succeed("infer", "walks.txt", "--out", "one", *SMALL)
    made = files_in(desk / "one")
    assert set(made) == {"automaton.json", "automaton.dot", "network.json", "report.json"}  # fmt: skip
    report = json.loads(made["report.json"])
    machine = load_automaton(desk / "one" / "automaton.json")
    assert report["states"] == len(machine.transitions)
    # A cell makes as many states as symbols lead into it, and the start may be one more.
    assert 3 * report["raw_states"] + 1 >= report["states"] > 1
    assert {extract["q"] for extract in report["by_q"]} == {2, 3, 4, 5, 6}
    assert machine.output_of([machine.alphabet.index(name) for name in "AABBC"]) is not None
    # No walk begins twice with C and goes on to A, so what comes of that is unknown.
    assert not machine.complete
    assert "saved in" in palpate.succeed("infer", "--show", "one/automaton.json", "--out", "drawn.dot")
    assert (desk / "drawn.dot").read_text() == made["automaton.dot"].decode()


def test_of_strings_that_no_network_learns_the_best_is_kept(palpate, desk):
    done = palpate("infer", "hopeless.txt", "--out", "best", *SMALL, "--held-out", 0)
    assert done.code == 2
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith("palpate: no network is consistent with all 198 training strings; the best is in")
    assert "wrong about" in done.stdout
    assert (desk / "best" / "automaton.json").exists()


@pytest.mark.usefixtures("desk")
def test_automata_are_compared_by_what_they_answer(palpate):
    done = palpate("infer", "--compare", "even.json", "all.json")
    assert done.code == 1
    assert "they differ, first in the word a" in done.stdout
    assert "give the same output for every word" in palpate.succeed("infer", "--compare", "even.json", "wasteful.json")


@pytest.mark.usefixtures("desk")
def test_a_table_for_reading(palpate):
    printed = palpate.succeed("infer", "--show", "even.json")
    assert printed.splitlines()[0] == "dfa, 2 states, 2 symbols"
    assert "s0 (start)" in printed
    palpate.succeed("infer", "--show", "even.json", "--out", "even.dot")
    line = palpate.refusal("infer", "--compare", "even.json", "even.dot")
    assert "must be the automaton's .json file" in line


def test_recorded_trials_are_strings_and_the_automaton_is_a_memory(palpate, tmp_path):
    words = ("--scenario", "blind", "--policy", "torque", "--seed", 4, "--trials", 12, "--perception.memory", "none")
    palpate.succeed("run", *words, "--out", "run")
    assert "12 strings" in palpate.succeed("infer", "run/logs", "--out", "felt", *SMALL)
    automaton = tmp_path / "felt" / "automaton.json"
    learn = ("--scenario", "blind", "--trials", 2, *QUICK)
    palpate.succeed("train", *learn, "--perception.memory", automaton, "--out", "learned")
    policy = json.loads((tmp_path / "learned" / "policy.json").read_text())
    assert policy["perception"]["identifier"]["kind"] == "automaton"
    # Nothing of the automaton's file is needed to replay the trials.
    automaton.unlink()
    assert "2 of 2 equal" in palpate.succeed("replay", "learned", "--jobs", 1)
