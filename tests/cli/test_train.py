"""``palpate train`` leaves a folder with everything about a run; the same run twice leaves the same bytes."""

import csv
import json
import tomllib
from math import hypot

import pytest

from palpate.adapters.cli.train import results_line
from tests.command_line import QUICK, RESULTS, files_in, results_in
from tests.unit.adapters.samples import trial_rows

TRIAL_COLUMNS = {
    "trial", "outcome", "success", "exploration_time_s", "actions", "peak_force_N", "measured_peak_force_N",
    "depth_mm", "start_x_mm", "start_y_mm", "hole_x_mm", "hole_y_mm", "ticks", "temperature",
}  # fmt: skip


def table(path):
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_a_run_leaves_these_files_and_no_others(trained):
    assert {path.name for path in trained.iterdir()} == {*RESULTS, "run.toml", "logs"}


def test_trials_have_their_columns_and_decisions_belong_to_them(trained):
    trials, decisions = table(trained / "trials.csv"), table(trained / "decisions.csv")
    assert set(trials[0]) >= TRIAL_COLUMNS
    assert [row["trial"] for row in trials] == ["0", "1", "2"]
    for row in trials:
        assert row["outcome"] in {"inserted", "time limit"}
        assert 0.0 <= float(row["exploration_time_s"]) <= 2.0
        assert 4.0 < float(row["peak_force_N"]) < 30.0
        assert hypot(float(row["start_x_mm"]), float(row["start_y_mm"])) <= 3.0
        assert (float(row["depth_mm"]) > 9.9) is (row["success"] == "True")
        own = [decision for decision in decisions if decision["trial"] == row["trial"]]
        assert len(own) == int(row["actions"])
        assert {decision["source"] for decision in own} == {"learned"}
        assert {decision["reinforcement"] for decision in own[:-1]} == {"-1.0"}
    # An action takes a tenth of a second.
    assert int(trials[0]["actions"]) == pytest.approx(10 * float(trials[0]["exploration_time_s"]), abs=1.5)


def test_the_policy_has_learned_from_all_decisions(trained):
    policy = json.loads((trained / "policy.json").read_text())
    assert policy["schema"] == "palpate.policy/4"
    visits = sum(map(sum, policy["learner"]["state"]["visits"]))
    assert visits == sum(bool(decision["reinforcement"]) for decision in table(trained / "decisions.csv"))


def test_the_summary_agrees_with_the_trials(trained):
    summary = json.loads((trained / "summary.json").read_text())
    trials = table(trained / "trials.csv")
    assert (summary["scenario"], summary["arm"], summary["seed"]) == ("paper", "zebra-zero", 0)
    assert (summary["finished"], summary["trials"]) == (True, 3)
    assert summary["success"] == pytest.approx(sum(t["success"] == "True" for t in trials) / 3, abs=1e-4)
    assert summary["peak_force_N"] == pytest.approx(max(float(t["peak_force_N"]) for t in trials), abs=1e-3)
    assert set(summary) >= {"success_95", "median_s", "median_95_s", "p95_s", "p95_95_s", "outcomes", "learning"}


def test_run_toml_gives_the_same_run_again(palpate, trained, tmp_path):
    settings = tomllib.loads((trained / "run.toml").read_text())
    assert settings["task"]["time_limit_s"] == 2.0
    assert (settings["run"]["command"], settings["run"]["trials"]) == ("train", 3)
    assert set(settings["run"]["versions"]) >= {"palpate", "numpy", "mujoco", "pin"}
    palpate.succeed("train", "--config", trained / "run.toml", "--trials", 3, "--out", "again")
    assert files_in(tmp_path / "again") == files_in(trained)


def test_training_goes_on_from_a_policy_file(palpate, trained):
    palpate.succeed("train", *QUICK, "--trials", 1, "--policy", trained / "policy.json", "--out", "run")
    assert "trained on 4 trials" in palpate.succeed("show", "run/policy.json")


def test_without_out_the_folder_is_named_after_the_scenario(palpate, tmp_path):
    palpate.succeed("train", "--scenario", "blind", *QUICK, "--trials", 1)
    assert (tmp_path / "runs" / "blind" / "policy.json").is_file()


def test_a_belief_is_trained_resumed_used_replayed_and_shown(palpate, tmp_path):
    learn = ("train", "--learner", "belief", "--seed", 1, "--task.start-uncertainty-mm", "1.6")
    palpate.succeed(*learn, "--trials", 2, "--out", "whole")
    palpate.succeed(*learn, "--trials", 1, "--out", "run")
    palpate.succeed("train", "--resume", "--trials", 2, "--out", "run")
    assert results_in(tmp_path / "run") == results_in(tmp_path / "whole")
    assert "2 of 2 equal" in palpate.succeed("replay", tmp_path / "whole")
    shown = palpate.succeed("show", "run/policy.json")
    assert "8 actions; belief, " in shown
    assert "contact model of " in shown
    # Ten motions a second are another task; its own time of an action is a preset.
    words = ("run", "--policy", "run/policy.json", "--trials", 1, "--seed", 2)
    assert "or use --learner belief, or --config" in palpate.refusal(*words, "--learner", "q-learning")
    palpate.succeed(*words, "--out", "used")
    palpate.succeed("report", "run")
    assert "contact model of " in (tmp_path / "run" / "report.html").read_text()


@pytest.fixture
def desk(run, tmp_path):
    """A finished run and an empty folder."""
    (tmp_path / "empty").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    ("words", "named", "accepted"),
    [
        ("--out run --seed 1", "seed must be 0", "with which the run in run began (got 1)"),
        ("--out run --task.time-limit-s 3", "time_limit_s must be 2.0", "with which the run in run began (got 3.0)"),
        ("--out run --policy policy.json", "policy.json", "no such file; accepted: q-learning, "),
        ("--out empty", "checkpoint.json", "begin a new run"),
    ],
)
def test_resume_refuses(palpate, desk, words, named, accepted):
    palpate.refuses(f"train --resume {words} --trials 4", named, accepted)


def test_a_finished_run_says_so_is_left_alone_and_says_how_to_go_on(palpate, trained, run):
    # Naming the settings again is allowed as long as they are the same.
    done = palpate.succeed("train", "--config", run / "run.toml", "--resume", "--trials", 3, "--out", "run")
    assert "run is finished: 3 of 3 trials; 50 more: palpate train --resume --out run --trials 53" in done
    assert files_in(run) == files_in(trained)
    again = palpate.refusal("train", "--out", "run")
    assert again.endswith("or resume that training: palpate train --resume --out run")
    assert "--resume" not in palpate.refusal("run", "--policy", "torque", "--out", "run").partition("palpate train")[0]


LAST = "31 trials, mean time 8.00 s in the first 15 and 24.00 s in the last 15; success in the last 15: 15 of 15"


@pytest.mark.parametrize(("trials", "message"), [(25, "25 trials, mean time 13.00 s; success: 25 of 25"), (31, LAST)])
def test_first_and_last_trials_do_not_overlap(trials, message):
    assert results_line(trial_rows(*range(1, trials + 1))) == message
