"""The folder of a study: what it holds, who writes it, and what of it is run again."""

import csv
import json

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from palpate.adapters.config import RunConfig, configured
from palpate.adapters.experiments.study import Condition, Study, StudyFolder, make
from palpate.adapters.experiments.study.document import _one_thread
from palpate.core.errors import OutputError, PalpateError

TEXT = """[study]
trials = 3
seeds = [0, 1]
policies = ["torque"]
[[grid]]
task.step_mm = [0.5]
[[grid]]
arm = ["ur5"]
"""


class Held:
    """A folder with a study in it, of which some conditions are finished."""

    def __init__(self, path, text=TEXT):
        self.file = path / "study.toml"
        self.file.write_text(text)
        self.study, self.folder = Study.read(self.file), StudyFolder(path / "out")
        self.conditions = list(self.study.conditions())

    def put(self, condition, figures):
        path = self.folder.conditions / condition.name
        path.mkdir(parents=True)
        (path / "run.toml").write_text(condition.record())
        (path / "summary.json").write_text(json.dumps(figures))

    def missing(self):
        with self.folder.writing(self.file, "", self.conditions) as missing:
            return missing


@pytest.fixture
def held(tmp_path):
    held = Held(tmp_path)
    assert held.missing() == held.conditions
    held.put(held.conditions[1], {"success": 1.0})
    return held


def test_larger_study_continues(held, tmp_path):
    larger = Held(tmp_path, TEXT.replace("[0, 1]", "[7, 1, 0]"))
    names = {each.name for each in larger.missing()}
    assert names == {each.name for each in larger.conditions} - {held.conditions[1].name}


@pytest.mark.parametrize(("old", "new"), [("trials = 3", "trials = 4"), ("[[grid]]", "[base]\narm = 'ur3'\n[[grid]]")])
def test_study_run_with_other_settings_is_refused_and_left(held, tmp_path, old, new):
    other = Held(tmp_path, TEXT.replace(old, new, 1))
    with pytest.raises(OutputError, match=r"was run with other settings or versions, not (trials = 4|arm = \"ur3\")"):
        other.missing()
    assert (held.folder.path / "study.toml").read_text() == TEXT


def test_two_studies_at_once_and_other_folders_are_refused(held, tmp_path):
    with held.folder.writing(held.file, "", held.conditions):
        with pytest.raises(OutputError, match="is being written by process"):
            held.missing()
    held.folder = StudyFolder(held.folder.conditions)
    with pytest.raises(OutputError, match="holds something already, and no study"):
        held.missing()


def test_leftovers_of_dead_workers_are_removed(held):
    (held.folder.conditions / f".{held.conditions[0].name}.17.part").mkdir()
    held.missing()
    assert [path.name for path in held.folder.conditions.iterdir()] == [held.conditions[1].name]


def test_table_has_a_line_for_each_finished_condition_in_the_order_of_the_study(held):
    held.put(held.conditions[3], {"outcomes": {"inserted": 2}, "success_95": [0.1, 0.9], "policy": "x"})
    held.put(held.conditions[0], {"outcomes": {"time limit": 1}, "learning": {"speed_up": 3.0}})
    assert held.folder.write_table(held.study, held.conditions) == 3
    with (held.folder.path / "summary.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["condition"] for row in rows] == [held.conditions[n].name for n in (0, 1, 3)]
    assert list(rows[0]) == [
        "condition", "task.step_mm", "arm", "policy", "seed", "outcomes.time limit", "outcomes.inserted",
        "learning.speed_up", "success", "success_95_low", "success_95_high",
    ]  # fmt: skip
    assert list(rows[2].values())[1:] == ["0.7", "ur5", "torque", "1", "0", "2", "", "", "0.1", "0.9"]


def condition(policy, **fields):
    table = {"time_limit_s": 0.1, **fields}
    return Condition("it", fields, policy, configured(settings={"task": table, "recording": {"enabled": False}}), 1)


def test_failed_condition_leaves_nothing(tmp_path):
    with pytest.raises(PalpateError, match="place"):
        make(condition("torque", goal={"x_mm": 1900.0}), tmp_path)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="all workers need the folder"):
        make(condition("torque"), tmp_path / "elsewhere")


def test_of_two_that_make_the_same_condition_the_first_one_stays(tmp_path):
    (tmp_path / "it").mkdir()
    (tmp_path / "it" / "note").touch()
    with pytest.raises(OutputError, match="holds something already"):
        make(condition("torque"), tmp_path)
    (tmp_path / "it" / "summary.json").write_text("first")
    make(condition("torque"), tmp_path)
    assert (tmp_path / "it" / "summary.json").read_text() == "first"


def test_libraries_keep_to_one_thread():
    with threadpool_limits(2), _one_thread(RunConfig()):
        assert {library["num_threads"] for library in threadpool_info()} == {1}
