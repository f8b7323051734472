"""``palpate train --from-logs``: a belief from the logs of any policy."""

import json
from pathlib import Path

import pytest


def learned(folder):
    return json.loads((folder / "policy.json").read_text())["learner"]["state"]


def test_the_logs_of_a_belief_give_what_it_learned_itself(palpate):
    palpate.succeed("train", "--learner", "belief", "--trials", 2, "--out", "run")
    assert "2 of 2 trials ended in the hole" in palpate.succeed("train", "--from-logs", "run", "--out", "touch")
    assert learned(Path("touch")) == learned(Path("run"))


def test_a_belief_goes_on_from_the_touches_of_the_torque_rule(palpate):
    palpate.succeed("run", "--policy", "torque", "--trials", 3, "--out", "run")
    palpate.succeed("train", "--from-logs", "run/logs/*.mcap", "--out", "touch")
    settings = ("--config", "touch/run.toml", "--policy", "touch/policy.json", "--trials", 1)
    palpate.succeed("train", *settings, "--out", "further")
    assert learned(Path("further"))["trials_learned"] == 4
    # Its first action goes by what was learned before: a belief of nothing begins with a search.
    assert ",search," not in Path("further/decisions.csv").read_text()


@pytest.fixture
def outside(palpate):
    """A trial that ends elsewhere than in the hole."""
    palpate.succeed("run", "--policy", "spiral-5", "--task.time-limit-s", 0.2, "--trials", 1, "--out", "outside")


@pytest.mark.usefixtures("outside")
def test_logs_without_an_insertion_are_refused(palpate):
    refused = "contacts must be at least 6"
    assert refused in palpate.refusal("train", "--from-logs", "outside", "--out", "touch")
    assert not Path("touch").exists()


@pytest.mark.usefixtures("outside")
def test_logs_of_two_tools_are_refused(palpate):
    other = ("--cell.peg.diameter-mm", 20, "--task.time-limit-s", 0.2, "--trials", 1)
    palpate.succeed("run", "--policy", "spiral-5", *other, "--out", "thin")
    refused = palpate.refusal("train", "--from-logs", "outside", "thin", "--out", "touch")
    assert "cell.peg.diameter_mm must be 29.0, as in the first log; not so in thin" in refused


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nowhere",), "needs --out"),
        (("nowhere", "--out", "touch", "--learner", "sarsa"), "learner must be 'belief'"),
        (("nowhere", "--out", "touch", "--trials", 3), "takes no other flag than --out"),
    ],
)
def test_what_is_missing_is_said(palpate, words, said):
    assert said in palpate.refusal("train", "--from-logs", *words)
