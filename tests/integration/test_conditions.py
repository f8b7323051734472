"""Trials under drawn conditions: stated in table and log, equal in a resumed run, and set up again."""

import csv

import pytest

from palpate.adapters.log import describe, info_of, read_log

DRAWN = ("tilt_heading_deg", "zero_heading_deg", "clearance_mm")
CHANGING = (
    "--scenario", "blind-bias-drawn", "--seed", 11, "--task.time-limit-s", 1, "--cell.tilt-mrad", 4,
    "--cell.conditions.tilt-heading", "drawn", "--cell.conditions.grip-trials", 2, "--cell.conditions.wear-mm", 0.05,
)  # fmt: skip


@pytest.mark.nightly
def test_drawn_conditions_are_recorded_and_the_same_again(palpate, tmp_path):
    palpate.succeed("train", *CHANGING, "--trials", 3, "--out", "whole")
    palpate.succeed("train", *CHANGING, "--trials", 1, "--out", "parts")
    palpate.succeed("train", "--resume", "--trials", 3, "--out", "parts")
    table = (tmp_path / "whole" / "trials.csv").read_text()
    assert table == (tmp_path / "parts" / "trials.csv").read_text()
    rows = list(csv.DictReader(table.splitlines()))
    assert [len({row[name] for row in rows}) for name in DRAWN] == [2, 3, 3]
    log = tmp_path / "whole" / "logs" / "trial-00002.mcap"
    found = info_of(read_log(log))
    assert {name: str(value) for name, value in found["drawn"].items()} == {name: rows[2][name] for name in DRAWN}
    assert f"tilt_heading_deg {rows[2]['tilt_heading_deg']}" in describe(found)
    # A simulator set up for this trial again gives the recorded samples, or the what-if would be refused.
    palpate.succeed("replay", log, "--set", "supervision.retract_mm=16", "--continue-in-mujoco")
