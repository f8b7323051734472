"""A run opens its rig when it needs it, closes it on every way out, and leaves nothing behind where it is refused."""

import pytest

from palpate.adapters.experiments import Run, baseline
from palpate.adapters.log import read_log
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.errors import ConfigurationError, DeviceError, LifecycleError, OutputError
from palpate.core.ports import Life
from tests.unit.adapters.samples import QUICK


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


def test_what_is_kept_is_in_the_folder_and_only_there(tmp_path):
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


def test_a_policy_object_runs_and_is_recorded_by_its_name(tmp_path):
    walk = baseline("random", QUICK, tuple)
    with pytest.raises(ConfigurationError, match="jobs = 2"):
        Run(QUICK).evaluate(1, walk, jobs=2)
    found = Run(QUICK).evaluate(1, walk, tmp_path / "run")
    assert read_log(found.logs[0]).start.policy == type(walk).__name__
    assert found.summary["policy"] == type(walk).__name__


def test_a_refused_run_leaves_no_folder_and_a_failed_one_a_closed_rig(tmp_path, monkeypatch):
    rigs = Rigs()
    run = Run(QUICK, make_rig=rigs)
    with pytest.raises(ConfigurationError, match=r"policy = 'nowhere\.json'"):
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
