import csv
import json
import os
from pathlib import Path

import pytest

from palpate.adapters.experiments.study import Study, StudyCell, StudyFolder
from palpate.core.errors import ConfigurationError, OutputError
from tests.unit.adapters.experiments.study.studies import study_of

TEXT = "[study]\ntrials = 3\nseeds = [0, 1]\npolicies = ['torque']\n[grid]\ntask.step_mm = [0.5, 0.7]\n"


def put(folder: StudyFolder, cell: StudyCell, figures: object = None) -> Path:
    path = folder.cells / cell.name
    path.mkdir(parents=True)
    (path / "summary.json").write_text(json.dumps(figures or {"success": 1.0}))
    (path / "cell.json").write_text(json.dumps(cell.document()))
    return path


@pytest.fixture
def held(tmp_path: Path) -> tuple[StudyFolder, Study, list[StudyCell]]:
    """A folder with a study in it, of which one cell is finished."""
    folder, study = StudyFolder(tmp_path / "out"), study_of(TEXT, tmp_path)
    cells = list(study.cells())
    with folder.opened(study, {"a.csv": "00ff"}):
        put(folder, cells[0])
    return folder, study, cells


Held = tuple[StudyFolder, Study, list[StudyCell]]


def test_the_same_study_and_a_larger_one_fit(held: Held, tmp_path: Path) -> None:
    folder, study, cells = held
    folder.require_fits(study, cells, {"a.csv": "00ff", "b.csv": "11"})
    larger = study_of(TEXT.replace("[0, 1]", "[7, 1, 0]").replace("[0.5", "[0.6, 0.5"), tmp_path)
    folder.require_fits(larger, list(larger.cells()), {})
    assert folder.finished(list(larger.cells())) == {cells[0].name}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("trials = 3", "trials = 4", "study.trials = 4 is refused: 3, as in the study"),
        ("[grid]", "[base]\narm = 'ur5'\n[grid]", "base.arm = 'ur5' is refused: 'zebra-zero', as in the study"),
        ("[0, 1]", "[1, 2]", r"not asked for \(task.step_mm = 0.5, torque, seed 0\); a study may grow, not shrink"),
        ("[0.5, 0.7]", "[0.7]", "not asked for"),
        ("'torque'", "'random'", "not asked for"),
    ],
)
def test_another_study_does_not_fit(held: Held, tmp_path: Path, old: str, new: str, message: str) -> None:
    folder, _, _ = held
    other = study_of(TEXT.replace(old, new), tmp_path)
    with pytest.raises((ConfigurationError, OutputError), match=message):
        folder.require_fits(other, list(other.cells()), {})


def test_another_version_and_another_file_do_not_fit(held: Held, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, study, cells = held
    with pytest.raises(ConfigurationError, match="the same content"):
        folder.require_fits(study, cells, {"a.csv": "0000"})
    path = folder.path / "study.toml"
    path.write_text(path.read_text().replace('"mujoco" = "', '"mujoco" = "0.'))
    with pytest.raises(ConfigurationError, match=r"versions\.mujoco .* as in the study"):
        folder.require_fits(study, cells, {})


def test_a_folder_with_something_else_or_a_damaged_study_is_refused(held: Held, tmp_path: Path) -> None:
    folder, study, cells = held
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match="file"):
        StudyFolder(tmp_path / "file").require_fits(study, cells, {})
    with pytest.raises(OutputError, match="holds something already, and no study"):
        StudyFolder(folder.cells).require_fits(study, cells, {})
    (folder.path / "study.toml").write_text("[study")
    with pytest.raises(OutputError, match="cannot be read"):
        folder.require_fits(study, cells, {})


@pytest.mark.parametrize("left", ['{"success":', "[[1.0]]", "[" * 100_000])
def test_what_is_not_whole_is_taken_away_and_told(held: Held, left: str) -> None:
    folder, _, cells = held
    without_cell, torn, begun, also_begun = cells[1].name, cells[2].name, cells[3].name, cells[0].name
    (put(folder, cells[1]) / "cell.json").unlink()
    (put(folder, cells[2]) / "summary.json").write_text(left)
    for name in (f"{begun}.0a.unfinished", f"{begun}.0b.unfinished", f"{also_begun}.0c.unfinished"):
        (folder.cells / name).mkdir()
    finished = folder.finished(cells)
    assert finished == {cells[0].name}
    assert folder.clear(cells, finished) == sorted([without_cell, torn, begun])
    assert os.listdir(folder.cells) == [cells[0].name]
    assert folder.count() == 1


def test_a_folder_with_another_cell_in_it_is_refused_and_left(held: Held) -> None:
    folder, _, cells = held
    path = put(folder, cells[1]) / "cell.json"
    path.write_text(json.dumps(cells[2].document()))
    with pytest.raises(OutputError, match=r"is not the cell task\.step_mm = 0\.5, torque, seed 1"):
        folder.finished(cells)
    assert path.exists()


def test_the_table_has_a_line_for_each_finished_cell_in_the_order_of_the_study(held: Held) -> None:
    folder, study, cells = held
    put(folder, cells[3], {"success": 0.5, "success_95": [0.1, 0.9], "outcomes": {"inserted": 2}, "policy": "x"})
    put(folder, cells[1], {"success": 0.5, "outcomes": {"time limit": 1}, "learning": {"speed_up": 3.0}})
    assert folder.write_table(study, cells) == 3
    with (folder.path / "summary.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["cell"] for row in rows] == [cells[0].name, cells[1].name, cells[3].name]
    assert list(rows[0]) == [
        "cell", "task.step_mm", "policy", "seed", "success", "outcomes.time limit", "outcomes.inserted",
        "learning.speed_up", "success_95_low", "success_95_high",
    ]  # fmt: skip
    assert list(rows[2].values())[1:] == ["0.7", "torque", "1", "0.5", "0", "2", "", "0.1", "0.9"]


def test_a_cell_that_leaves_a_setting_as_it_is_shows_its_value(tmp_path: Path) -> None:
    text = (
        "[base]\ntask.step_mm = 0.5\n[[cells]]\n[[cells]]\ntask.step_mm = 0.6\n[[cells]]\nperception.channels = ['x']"
    )
    study, folder = study_of(text + "\nperception.symbols = 'clusters'", tmp_path), StudyFolder(tmp_path / "out")
    cells = list(study.cells())
    for cell in cells:
        put(folder, cell)
    folder.write_table(study, cells)
    with (folder.path / "summary.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["task.step_mm"] for row in rows] == ["0.5", "0.6", "0.5"]
    assert [row["perception.channels"] for row in rows] == ['["x", "y", "tx", "ty"]'] * 2 + ['["x"]']


def test_a_base_that_makes_sense_with_the_grid_alone(tmp_path: Path) -> None:
    text = "[base]\ntask.start_uncertainty_mm = 5.0\n[grid]\ntask.area_half_width_mm = [6.0, 7.0]"
    study, folder = study_of(text, tmp_path), StudyFolder(tmp_path / "out")
    with folder.opened(study, {}):
        folder.require_fits(study, list(study.cells()), {})
