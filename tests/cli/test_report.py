"""``palpate report``: a page of a run and of a study that needs nothing else, and what is refused."""

import csv
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest

from palpate.adapters.experiments import mean_with_interval
from tests.command_line import CommandLine, files_in, shared_folder

STEPS = (0.5, 0.7)
SEEDS = (0, 1)
TRIALS = 2
STUDY = f"""
[study]
trials = {TRIALS}
seeds = {list(SEEDS)}
policies = ["q-learning", "torque"]
[base]
"task.time_limit_s" = 0.4
"recording.enabled" = false
[grid]
"task.step_mm" = {list(STEPS)}
"""


class Page(HTMLParser):
    """The content of a report."""

    def __init__(self, folder):
        super().__init__()
        self.text = (folder / "report.html").read_text(encoding="utf-8")
        self.tags = []
        self.cells = {"h2": [], "dt": [], "dd": [], "th": [], "td": [], "p": []}
        self._tag = ""
        self.feed(self.text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        self._tag = tag

    def handle_data(self, data):
        if self._tag in self.cells and data.strip():
            self.cells[self._tag].append(data)

    @property
    def facts(self):
        return dict(zip(self.cells["dt"], self.cells["dd"], strict=True))

    @property
    def alts(self):
        return [attrs["alt"] for tag, attrs in self.tags if tag == "img"]

    def require_complete(self):
        """Nothing outside of the page is needed."""
        assert "script" not in {tag for tag, _ in self.tags}
        for tag, attrs in self.tags:
            for name in ("src", "href"):
                assert attrs.get(name, "data:").startswith("data:"), (tag, attrs)
        assert not re.search(r"url\(|@import", self.text)


def lines_of(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="session")
def swept(tmp_path_factory):
    """A finished study over one setting; to be read, not changed."""

    def make(out):
        out.with_suffix(".toml").write_text(STUDY)
        CommandLine().succeed("study", out.with_suffix(".toml"), "--out", out, "--jobs", 1)

    return shared_folder(tmp_path_factory, "swept", make)


@pytest.fixture
def study(tmp_path, swept):
    """A copy of the study, which may be changed."""
    return shutil.copytree(swept, tmp_path / "study")


def test_a_training_run(palpate, run):
    results = files_in(run)
    palpate.succeed("report", run)
    page = Page(run)
    page.require_complete()
    assert page.cells["h2"] == ["Summary", "Trials", "Policy", "Forces in individual trials", "Settings"]
    assert (page.facts["Policy"], page.facts["Run on"], page.facts["Trials"]) == ("q-learning", "simulator", "3")
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", page.facts["Date"])
    assert page.alts[0].startswith("Exploration time of each trial. q-learning: ")
    assert any(alt.startswith("Best action of each state. x- y-: ") for alt in page.alts)
    assert any("Trial 0 (first" in alt for alt in page.alts)
    # Results stay as they were, and the page is made again in equal bytes.
    assert {name: content for name, content in files_in(run).items() if name != "report.html"} == results
    palpate.succeed("report", run)
    assert Page(run).text == page.text
    palpate.succeed("report", run, "--no-logs")
    assert "Forces in individual trials" not in Page(run).cells["h2"]
    (run / "run.toml").write_text((run / "run.toml").read_text().replace("[run]\n", "[run]\nrig = 'rig bench'\n"))
    palpate.succeed("report", run, "--no-logs")
    assert Page(run).facts["Run on"] == "rig bench"


def test_a_claim_is_on_the_page(palpate):
    run = ("run", "--policy", "oracle", "--trials", 1, "--recording.no-enabled", "--out", "out")
    assert palpate(*run, "--claim", "success >= 0.9").code == 1
    palpate.succeed("report", "out")
    page = Page(Path("out"))
    assert page.facts["Claim"] == "success >= 0.9: inconclusive"
    assert "100.0% [2.5%, 100.0%]" in page.cells["td"]


def test_a_study_says_what_its_trials_say(palpate, study):
    palpate.succeed("report", study)
    page = Page(study)
    page.require_complete()
    assert page.cells["h2"] == ["Summary", "Effect of the swept settings", "Learning curves", "Settings"]
    assert page.facts["Swept: task.step_mm"] == "0.5, 0.7"
    assert "unfinished" not in page.text
    assert sum("Learning curve" in alt for alt in page.alts) == len(STEPS)
    names, figures = page.cells["th"][8:], page.cells["td"]
    for number, name in enumerate(names):
        policy, step = name.split(", task.step_mm = ")
        folders = [study / "conditions" / f"{policy},step_mm={step},seed={seed}" for seed in SEEDS]
        # Half of the trials of a learner as short as this one count, all of the others.
        counted = TRIALS // 2 if policy == "q-learning" else TRIALS
        parts = [lines_of(folder / "trials.csv")[-counted:] for folder in folders]
        means = [sum(float(row["exploration_time_s"]) for row in part) / len(part) for part in parts]
        middle, low, high = mean_with_interval(means)
        assert figures[8 * number] == "2"
        assert figures[8 * number + 3] == f"{middle:.2f} [{max(0.0, low):.2f}, {high:.2f}]"
    assert len(names) == 4


def test_an_unfinished_study_says_so(palpate, study):
    shutil.rmtree(next((study / "conditions").iterdir()))
    palpate.succeed("report", study)
    assert "This study is unfinished: 1 of 8 conditions are missing." in Page(study).cells["p"]


@pytest.mark.parametrize("name", ["trials.csv", "summary.json", "policy.json", "run.toml"])
def test_damaged_files_of_a_run(palpate, run, name):
    path = run / name
    half = path.read_bytes()[: path.stat().st_size // 2]
    # Of settings, half may be sound ones.
    path.write_bytes(half[: half.rindex(b"=") + 1] if name == "run.toml" else half)
    assert f"run/{name}" in palpate.refusal("report", "run")


def test_what_is_no_result_is_refused(palpate, run, tmp_path):
    (tmp_path / "empty").mkdir()
    assert "is not a folder of palpate train, run or study" in palpate.refusal("report", "empty")
    assert "is not a folder" in palpate.refusal("report", "missing")
    (tmp_path / "empty" / "study.toml").write_text("[study]")
    assert "without a finished condition" in palpate.refusal("report", "empty")
    (run / "report.html").write_text("mine")
    assert "was not made by palpate report" in palpate.refusal("report", "run")
    assert (run / "report.html").read_text() == "mine"
