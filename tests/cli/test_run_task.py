"""``palpate run --task``: other tasks than insertions, run, recorded and replayed."""

import csv
from pathlib import Path


def test_who_knows_the_pose_of_hole_and_grip_goes_straight_in_and_is_replayed(palpate):
    words = ("--scenario", "blind-square", "--policy", "oracle-pose", "--trials", 1, "--out", "run")
    assert "success 100.0%" in palpate.succeed("run", "--task", "insertion-6dof", *words)
    with Path("run/trials.csv").open(newline="") as stream:
        assert [float(row["exploration_time_s"]) < 1.0 for row in csv.DictReader(stream)] == [True]
    assert "1 of 1 equal" in palpate.succeed("replay", "run", "--jobs", 1)
