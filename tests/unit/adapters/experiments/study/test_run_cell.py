from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments.study import CellOutcome, StudyCell
from palpate.adapters.experiments.study.run_cell import make_cell, one_thread, put_in_place
from tests.unit.adapters.experiments.study.studies import job_in

CELL = StudyCell({"task.start_uncertainty_mm": 1.0}, "torque", 3)


def test_a_learner_is_trained_by_name(tmp_path: Path) -> None:
    cell = StudyCell({}, "belief", 0)
    assert make_cell(job_in(tmp_path, cell)).outcome is CellOutcome.FINISHED
    assert '"belief"' in (tmp_path / cell.name / "policy.json").read_text()
    assert "ticks_per_action = 4" in (tmp_path / cell.name / "run.toml").read_text()


@pytest.mark.parametrize(
    ("base", "files", "problem"),
    [
        ({"task.goal.x_mm": 1900.0}, {}, "place"),
        ({"task.step_mm": 100.0}, {}, "task.step_mm"),
        ({}, {"e.csv": "00"}, "stays as it was"),
        ({}, {"none.csv": "00"}, "none.csv"),
    ],
)
def test_what_fails_says_why_and_leaves_nothing(
    tmp_path: Path, base: dict[str, float], files: dict[str, str], problem: str
) -> None:
    (tmp_path / "e.csv").touch()
    report = make_cell(job_in(tmp_path, CELL, base, files=files))
    assert report.outcome is CellOutcome.FAILED
    assert problem in report.problem
    assert [path.name for path in tmp_path.iterdir()] == ["e.csv"]


def test_of_two_that_make_the_same_cell_the_first_one_stays(tmp_path: Path) -> None:
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "cell.json").write_text(name)
    put_in_place(tmp_path / "first", tmp_path / "cell")
    put_in_place(tmp_path / "second", tmp_path / "cell")
    assert (tmp_path / "cell" / "cell.json").read_text() == "first"


def test_a_place_that_is_no_cell_is_not_taken_for_one(tmp_path: Path) -> None:
    for name in ("new", "there"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "something").touch()
    with pytest.raises(OSError, match="not empty"):
        put_in_place(tmp_path / "new", tmp_path / "there")


def test_libraries_keep_to_one_thread() -> None:
    with threadpool_limits(2), one_thread(RunConfig()):
        assert {library["num_threads"] for library in threadpool_info()} == {1}
