"""``palpate faults``, with a small share of the campaign."""

import csv
from pathlib import Path

from tests.command_line import CommandLine


def test_a_share_of_the_campaign_ends_in_stops_and_readable_logs(palpate: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "runs.csv"
    printed = palpate.succeed("faults", "--group", "devices", "--most", 14, "--jobs", 1, "--out", out)
    assert "14 runs, the fault struck in 14" in printed
    assert "failed: 0" in printed
    assert "unreadable logs, or logs that do not tell of their fault: 0" in printed
    with out.open() as stream:
        runs = list(csv.DictReader(stream))
    assert len(runs) == 14
    assert len({run["variant"] for run in runs}) > 8
    assert {run["verdict"] for run in runs} <= {"tolerable", "detected", "unobservable"}
    assert any(run["verdict"] == "detected" for run in runs)
    assert {run["safe_stop"] for run in runs} == {"True"}
    assert all(run["cause"] for run in runs if run["verdict"] == "detected")
    assert "runs in which the arm was told to stop at the end: 14" in printed
    assert "is there already" in palpate.refusal("faults", "--out", out)


def test_liars_are_chosen_by_phase_and_name_and_a_false_success_is_the_worst_verdict(palpate: CommandLine) -> None:
    chosen = ("faults", "--group", "liars", "--phase", "explore", "--jobs", 1)
    done = palpate(*chosen, "--fault", "times 100", "--by-phase")
    assert "1 runs, the fault struck in 1" in done.stdout
    assert "liar: force times 100  explore" in done.stdout
    # Unsupervised and without proof the lie passes: scaled up, the spring of the gripper seems deep in the hole.
    unproved = ("--no-supervisor", "--task.no-prove-contact")
    done = palpate("faults", "--group", "liars", "--phase", "lift", "--fault", "times 2", "--jobs", 1, *unproved)
    assert done.code == 1
    assert "of these said what was not so: 1" in done.stdout
    assert "part of the name of a fault" in palpate.refusal(*chosen, "--fault", "no such")


def test_the_campaign_fails_without_a_supervisor(palpate: CommandLine) -> None:
    done = palpate("faults", "--most", 12, "--jobs", 1, "--no-supervisor")
    assert done.code == 1
    assert "failed: 0" not in done.stdout


def test_a_leaning_corner_is_not_pushed_on_by_a_sensor_that_shows_a_tenth_of_the_force_turned_round(
    palpate: CommandLine, tmp_path: Path
) -> None:
    task = ("--task", "insertion-6dof", "--scenario", "blind-square", "--task.options", "corners", 4, "corner_mm", 20.5)
    chosen = ("--policy", "corner-first", "--group", "liars", "--phase", "explore", "--fault", "flipped and times 0.1")
    palpate.succeed("faults", *task, *chosen, "--jobs", 1, "--out", tmp_path / "runs.csv")
    with (tmp_path / "runs.csv").open() as stream:
        (run,) = csv.DictReader(stream)
    assert run["latched"] == "True"
    assert float(run["peak_force_N"]) < 60.0
