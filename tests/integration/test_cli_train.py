"""``palpate train`` leaves a folder with everything about a run, and the same run twice leaves it twice."""

from __future__ import annotations

import csv
import io
import json
import tomllib
from math import hypot
from pathlib import Path

import pytest
from matplotlib.image import imread

from tests.integration.command_line import QUICK, RESULTS, refusal, results_in, succeed

TRIAL_COLUMNS = {
    "trial", "outcome", "success", "exploration_time_s", "actions", "peak_force_N", "measured_peak_force_N",
    "depth_mm", "start_x_mm", "start_y_mm", "hole_x_mm", "hole_y_mm", "ticks", "temperature",
}  # fmt: skip


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_a_run_leaves_these_files_and_no_others(trained: Path) -> None:
    assert {path.name for path in trained.iterdir()} == {*RESULTS, "run.toml", "logs"}


def test_trials_have_their_columns(trained: Path) -> None:
    trials = table(trained / "trials.csv")
    assert set(trials[0]) >= TRIAL_COLUMNS
    assert [row["trial"] for row in trials] == ["0", "1", "2"]
    for row in trials:
        assert row["outcome"] in {"inserted", "time limit"}
        assert 0.0 <= float(row["exploration_time_s"]) <= 2.0
        assert 4.0 < float(row["peak_force_N"]) < 30.0
        assert hypot(float(row["start_x_mm"]), float(row["start_y_mm"])) <= 3.0
        assert (float(row["depth_mm"]) > 9.9) is (row["success"] == "True")
    # An action takes a tenth of a second.
    assert int(trials[0]["actions"]) == pytest.approx(10 * float(trials[0]["exploration_time_s"]), abs=1.5)


def test_decisions_belong_to_the_trials(trained: Path) -> None:
    decisions = table(trained / "decisions.csv")
    for row in table(trained / "trials.csv"):
        own = [d for d in decisions if d["trial"] == row["trial"]]
        assert len(own) == int(row["actions"])
        assert {d["source"] for d in own} == {"learned"}
        assert {d["reinforcement"] for d in own[:-1]} == {"-1.0"}


def test_the_policy_has_learned_from_all_decisions(trained: Path) -> None:
    policy = json.loads((trained / "policy.json").read_text())
    assert policy["schema"] == "palpate.policy/1"
    visits = sum(row["visits"] or 0 for row in policy["table"])
    told = [d for d in table(trained / "decisions.csv") if d["reinforcement"]]
    assert visits == len(told)


def test_the_summary_says_how_it_went(trained: Path) -> None:
    summary = json.loads((trained / "summary.json").read_text())
    trials = table(trained / "trials.csv")
    assert (summary["scenario"], summary["arm"], summary["seed"]) == ("paper", "zebra-zero", 0)
    assert (summary["finished"], summary["trials"]) == (True, 3)
    assert summary["success"] == pytest.approx(sum(t["success"] == "True" for t in trials) / 3, abs=1e-4)
    assert summary["peak_force_N"] == pytest.approx(max(float(t["peak_force_N"]) for t in trials), abs=1e-3)
    assert set(summary) >= {
        "success_95", "median_s", "median_95_s", "p95_s", "p95_95_s", "outcomes", "learning", "holes_inside_area",
    }  # fmt: skip


def test_the_learning_curve_is_a_picture(trained: Path) -> None:
    png = (trained / "learning_curve.png").read_bytes()
    height, width, _ = imread(io.BytesIO(png), format="png").shape
    assert width >= 800
    assert height >= 400


def test_run_toml_says_how_the_run_came_about(trained: Path) -> None:
    settings = tomllib.loads((trained / "run.toml").read_text())
    assert settings["task"]["time_limit_s"] == 2.0
    assert settings["run"]["command"] == "train"
    assert settings["run"]["trials"] == 3
    assert set(settings["run"]["versions"]) >= {"palpate", "numpy", "mujoco", "pin"}


def test_run_toml_gives_the_same_run_again(trained: Path, tmp_path: Path) -> None:
    out = tmp_path / "again"
    succeed("train", "--config", trained / "run.toml", "--trials", 3, "--out", out)
    assert results_in(out) == results_in(trained)
    assert (out / "run.toml").read_bytes() == (trained / "run.toml").read_bytes()


def test_another_seed_gives_another_run(trained: Path, tmp_path: Path) -> None:
    succeed("train", *QUICK, "--trials", 1, "--seed", 1, "--out", tmp_path / "run")
    (one,), (zero, *_) = (table(folder / "trials.csv") for folder in (tmp_path / "run", trained))
    assert (one["start_x_mm"], one["peak_force_N"]) != (zero["start_x_mm"], zero["peak_force_N"])


def test_what_is_known_beforehand_is_told_from_what_is_learned(trained: Path, tmp_path: Path) -> None:
    shown = table(trained / "decisions.csv")[0]["state"]
    config = tmp_path / "my.toml"
    config.write_text(
        f"[task]\ntime_limit_s = 1.0\n[learning]\nexamples = '{trained / 'decisions.csv'}'\n"
        "[learning.programmed]\n'x- y-' = '+x+y'\n"
    )
    succeed("train", "--config", config, "--trials", 1, "--out", tmp_path / "run")
    lines = succeed("show", tmp_path / "run" / "policy.json").splitlines()
    cells = {tuple(line.split("  ")[0].split()): line for line in lines}
    assert "programmed" in cells["x-", "y-"]
    assert "+x+y" in cells["x-", "y-"]
    assert "examples" in cells[tuple(shown.split())]
    assert any("learned" in line for line in lines[2:])
    sources = {d["source"] for d in table(tmp_path / "run" / "decisions.csv")}
    assert "examples" in sources


def test_training_goes_on_from_a_policy_file(trained: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    succeed("train", *QUICK, "--trials", 1, "--policy", trained / "policy.json", "--out", out)
    assert "4 trials learned" in succeed("show", out / "policy.json")


def test_a_perception_that_was_fitted_travels_in_the_policy(tmp_path: Path) -> None:
    out = tmp_path / "run"
    stages = ("--perception.symbols", "clusters", "--perception.channels", "fx", "fy", "ty")
    counts = ("--perception.fit-trials", "1", "--perception.symbol-count", "4")
    succeed("train", "--task.time-limit-s", "1", *stages, *counts, "--trials", 1, "--out", out)
    policy = out / "policy.json"
    assert "4 states" in succeed("show", policy)
    assert "1 trials" in succeed("run", "--policy", policy, "--config", out / "run.toml", "--trials", 1, cwd=tmp_path)
    # Without its configuration the file would be asked about states that it does not know.
    assert "states[0]" in refusal("run", "--policy", policy, "--trials", 1)


def test_a_search_that_cannot_always_succeed_says_so(tmp_path: Path) -> None:
    words = ("--scenario", "blind", "--task.area-half-width-mm", "1", "--task.start-uncertainty-mm", "1")
    printed = succeed("train", *words, "--task.time-limit-s", "1", "--trials", 1, cwd=tmp_path)
    assert "of the holes lie inside the exploration area" in printed
    # Without --out the folder is named after the scenario.
    assert (tmp_path / "runs" / "blind" / "policy.json").is_file()
