"""Files that are damaged are refused in one line that names them."""

from pathlib import Path

import pytest

from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.visualisation.report.files import (
    read_table,
    read_text,
    read_trials,
)
from palpate.core.errors import OutputError
from tests.unit.adapters.samples import scored_trial


@pytest.fixture
def run(tmp_path: Path) -> Path:
    folder = RunFolder(tmp_path)
    for index in range(3):
        folder.append_trial(scored_trial(index))
    return tmp_path


@pytest.mark.parametrize("word", ["nan", "inf"])
def test_trials_with_a_number_that_is_none(run: Path, word: str) -> None:
    path = run / "trials.csv"
    path.write_text(path.read_text().replace("1.5,", f"{word},"))
    with pytest.raises(OutputError, match="not finite"):
        read_trials(run)


def test_text_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(OutputError, match="UTF-8"):
        read_text(path)
    with pytest.raises(OutputError, match="cannot be read"):
        read_text(tmp_path / "y.txt")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a,b\n1,2\n3", "middle of a line"),
        ("a,b\n1\n", "too few or too many"),
        ("a,b\n1,2,3\n", "too few or too many"),
        ("a,c\n1,2\n", "no column b"),
        ("", "no column a"),
    ],
)
def test_tables_that_are_damaged(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(OutputError, match=problem):
        read_table(path, ("a", "b"))
