"""``--job``: one file for every command; what is derived, recorded, resumed and replayed, and what is refused."""

import csv
import tomllib
from pathlib import Path

import pytest

from palpate.adapters.config import compose, overlay, read_job, read_toml, run_facts
from palpate.adapters.config.run import RunConfig
from palpate.adapters.log import read_log
from tests.command_line import QUICK

JOBS = Path(__file__).parents[2] / "examples" / "jobs"
DOWEL = JOBS / "dowel-12-h7.toml"
PART = "peg 12.000 mm, hole 12.018 mm, radial clearance 0.009 mm, depth 20 mm"


@pytest.mark.parametrize(
    "job",
    [
        path.name
        if path.name in ("dowel-12-h7.toml", "square-20.toml")
        else pytest.param(path.name, marks=pytest.mark.nightly)
        for path in sorted(JOBS.glob("*.toml"))
    ],
)
def test_each_example_job_runs_with_the_task_and_policy_that_suit_it(palpate, job):
    shape = read_job(JOBS / job)["part"]["shape"]
    words = ("--policy", "torque") if shape == "round" else ("--task", "insertion-6dof", "--policy", "corner-first")
    printed = palpate.succeed("run", "--job", JOBS / job, *words, "--trials", 1, "--out", "run")
    assert "scenario job" in printed


def test_a_job_is_trained_recorded_resumed_replayed_and_reported_as_stated(palpate):
    words = ("--learner", "belief", "--out", "run")
    assert f"palpate: {PART}\n" in palpate("train", "--job", DOWEL, *words, "--trials", 1).stderr
    table = read_toml("run/run.toml")
    assert run_facts(table, "run/run.toml")["part"] == PART
    began = overlay(RunConfig(), table)
    assert began == compose("job", "belief", job=read_job(DOWEL))
    palpate.succeed("train", "--resume", "--out", "run", "--trials", 2)
    assert (
        overlay(RunConfig(), {key: value for key, value in read_toml("run/run.toml").items() if key != "run"}) == began
    )
    with Path("run/trials.csv").open(newline="") as stream:
        assert len(list(csv.DictReader(stream))) == 2
    assert "2 of 2 equal" in palpate.succeed("replay", "run", "--jobs", 1)
    palpate.succeed("report", "run")
    assert PART in Path("run/report.html").read_text(encoding="utf-8")


def test_flags_and_files_change_a_job_and_what_follows_from_it(palpate):
    Path("more.toml").write_text("[part]\nhole_mm = 12.1\n")
    words = ("--job", DOWEL, "--config", "more.toml", "--place.position-uncertainty-mm", 3, "--policy", "torque")
    palpate.succeed("run", *words, *QUICK, "--trials", 1, "--out", "run")
    table = tomllib.loads(Path("run/run.toml").read_text())
    assert (table["cell"]["peg"]["clearance_mm"], table["task"]["area_half_width_mm"]) == (0.05, 3.5)


def test_trials_take_the_places_of_a_job_in_turn_also_after_a_failure(palpate):
    text = DOWEL.read_text().replace("z_mm = 50.0", "z_mm = 50.0\nfurther_mm = [[600.0, 160.0, 52.0]]")
    Path("two.toml").write_text(text)
    words = ("run", "--job", "two.toml", "--policy", "oracle", "--trials", 3, "--cell.peg.friction", 0.1)
    palpate.succeed(*words, "--out", "run")
    with Path("run/trials.csv").open(newline="") as stream:
        assert [row["place"] for row in csv.DictReader(stream)] == ["1", "2", "1"]
    configs = [tomllib.loads(read_log(log).start.config_toml) for log in sorted(Path("run/logs").iterdir())]
    assert [config["place"]["y_mm"] for config in configs] == [100.0, 160.0, 100.0]
    assert "3 of 3 equal" in palpate.succeed("replay", "run", "--jobs", 1)
    Path("two.toml").write_text(text.replace("600.0, 160.0", "1600.0, 160.0"))
    assert "place" in palpate.refusal(*words, "--out", "other")


def test_a_study_varies_part_tool_and_place_of_a_job_beside_it(palpate):
    folder = Path("studies")
    folder.mkdir()
    (folder / "dowel.toml").write_text(DOWEL.read_text())
    (folder / "fit.toml").write_text(
        '[study]\ntrials = 1\npolicies = ["torque"]\njob = "dowel.toml"\n[base]\n"task.time_limit_s" = 0.3\n'
        '[[grid]]\n"part.hole_mm" = [12.03]\n[[grid]]\n"tool.axial_N_per_mm" = [10.0]\n"place.x_mm" = [550.0]\n'
    )
    words = ("study", "studies/fit.toml", "--jobs", 1, "--out", "out")
    assert "finished: 2 of 2 conditions" in palpate.succeed(*words)
    tables = [tomllib.loads(path.read_text()) for path in sorted(Path("out/conditions").glob("*/run.toml"))]
    assert {table["cell"]["peg"]["clearance_mm"] for table in tables} == {0.015, 0.009}
    assert {table["control"]["axial_stiffness_N_per_mm"] for table in tables} == {10.0, 20.0}
    assert {table["task"]["goal"]["x_mm"] for table in tables} == {550.0, 600.0}
    # Again, as it stands in the folder: nothing is left to do.
    assert "finished: 2" in palpate.succeed(*words)
    (folder / "dowel.toml").write_text(DOWEL.read_text().replace("mass_kg = 0.6", "mass_kg = 0.7"))
    assert "was run with other settings or versions, not mass_kg = 0.7" in palpate.refusal(*words)
