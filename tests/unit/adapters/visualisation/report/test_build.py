"""A folder is known by its files."""

from pathlib import Path

import pytest

from palpate.adapters.visualisation.report.build import maker_of
from palpate.core.errors import OutputError


@pytest.mark.parametrize(
    ("files", "page"),
    [
        (("run.toml", "trials.csv", "summary.json"), "run_page"),
        (("run.toml",), "run_page"),
        (("run.toml", "compare.csv", "summary.json"), "compare_page"),
        (("study.toml", "summary.csv"), "study_page"),
        (("cells/",), "study_page"),
        # A report that is there already changes nothing.
        (("run.toml", "trials.csv", "report.html", "report/"), "run_page"),
    ],
)
def test_kinds(tmp_path: Path, files: tuple[str, ...], page: str) -> None:
    for name in files:
        (tmp_path / name).mkdir() if name.endswith("/") else (tmp_path / name).touch()
    assert maker_of(tmp_path).__name__ == page


def test_what_is_none(tmp_path: Path) -> None:
    for left in ((), ("summary.json", "trials.csv", "table.txt"), ("report.html", "automaton.json")):
        for name in left:
            (tmp_path / name).touch()
        with pytest.raises(OutputError, match="no folder that a report can be made of"):
            maker_of(tmp_path)
    with pytest.raises(OutputError, match="is a file"):
        maker_of(tmp_path / "report.html")
    with pytest.raises(OutputError, match="is not there"):
        maker_of(tmp_path / "nothing")


def test_a_comparison_under_way(tmp_path: Path) -> None:
    (tmp_path / "run.toml").write_text('[run]\nformat = "palpate.run/1"\ncommand = "compare"\n')
    with pytest.raises(OutputError, match="not come to its end"):
        maker_of(tmp_path)
