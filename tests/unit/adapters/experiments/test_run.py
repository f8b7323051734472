"""A run opens its rig when it needs it and closes it on every way out; its folder reads back and loses nothing."""

import csv

import pytest

from palpate.adapters.experiments import Run, baseline
from palpate.adapters.experiments.results import RunFolder, TrialRow
from palpate.adapters.log import read_log
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import ConfigurationError, DeviceError, LifecycleError, OutputError
from palpate.core.ports import Life
from tests.unit.adapters.samples import QUICK, scored_trial


class Rigs:
    """Makes simulated rigs, and keeps them."""

    def __init__(self):
        self.made = []

    def __call__(self, config, ready):
        self.made.append(SimulatedRig(config, ready))
        return self.made[-1]

    @property
    def closed(self):
        return [rig.ports.arm.life is Life.CLOSED for rig in self.made]


def test_each_call_has_a_rig_of_its_own_and_a_block_has_one(tmp_path):
    rigs = Rigs()
    run = Run(QUICK, policy="torque", make_rig=rigs)
    with pytest.raises(LifecycleError, match="use it in a with block"):
        run.rig  # noqa: B018
    apart = [run.evaluate(1).rows, run.evaluate(1, out=tmp_path / "run").rows]
    assert rigs.closed == [True, True]
    assert apart[0] == apart[1]
    with run:
        assert len(rigs.made) == 2
        run.trial()
        run.trial("random", 1)
        assert rigs.closed == [True, True, False]
    assert rigs.closed == [True] * 3


def test_results_are_in_the_folder_and_only_there(tmp_path):
    run = Run(QUICK)
    trained = run.train(2, tmp_path / "trained")
    found = run.evaluate(1, out=tmp_path / "run")
    # What was trained is what is evaluated.
    assert found.policy.read_bytes() == trained.policy.read_bytes()
    assert [read_log(path).start.command for path in (*trained.logs, *found.logs)] == ["train", "train", "run"]
    resumed = Run(QUICK).train(3, tmp_path / "trained", resume=True)
    assert [row.trial for row in resumed.rows] == [0, 1, 2]
    with pytest.raises(LifecycleError, match="name a folder"):
        run.evaluate(1).logs  # noqa: B018


def test_policy_object_runs_and_is_recorded_by_its_name(tmp_path):
    walk = baseline("random", QUICK, tuple)
    with pytest.raises(ConfigurationError, match="jobs must be 1 on a rig, with a live view or with a policy object"):
        Run(QUICK).evaluate(1, walk, jobs=2)
    found = Run(QUICK).evaluate(1, walk, tmp_path / "run")
    assert read_log(found.logs[0]).start.policy == type(walk).__name__
    assert found.summary["policy"] == type(walk).__name__


def test_refused_run_leaves_no_folder_and_a_failed_one_a_closed_rig(tmp_path, monkeypatch):
    rigs = Rigs()
    run = Run(QUICK, make_rig=rigs)
    with pytest.raises(ConfigurationError, match=r"policy = 'nowhere\.json': no such file"):
        run.evaluate(1, "nowhere.json", tmp_path / "run")
    assert rigs.made == []

    def broken(self):
        raise DeviceError("arm", "no answer")

    with monkeypatch.context() as cable:
        cable.setattr(SimulatedRig, "__enter__", broken)
        for call in (lambda: run.evaluate(1, "torque", tmp_path / "run"), lambda: run.train(1, tmp_path / "run")):
            with pytest.raises(DeviceError, match="no answer"):
                call()
    assert not (tmp_path / "run").exists()
    with monkeypatch.context() as cable:
        cable.setattr(SimulatedRig, "prepare", lambda self, trial: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            run.evaluate(1, "torque", tmp_path / "run")
    assert rigs.closed[-1]
    with pytest.raises(OutputError, match="already holds a run"):
        run.evaluate(1, "torque", tmp_path / "run")


@pytest.fixture
def folder(tmp_path):
    made = RunFolder(tmp_path / "runs" / "one")
    made.create()
    return made


def content(folder):
    return {path.name: path.read_bytes() for path in folder.path.iterdir()}


def test_trial_in_the_units_of_its_columns():
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
def test_line_that_was_cut_short_is_dropped(folder, remains):
    folder.append_trial(scored_trial(0))
    before = content(folder)
    for name in ("trials.csv", "decisions.csv"):
        with (folder.path / name).open("a") as stream:
            stream.write(remains)
    folder.truncate(20)
    assert content(folder) == before
