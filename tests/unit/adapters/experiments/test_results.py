"""The run folder: what is in it reads back, and no error loses what was there before."""

import csv
from dataclasses import replace

import pytest

from palpate.adapters.experiments.results import RUN_FILES, RunFolder, TrialRow
from palpate.core.errors import OutputError
from tests.unit.adapters.samples import scored_trial


@pytest.fixture
def folder(tmp_path):
    made = RunFolder(tmp_path / "runs" / "one")
    made.create()
    return made


def content(folder):
    return {path.name: path.read_bytes() for path in folder.path.iterdir()}


def test_a_trial_in_the_units_of_its_columns():
    row = TrialRow.of(scored_trial(3))
    assert (row.trial, row.outcome, row.success, row.ticks) == (3, "inserted", True, 303)
    assert (row.start_x_mm, row.start_y_mm, row.hole_x_mm, row.hole_y_mm) == (3.0, -2.0, 0.1, -0.2)
    assert row.depth_mm == 10.0
    # The truth counts; what the core measured stands beside it.
    assert (row.peak_force_N, row.measured_peak_force_N) == (6.25, 5.5)


def test_trials_read_back(folder):
    assert folder.read_trials() == []
    trials = [scored_trial(0), scored_trial(1, success=False, decisions=0), scored_trial(2)]
    trials[2].report.temperature = None
    for scored in trials:
        folder.append_trial(scored)
    assert folder.read_trials() == [TrialRow.of(scored) for scored in trials]


def test_what_was_drawn_has_columns_of_its_own(folder):
    drawn = {"tilt_heading_deg": -12.5, "clearance_mm": 0.08}
    plain = scored_trial(0)
    assert plain.truth is not None
    scored = replace(plain, truth=replace(plain.truth, drawn=drawn))
    folder.append_trial(scored)
    header = (folder.path / "trials.csv").read_text().splitlines()[0]
    assert header.endswith(",marked,trip,tilt_heading_deg,clearance_mm")
    assert folder.read_trials() == [TrialRow.of(scored)]


def test_decisions_say_which_trial_and_what_came_of_them(folder):
    for k in range(2):
        folder.append_trial(scored_trial(k))
    with (folder.path / "decisions.csv").open(newline="") as stream:
        lines = list(csv.DictReader(stream))
    assert [(line["trial"], line["tick"], line["reinforcement"]) for line in lines] == [
        ("0", "100", ""), ("0", "114", "-1.0"), ("1", "100", ""), ("1", "114", "-1.0"),
    ]  # fmt: skip
    assert {(line["state"], line["action"], line["source"]) for line in lines} == {("x+ y0", "-x", "learned")}


def test_only_the_first_trials_are_kept(folder):
    for k in range(2):
        folder.append_trial(scored_trial(k))
    before = content(folder)
    for k in range(2, 12):
        folder.append_trial(scored_trial(k))
    folder.truncate(2)
    assert content(folder) == before


@pytest.mark.parametrize("remains", ["1", "1,inserted,Tr", "11,inserted,True,1.0"])
def test_a_line_that_was_cut_short_is_dropped(folder, remains):
    folder.append_trial(scored_trial(0))
    before = content(folder)
    for name in ("trials.csv", "decisions.csv"):
        with (folder.path / name).open("a") as stream:
            stream.write(remains)
    folder.truncate(20)
    assert content(folder) == before


def test_damaged_trials_are_reported(folder):
    folder.append_trial(scored_trial(0))
    path = folder.path / "trials.csv"
    path.write_text(path.read_text().replace("6.25", "much"))
    with pytest.raises(OutputError, match=r"trials\.csv: cannot be read"):
        folder.read_trials()


@pytest.mark.parametrize("name", RUN_FILES)
def test_a_folder_that_holds_a_run_is_not_free(folder, name):
    folder.require_free()
    (folder.path / name).write_text("")
    with pytest.raises(OutputError, match=f"already holds a run .{name}"):
        folder.require_free()


def test_a_folder_for_logs_without_any_is_not_in_the_way(folder):
    logs = folder.path / "logs"
    logs.mkdir()
    folder.create()
    (logs / "trial-00000.mcap").touch()
    with pytest.raises(OutputError, match=r"already holds a run \(logs\)"):
        folder.create()
