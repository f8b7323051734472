"""``palpate report``: a page that needs nothing else, of every kind of folder, and what is refused."""

import base64
import csv
import re
import shutil
import subprocess
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path

import pytest
from scipy.stats import t

from palpate.adapters.experiments.study.cell import StudyCell
from tests.command_line import CommandLine, command, files_in, shared_folder
from tests.unit.adapters.visualisation.report.sample_folders import make_study

STEPS = (0.5, 0.7)
SEEDS = (0, 1)
TRIALS = 2
LIMIT_S = 0.6


class Page(HTMLParser):
    """What a browser would find in a report."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path, self.text = path, path.read_text(encoding="utf-8")
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.headings: list[str] = []
        self._heading = False
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: Sequence[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        self._heading = tag == "h2"

    def handle_data(self, data: str) -> None:
        if self._heading:
            self.headings.append(data)
            self._heading = False

    @property
    def images(self) -> list[dict[str, str]]:
        return [attrs for tag, attrs in self.tags if tag == "img"]


def reported(folder: Path, *words: str) -> Page:
    CommandLine().succeed("report", folder, *words)
    return Page(folder / "report.html")


def lines_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="session")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study over one setting; to be read, not changed."""
    return shared_folder(tmp_path_factory, "swept", lambda out: make_study(out, STEPS, SEEDS, TRIALS, LIMIT_S))


@pytest.fixture
def study(tmp_path: Path, swept: Path) -> Path:
    """A copy of the study, which may be changed."""
    return shutil.copytree(swept, tmp_path / "study")


def require_complete(page: Page) -> None:
    """The page needs nothing outside itself, and can be used without seeing its pictures."""
    assert "script" not in {tag for tag, _ in page.tags}
    for tag, attrs in page.tags:
        for name in ("src", "href", "action", "data", "srcset", "poster"):
            assert attrs.get(name, "#").startswith(("#", "data:")), (tag, attrs)
    assert not re.search(r"url\(|@import", page.text)
    pictures = {path.name: path.read_bytes() for path in (page.path.parent / "report").glob("*.png")}
    assert {base64.b64decode(image["src"].partition(",")[2]) for image in page.images} == set(pictures.values())
    assert len(page.images) == len(pictures)
    for image in page.images:
        assert len(image["alt"]) > 20
    anchors = {attrs["id"] for _, attrs in page.tags if "id" in attrs}
    assert {attrs["href"][1:] for tag, attrs in page.tags if tag == "a"} <= anchors


def test_a_training_run_has_equal_bytes_in_any_process_and_its_results_stay(run: Path, trained: Path) -> None:
    page = reported(run)
    require_complete(page)
    assert page.headings == [
        "In figures", "Learning curve", "Policy", "Q values", "Forces of single trials", "Cycle timing", "Settings",
    ]  # fmt: skip
    (line,) = lines_of(run / "report" / "summary.csv")
    assert (line["policy"], line["trials"], line["counted"]) == ("q-learning", "3", "1")
    last = lines_of(run / "trials.csv")[-1]
    assert float(line["mean_s"]) == pytest.approx(float(last["exploration_time_s"]), abs=1e-4)
    # Trials are counted as in trials.csv, in the names of logs and on the pictures' axes.
    assert "Trial 0 (first" in page.text
    # Every trial of this short run is the first, the last or the one with the highest force.
    assert {"force-01.png", "force-02.png"} <= {path.name for path in (run / "report").iterdir()}
    first, results = files_in(run), files_in(trained)
    assert {name: first[name] for name in results} == results
    elsewhere = shutil.copytree(run, run.parent / "elsewhere" / "run")
    # In a process of its own: nothing that was drawn before has an influence.
    subprocess.run(command("report", elsewhere), check=True, capture_output=True, timeout=120)
    assert files_in(elsewhere) == first


def test_a_study(study: Path) -> None:
    (study / "summary.csv").write_text("the study's own\n")
    page = reported(study)
    require_complete(page)
    assert page.headings == [
        "Against the swept settings", "In figures", "Learning curves", "Policies", "Q values", "Settings",
    ]  # fmt: skip
    assert "unfinished" not in page.text
    curves = [image["alt"] for image in page.images if "Learning curve" in image["alt"]]
    assert len(curves) == len(STEPS)
    assert all("q-learning" in alt and "torque" in alt for alt in curves)
    names = {path.name for path in (study / "report").iterdir()}
    assert {"sweep-task.step-mm.png", "learning-01.png", "policy-02-torque-regions.png", "q-01.png"} <= names
    assert (study / "summary.csv").read_text() == "the study's own\n"
    require_true_figures(study)


def cell_of(study: Path, policy: str, step_mm: float, seed: int) -> Path:
    return study / "cells" / StudyCell({"task.step_mm": step_mm}, policy, seed).name


def require_true_figures(study: Path) -> None:
    """What the report says of a study is what the trials of its cells say."""
    lines = {(line["task.step_mm"], line["policy"]): line for line in lines_of(study / "report" / "summary.csv")}
    assert list(lines) == [(f"{step}", policy) for step in STEPS for policy in ("q-learning", "torque")]
    for (step, policy), line in lines.items():
        cells = [cell_of(study, policy, float(step), seed) for seed in SEEDS]
        rows = [lines_of(cell / "trials.csv") for cell in cells]
        # Half of the trials of a learner as short as this one, all of the others.
        rows = [part[-(TRIALS // 2) :] if policy == "q-learning" else part for part in rows]
        means = [sum(float(row["exploration_time_s"]) for row in part) / len(part) for part in rows]
        mean = sum(means) / 2
        # The standard error of two values is half their distance.
        half = t.ppf(0.975, 1) * abs(means[0] - means[1]) / 2
        assert float(line["mean_s"]) == pytest.approx(mean, abs=1e-4)
        # No trial takes longer than the study's time limit, so nor does the mean.
        assert float(line["mean_s_high"]) == pytest.approx(min(mean + half, LIMIT_S), abs=1e-4)
        assert float(line["mean_s_low"]) == pytest.approx(max(0.0, mean - half), abs=1e-4)
        wins = [row["success"] == "True" for part in rows for row in part]
        assert float(line["success"]) == pytest.approx(sum(wins) / len(wins), abs=1e-4)
        assert line["seeds"] == "2"


def test_a_comparison(palpate: CommandLine, compared: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(compared, tmp_path / "compare")
    page = reported(folder)
    require_complete(page)
    assert page.headings == ["Side by side", "Forces of single trials", "Cycle timing", "Settings"]
    (table,) = [image["alt"] for image in page.images if image["alt"].startswith("Success and time")]
    assert all(name in table for name in ("omniscient", "torque", "spiral-10", "spiral-5", "random"))
    assert lines_of(folder / "report" / "summary.csv") == lines_of(folder / "compare.csv")


@pytest.mark.parametrize("name", ["trials.csv", "summary.json", "policy.json", "run.toml"])
def test_damaged_files_of_a_run(palpate: CommandLine, run: Path, name: str) -> None:
    path = run / name
    half = path.read_bytes()[: path.stat().st_size // 2]
    # Of settings, half may be sound ones.
    path.write_bytes(half[: half.rindex(b"=") + 1] if name == "run.toml" else half)
    assert f"run/{name}" in palpate.refusal("report", "run")
