"""Cells of a study: which count, what they have in common, and which are refused."""

import json
from pathlib import Path
from typing import Any

import pytest

from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.visualisation.report.study_source import StudySource
from palpate.core.errors import OutputError
from tests.unit.adapters.samples import scored_trial

STEP = "task.step_mm"


def cell(
    study: Path, name: str, fields: dict[str, Any], policy: str = "q-learning", seed: int = 0, settings: str = ""
) -> Path:
    folder = study / "cells" / name
    folder.mkdir(parents=True)
    for index in range(2):
        RunFolder(folder).append_trial(scored_trial(index))
    (folder / "summary.json").write_text("{}")
    command = "train" if policy == "q-learning" else "run"
    (folder / "run.toml").write_text(f'{settings}\n[run]\nformat = "palpate.run/1"\ncommand = "{command}"\n')
    document = {"fields": fields, "policy": policy, "seed": seed, "format": 1}
    (folder / "cell.json").write_text(json.dumps(document))
    return folder


def test_cells_are_ordered_by_value_and_not_by_name(tmp_path: Path) -> None:
    for number, step in enumerate((10.0, 9.0, 2)):
        cell(tmp_path, f"{number}", {STEP: step})
    study = StudySource.read(tmp_path)
    assert [c.fields[STEP] for c in study.cells] == [2, 9.0, 10.0]
    assert study.swept == {STEP: [2, 9.0, 10.0]}


def test_seeds_make_a_group(tmp_path: Path) -> None:
    for seed in (1, 0):
        for policy in ("torque", "q-learning"):
            cell(tmp_path, f"{policy}{seed}", {STEP: 0.5, "arm": "ur5"}, policy, seed)
    study = StudySource.read(tmp_path)
    assert study.swept == {}
    assert study.policies == ["q-learning", "torque"]
    groups = study.groups
    assert [[c.seed for c in cells] for cells in groups.values()] == [[0, 1], [0, 1]]


def test_unfinished_cells_are_counted_once(tmp_path: Path) -> None:
    cell(tmp_path, "a", {STEP: 0.5})
    for name in ("b.01234567.unfinished", "b.89abcdef.unfinished", "c", "a.01234567.unfinished"):
        (tmp_path / "cells" / name).mkdir()
    study = StudySource.read(tmp_path)
    assert study.begun == ("b", "c")
    assert study.unfinished == 2


def test_a_damaged_study_file_is_told_and_not_fatal(tmp_path: Path) -> None:
    cell(tmp_path, "a", {STEP: 0.5})
    (tmp_path / "study.toml").write_text("[study")
    study = StudySource.read(tmp_path)
    assert study.unfinished == 0
    assert "TOML" in study.problem


def test_a_field_that_a_cell_leaves_as_it_is(tmp_path: Path) -> None:
    cell(tmp_path, "a", {STEP: 0.5})
    cell(tmp_path, "b", {"arm": "ur5"}, settings='arm = "ur5"\n[task]\nstep_mm = 0.7')
    study = StudySource.read(tmp_path)
    assert study.swept == {"arm": ["default", "ur5"], STEP: [0.5, 0.7]}


def test_policy_files_go_by_the_run_that_made_them(tmp_path: Path) -> None:
    cell(tmp_path, "a", {}, "runs/paper/policy.json")
    cell(tmp_path, "b", {}, "torque")
    assert StudySource.read(tmp_path).policies == ["paper", "torque"]
    cell(tmp_path, "c", {}, "other/paper/policy.json")
    assert StudySource.read(tmp_path).policies == [
        "other/paper/policy.json", "runs/paper/policy.json", "torque",
    ]  # fmt: skip


@pytest.mark.parametrize("make", ["nothing", "file", "hidden"])
def test_a_study_without_cells(tmp_path: Path, make: str) -> None:
    (tmp_path / "cells").mkdir()
    if make == "file":
        (tmp_path / "cells" / "a").touch()
    if make == "hidden":
        (tmp_path / "cells" / ".a").mkdir()
    with pytest.raises(OutputError, match="a study without a cell"):
        StudySource.read(tmp_path)


def test_a_study_without_a_finished_cell(tmp_path: Path) -> None:
    (tmp_path / "cells" / "a").mkdir(parents=True)
    (tmp_path / "cells" / "b").mkdir()
    with pytest.raises(OutputError, match="2 cells, none of them finished"):
        StudySource.read(tmp_path)


@pytest.mark.parametrize("missing", ["trials.csv", "summary.json"])
def test_a_half_written_cell(tmp_path: Path, missing: str) -> None:
    (cell(tmp_path, "a", {STEP: 0.5}) / missing).unlink()
    with pytest.raises(OutputError, match=rf"cells/a: says that it is finished, but has no {missing}"):
        StudySource.read(tmp_path)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "no whole JSON"),
        ('{"fields": {"task', "no whole JSON"),
        ("[]", "no JSON object"),
        ('{"fields": {}, "policy": "torque", "seed": 0}', "format None, not 1"),
        ('{"fields": {}, "policy": "torque", "seed": 0, "format": 2}', "format 2, not 1"),
        ('{"fields": {}, "policy": "torque", "format": 1}', "lacks"),
        ('{"fields": [], "policy": "torque", "seed": 0, "format": 1}', "lacks"),
    ],
)
def test_a_cell_file_that_cannot_be_used(tmp_path: Path, text: str, problem: str) -> None:
    (cell(tmp_path, "a", {STEP: 0.5}) / "cell.json").write_text(text)
    with pytest.raises(OutputError, match=problem):
        StudySource.read(tmp_path)
