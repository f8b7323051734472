"""``palpate plan``: what it prints of a job, its exit codes, and the trials that it simulates."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOWEL = ROOT / "examples" / "jobs" / "dowel-12-h7.toml"


def changed(path, *changes):
    """The dowel's job with other lines, in a file of its own."""
    text = DOWEL.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def test_feasible_job_is_printed_with_its_settings_regime_and_command(palpate):
    done = palpate("plan", DOWEL)
    assert (done.code, done.stderr) == (0, "")
    assert "peg 12.000 mm, hole 12.018 mm, radial clearance 0.009 mm, depth 20 mm" in done.stdout
    assert "4.9 N        pressing force of the search" in done.stdout
    assert "31.8 Hz       natural frequency of the tool on its gripper" in done.stdout
    assert f"verdict: feasible, a peg that needs no turn\n  palpate train --learner belief --job {DOWEL}" in (
        done.stdout
    )


def test_another_arm_may_be_named_and_has_to_reach_the_hole(palpate):
    assert "--arm ur5e" in palpate.succeed("plan", DOWEL, "--arm", "ur5e")
    done = palpate("plan", DOWEL, "--arm", "ur3")
    assert done.code == 1
    assert "move the hole nearer to the arm" in done.stdout


def test_job_that_jams_has_exit_code_1_and_a_remedy(palpate, tmp_path):
    job = changed(tmp_path / "tilted.toml", ("tilt_uncertainty_mrad = 2.0", "tilt_uncertainty_mrad = 6.0"))
    done = palpate("plan", job)
    assert done.code == 1
    assert "jams at 3.2 mm (J = 4.1): press with at least 20 N" in done.stdout


def test_run_refuses_what_the_plan_refuses(palpate, tmp_path):
    job = changed(tmp_path / "job.toml", ("depth_tolerance_mm = 0.3", "depth_tolerance_mm = 0.05"))
    done = palpate("plan", job)
    assert done.code == 1
    assert "0.05 mm, is below four standard deviations of depth, 0.074 mm" in done.stdout
    assert "at least 0.074, four standard deviations" in palpate.refusal(
        "run", "--policy", "torque", "--job", job, "--out", tmp_path / "run"
    )


@pytest.mark.parametrize(
    ("flag", "value", "message"),
    [
        ("--task.area-half-width-mm", 1.0, "at least place.position_uncertainty_mm = 1.5, or holes lie outside"),
        ("--task.ready-height-mm", 0.5, "more than 0.512, or a tilted peg may begin in a plate"),
    ],
)
def test_settings_by_hand_that_contradict_the_job_are_refused(palpate, tmp_path, flag, value, message):
    words = ("run", "--policy", "torque", "--job", DOWEL, "--out", tmp_path / "run", flag, value)
    assert message in palpate.refusal(*words)


def test_job_is_simulated_over_its_uncertainties(palpate):
    printed = palpate.succeed("plan", DOWEL, "--trials", 3, "--seed", 1, "--out", "figure.svg")
    # The first trial of a learner is its training.
    assert "inserted         2 of 2 (95 % interval 15.8% to 100.0%)" in printed
    assert 'false "inserted" 0 of 2' in printed
    assert "highest force" in printed
    assert "<svg" in Path("figure.svg").read_text()
    assert "that does not exist yet" in palpate.refusal("plan", DOWEL, "--trials", 1, "--out", "figure.svg")
