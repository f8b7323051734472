"""Recording the trials of a run: it changes nothing, equal runs give equal logs, and logs hold the rig's facts."""

import hashlib
import os
from contextlib import nullcontext

import pytest

from palpate.adapters.config.run import RecordingConfig
from palpate.adapters.experiments.build import build_perception, build_task
from palpate.adapters.experiments.policies import baseline, learning_policy
from palpate.adapters.experiments.results import RunFolder
from palpate.adapters.experiments.training import Trainer
from palpate.adapters.experiments.trial import run_scored_trial
from palpate.adapters.experiments.trials import Recording
from palpate.adapters.log import TrialRecorder, recorded_sensor, set_aside, source_sha256
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.errors import ConfigurationError, DeviceError
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.log.test_recorder import log_of
from tests.unit.adapters.samples import QUICK, ready_pose

FILES = ("trials.csv", "decisions.csv", "checkpoint.json", "policy.json")


def trained(path, recording):
    """Two recorded trials; what they leave."""
    folder, perception = RunFolder(path), build_perception(QUICK)
    folder.create()
    recorder = TrialRecorder.into(path / "logs", recording)
    with SimulatedRig(QUICK, ready_pose()) as rig:
        policy = learning_policy(QUICK, perception)
        with recorder or nullcontext():
            trainer = Trainer(QUICK, folder, ready_pose(), rig, perception, policy, recording=Recording(recorder))
            trainer.train(2, lambda scored: None)
        assert Recording(recorder).losses == []
        trainer.save_policy()
    logs = path / "logs"
    names = sorted(p.name for p in logs.iterdir()) if logs.exists() else []
    return {name: (path / name).read_bytes() for name in FILES} | {n: (logs / n).read_bytes() for n in names}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs")
    settings = [RecordingConfig(), RecordingConfig(on_loss="stop"), RecordingConfig(enabled=False)]
    return [trained(path / str(k), each) for k, each in enumerate(settings)]


def test_recording_changes_no_result(runs):
    assert {name: runs[0][name] for name in FILES} == runs[2]


def test_digest_of_source_takes_each_file_by_name_once_from_the_first_folder_that_has_it(tmp_path):
    for name in ("first/z.py", "first/notes.txt", "second/within/a.py", "second/z.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    whole = b"within/a.py\0second/within/a.py" + b"z.py\0first/z.py"
    found = source_sha256([str(tmp_path / "first"), str(tmp_path / "second")])
    assert found == hashlib.sha256(whole).hexdigest()


def test_equal_runs_give_equal_logs(runs):
    assert runs[0] == runs[1]
    assert sorted(set(runs[0]) - set(FILES)) == ["trial-00000.mcap", "trial-00001.mcap"]


class Setting:
    """A rig and a task under a recorder whose sink is given."""

    def __init__(self, path, sink, config=None):
        self.sink = sink
        self.recorder = TrialRecorder(sink, path / "logs", config or RecordingConfig())

    def __enter__(self):
        self.rig = SimulatedRig(QUICK, ready_pose())
        self.rig.__enter__()
        self.recorder.__enter__()
        perception = build_perception(QUICK)
        self.policy = baseline("torque", QUICK, lambda: self.rig.truth().hole_in_task_m)
        self.task = build_task(QUICK, ready_pose(), perception, self.policy)
        self.recorder.of("run", QUICK, ready_pose(), self.task, perception, self.policy, name="torque")
        return self

    def __exit__(self, *_):
        self.recorder.__exit__(None, None, None)
        self.rig.__exit__(None, None, None)

    def run(self, trial=0):
        run_scored_trial(QUICK, self.rig, self.task, trial, self.recorder)

    def log(self):
        return log_of(self.sink.logs[-1])


@pytest.fixture
def setting(tmp_path):
    with Setting(tmp_path, MemorySink()) as made:
        yield made


def spoil(setting, at_read, error):
    """The sensor fails in mid-trial."""
    read, reads = setting.rig.ports.force_sensor.read, iter(range(at_read))

    def failing():
        if next(reads, None) is None:
            raise error
        return read()

    setting.rig._sensor.read = failing


@pytest.mark.parametrize("error", [DeviceError("sensor", "gone"), ZeroDivisionError("oops")])
def test_end_of_a_trial_that_an_error_ends_says_so(setting, error):
    spoil(setting, 25, error)
    with pytest.raises(type(error)):
        setting.run()
    log = setting.log()
    assert [record.tick for record in log.records()] == list(range(26))
    assert log.calls[-1].call == "stop"
    assert (log.end.error, log.end.outcome, log.end.ticks) == (type(error).__name__, "", 25)


def test_trial_that_did_not_begin_is_not_taken_for_the_one_before(setting, monkeypatch):
    setting.run()
    events = len(setting.log().events)
    assert events > 0

    def refuse(setup):
        raise ValueError("not today")

    monkeypatch.setattr(setting.task, "begin", refuse)
    with pytest.raises(ValueError, match="not today"):
        setting.run(1)
    log = setting.log()
    assert log.start.trial == 1
    assert (log.events, log.decisions, log.ticks) == ([], [], [])
    assert (log.end.outcome, log.end.ticks, log.end.error) == ("", 0, "ValueError")


def test_logs_of_trials_that_run_again_are_set_aside(tmp_path):
    names = ("trial-00000.mcap", "trial-00001.mcap", "trial-00002.mcap", "trial-x.mcap", "notes.txt")
    for name in names:
        (tmp_path / name).write_text(name)
    first = lambda: [p.name for p in set_aside(tmp_path, 1)]  # noqa: E731
    assert first() == ["trial-00001.mcap.cut-short-1", "trial-00002.mcap.cut-short-1"]
    (tmp_path / "trial-00001.mcap").write_text("again")
    assert first() == ["trial-00001.mcap.cut-short-2"]
    assert (tmp_path / "trial-00001.mcap.cut-short-1").read_text() == "trial-00001.mcap"
    assert (tmp_path / "trial-00000.mcap").exists()
    assert len(os.listdir(tmp_path)) == 6


@pytest.mark.parametrize(
    "facts", ["null", "3", "{}", '{"noise_N": -1, "noise_Nm": 0, "range_N": [1], "range_Nm": [1]}']
)
def test_altered_facts_of_the_force_sensor_are_refused(facts):
    with pytest.raises(ConfigurationError):
        recorded_sensor(f'{{"force_sensor_facts": {facts}}}')
