"""``palpate run --task``: other tasks than insertions, run, recorded and replayed; and what does not go together."""

import csv
from pathlib import Path

import pytest

SPATIAL = "--task insertion-6dof"
TURNING = f"{SPATIAL} --policy torque --task.options"
SQUARE = f"{SPATIAL} --policy corner-first --task.options corners 4"


def test_who_knows_the_pose_of_hole_and_grip_goes_straight_in_and_is_replayed(palpate):
    words = ("--scenario", "blind-square", "--policy", "oracle-pose", "--trials", 1, "--out", "run")
    assert "success 100.0%" in palpate.succeed("run", "--task", "insertion-6dof", *words)
    with Path("run/trials.csv").open(newline="") as stream:
        assert [float(row["exploration_time_s"]) < 1.0 for row in csv.DictReader(stream)] == [True]
    assert "1 of 1 equal" in palpate.succeed("replay", "run", "--jobs", 1)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (f"run {SPATIAL} --policy corner-first", "3 or more for the policy corner-first"),
        ("run --policy corner-first", "one of --task insertion-6dof"),
        (f"run {TURNING} most_tilt_deg 30", "a turn about y that zebra-zero can make above the goal"),
        (f"run {SQUARE}", "0, as the round peg of cell.peg.cross_section has"),
        ("run --policy torque --task.options way_mm 9", "no option of insertion"),
    ],
)
def test_options_that_do_not_go_together_are_refused_in_one_line(palpate, words, message):
    palpate.refuses(words, message)
