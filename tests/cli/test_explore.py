"""``palpate explore``: learning in a grid world, the figure, and the strings."""

import csv
import json

import pytest

from palpate.adapters.cli import explore
from palpate.adapters.experiments import load_policy
from palpate.adapters.experiments.grid import states_named
from palpate.adapters.log import read_strings
from palpate.core.automata import Kind, Machine, to_json_text
from palpate.core.policy import policy_from
from palpate.simulation.grid.maps import grid_actions

QUICK = ("--trials", 30, "--seeds", 2)
SYMBOLS = ("A", "B", "C", "D", "E", "F")


def last_symbol(folder, symbols=SYMBOLS):
    """An automaton file whose states are the symbols."""
    row = tuple(range(len(symbols)))
    path = folder / f"last-{len(symbols)}.json"
    machine = Machine(Kind.MOORE, symbols, (row,) * len(symbols), symbols, labels=symbols)
    path.write_text(to_json_text(machine))
    return path


def test_run_prints_what_is_possible_and_leaves_everything(palpate, tmp_path):
    out = tmp_path / "deep" / "out"
    done = palpate("explore", "--map", 2, "--state", "last-2", *QUICK, "--seed", 5, "--out", out)
    assert done.code == 0, done.stderr
    assert "60 of 60 trials" in done.stderr
    for fact in ("full information      2.33", "belief-state optimum  3.21", "random walk           48.27"):
        assert fact in done.stdout
    assert sorted(path.name for path in out.iterdir()) == [
        "learning_curve.png", "policy-5.json", "policy-6.json", "summary.json", "table.txt", "trials.csv",
    ]  # fmt: skip
    assert (out / "table.txt").read_text() in done.stdout
    with (out / "trials.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["seed"], row["trial"]) for row in rows] == [(str(s), str(t)) for s in (5, 6) for t in range(30)]
    figures = json.loads((out / "summary.json").read_text())
    assert figures["mean_last"] == pytest.approx(sum(int(row["steps"]) for row in rows) / 60, abs=1e-3)
    assert figures["belief_optimum"] == 3.2083
    assert figures["settings"]["learning"]["learner"] == "q"
    document = load_policy(out / "policy-5.json")
    assert len(document.states) == 20
    policy_from(document, document.states, grid_actions())
    assert "20 states, 8 actions; q-learning, trained on 30 trials" in palpate.succeed("show", out / "policy-5.json")


def test_figure_of_the_paper(palpate, tmp_path, monkeypatch):
    def at_once(grid, *_):
        return states_named(str(last_symbol(tmp_path, grid.symbols)), grid)

    monkeypatch.setattr(explore, "inferred", at_once)
    printed = palpate.succeed("explore", "--figure", tmp_path / "figure.svg", *QUICK)
    assert (tmp_path / "figure.svg").read_bytes().startswith(b"<?xml")
    for title in ("scenario 1, symbols only (6 states)", "scenario 2, automaton (5 states)"):
        assert title in printed
    assert printed.count("belief-state optimum") == 4


def test_walks_for_inference(palpate, tmp_path):
    palpate.succeed("explore", "--map", 2, "--strings", "walks.txt", "--walks", 50, "--longest", 20)
    strings = read_strings(tmp_path / "walks.txt")
    assert (len(strings.words), strings.alphabet) == (50, ("A", "B", "C", "D"))
    assert max(map(len, strings.words)) <= 20


@pytest.mark.parametrize(("at", "code", "lines"), [(1, 130, 0), (2, 130, 21), (9, 0, 61)])
def test_ctrl_c_keeps_the_runs_that_were_finished(palpate, tmp_path, monkeypatch, at, code, lines):
    original, calls = explore.learn, []

    def interrupted(*arguments):
        calls.append(arguments)
        if len(calls) == at:
            raise KeyboardInterrupt
        return original(*arguments)

    monkeypatch.setattr(explore, "learn", interrupted)
    assert palpate("explore", "--trials", 20, "--out", "out").code == code
    trials = tmp_path / "out" / "trials.csv"
    assert (len(trials.read_text().splitlines()) if trials.exists() else 0) == lines
