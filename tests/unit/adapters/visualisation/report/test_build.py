"""A folder is known by its files."""

from pathlib import Path

import pytest

from palpate.adapters.visualisation.report.build import FolderKind, kind_of
from palpate.core.errors import OutputError


@pytest.mark.parametrize(
    ("files", "kind"),
    [
        (("run.toml", "trials.csv", "summary.json"), FolderKind.RUN),
        (("run.toml",), FolderKind.RUN),
        (("run.toml", "compare.csv", "summary.json"), FolderKind.COMPARE),
        (("summary.json", "trials.csv", "table.txt", "policy-0.json"), FolderKind.EXPLORE),
        (("automaton.json", "report.json", "network.json"), FolderKind.INFER),
        (("study.toml", "summary.csv"), FolderKind.STUDY),
        (("cells/",), FolderKind.STUDY),
        # A report that is there already changes nothing.
        (("run.toml", "trials.csv", "report.html", "report/"), FolderKind.RUN),
    ],
)
def test_kinds(tmp_path: Path, files: tuple[str, ...], kind: FolderKind) -> None:
    for name in files:
        (tmp_path / name).mkdir() if name.endswith("/") else (tmp_path / name).touch()
    assert kind_of(tmp_path) is kind


def test_what_is_none(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no folder that palpate left"):
        kind_of(tmp_path)
    (tmp_path / "report.html").touch()
    (tmp_path / "automaton.json").touch()
    with pytest.raises(OutputError, match="no folder that palpate left"):
        kind_of(tmp_path)
    with pytest.raises(OutputError, match="is a file"):
        kind_of(tmp_path / "report.html")
    with pytest.raises(OutputError, match="is not there"):
        kind_of(tmp_path / "nothing")


def test_a_comparison_under_way(tmp_path: Path) -> None:
    (tmp_path / "run.toml").write_text('[run]\ncommand = "compare"\n')
    with pytest.raises(OutputError, match="not come to its end"):
        kind_of(tmp_path)
