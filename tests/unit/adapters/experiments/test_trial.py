"""Trials follow from seed and number alone, the truth scores them; after a trip nothing moves; dry trials."""

import json
import re
from dataclasses import replace

import pytest

from palpate.adapters.config import scenario
from palpate.adapters.config.run import RunConfig
from palpate.adapters.experiments import (
    NOT_RECORDED,
    ChosenPolicy,
    Recording,
    baseline,
    build_perception,
    dry_trial,
    fit_of,
    learning_policy,
    loaded_policy,
    run_scored_trial,
    trial_setup,
    truth_fields,
)
from palpate.adapters.experiments import trial as experiment
from palpate.adapters.experiments.evaluation import warm_up
from palpate.adapters.experiments.policies import perception_settings
from palpate.adapters.hardware.rig import NoArm
from palpate.adapters.log import TrialRecorder, describe, info_of, processor, read_log, recorded_sensor
from palpate.adapters.mujoco import SimulatedRig
from palpate.adapters.replay.batch import replay_file
from palpate.adapters.replay.engine import Verdict
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.errors import ConfigurationError, DeviceError, FaultLatchedError
from palpate.core.policy import document_of
from palpate.core.ports import FaultLatch, GroundTruth
from palpate.core.tasks.insertion.kind import INSERTION
from palpate.core.trial import Outcome
from palpate.simulation.work_cell import CellConfig
from tests.support.faults import FaultPlan, faulty
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.samples import QUICK, ready_pose, run_policy, scored_trial


def test_a_setup_depends_on_seed_and_number_alone():
    config = RunConfig(seed=4)
    assert trial_setup(config, 3) == trial_setup(replace(config, arm="ur5"), 3)
    starts = {trial_setup(RunConfig(seed=seed), k).start_m for seed in range(4) for k in range(4)}
    assert len(starts) == 16
    assert (trial_setup(config, 3).index, trial_setup(config, 3).seed) == (3, 4)


@pytest.mark.parametrize("trial", [-1, 1.5, 2**70])
def test_a_trial_that_has_no_number_leaves_the_rig_as_it_is(trial):
    with pytest.raises(ConfigurationError, match=r"trial must be a whole number from 0"):
        run_scored_trial(RunConfig(), None, None, trial)


class StandIn:
    """A rig about which only the truth is known."""

    ports = None
    simulated = True

    def __init__(self, truth):
        self._truth, self.latch = truth, FaultLatch()
        self.prepared = []

    def prepare(self, trial):
        self.prepared.append(trial)

    def truth(self):
        return self._truth

    def stopped_by(self):
        return ""


@pytest.mark.parametrize(
    ("outcome", "aside_m", "depth_m", "false"),
    [
        (Outcome.INSERTED, 0.0, 0.00981, False),
        (Outcome.INSERTED, 0.0, 0.00979, True),
        (Outcome.INSERTED, 0.0012, 0.01, True),  # beside the plate
        (Outcome.WEDGED, 0.0, 0.005, False),
    ],
)
def test_a_false_success_is_a_peg_called_inserted_that_is_not(outcome, aside_m, depth_m, false):
    report = replace(scored_trial(5).report, outcome=outcome)
    truth = GroundTruth((0.0, 0.0, 0.0), (aside_m, 0.0, depth_m), depth_m, 5.0)
    assert INSERTION.untrue(RunConfig().task, report, truth, fit_of(RunConfig())) is false


@pytest.mark.parametrize(
    ("outcome", "depth_m", "peak_N", "success"),
    [
        (Outcome.INSERTED, 0.01, 29.99, True),
        (Outcome.INSERTED, 0.00996, 5.0, True),
        (Outcome.INSERTED, 0.00994, 5.0, False),  # the core believes so, the peg is not there
        (Outcome.INSERTED, 0.01, 30.0, False),  # a peak between two samples
        (Outcome.TIME_LIMIT, 0.01, 5.0, False),
        (Outcome.WEDGED, 0.01, 5.0, False),
    ],
)
def test_success_is_full_depth_within_the_force_limit(monkeypatch, outcome, depth_m, peak_N, success):
    report = replace(scored_trial(5).report, outcome=outcome)
    monkeypatch.setattr(experiment, "run_trial", lambda *_: report)
    rig = StandIn(GroundTruth((0.0, 0.0, 0.0), (0.0, 0.0, depth_m), depth_m, peak_N))
    task = None
    scored = run_scored_trial(RunConfig(), rig, task, 5)
    assert scored.success is success
    assert rig.prepared == [5]


@pytest.mark.parametrize(("tilt_mrad", "depth_m", "success"), [(5.0, 0.00993, True), (5.0, 0.00986, False)])
def test_a_leaning_pegs_centre_stands_above_its_edge(tilt_mrad, depth_m, success):
    config = RunConfig(cell=CellConfig(tilt_mrad=tilt_mrad))
    report = replace(scored_trial(5).report, outcome=Outcome.INSERTED)
    truth = GroundTruth((0.0, 0.0, 0.0), (0.0, 0.0, depth_m), depth_m, 5.0)
    assert experiment.score(config, report, truth).success is success


def test_where_nobody_knows_the_truth_a_log_holds_none():
    scored = replace(scored_trial(0), truth=None)
    assert truth_fields(scored) == {}
    assert truth_fields(scored_trial(0))["success"] is True


@pytest.mark.parametrize(
    ("broken", "cause"),
    [
        (None, r"FORCE_LIMIT: force \d\.\d+ N, limit 5\.5 N"),
        (FaultPlan("disconnect", "force_sensor", 60), "force_sensor: does not answer"),
        (FaultPlan("disconnect", "arm", 60), "arm: does not answer"),
    ],
)
def test_after_a_trip_or_a_device_s_error_nothing_moves_on_the_same_rig_until_it_is_acknowledged(
    tmp_path, broken, cause
):
    strict = replace(QUICK, supervision=replace(QUICK.supervision, max_force_N=5.5))

    def run(config, recording=NOT_RECORDED):
        walk = baseline("random", config, lambda: (0.0, 0.0))
        run_policy(config, rig, walk, 1, recording, name="random")

    with SimulatedRig(QUICK, ready_pose()) as rig:
        # As a rig of devices: in the simulator a trip is a result.
        rig.simulated, sound = False, rig.ports
        if broken is not None:
            rig.ports = faulty(sound, (broken,))
        with pytest.raises(DeviceError, match=cause):
            run(QUICK if broken else strict)
        rig.ports = sound
        for again in (strict, QUICK):
            with pytest.raises(FaultLatchedError, match=f"{cause}.*acknowledge it first"):
                run(again)
        rig.latch.acknowledge("Ada", "the limit was a joke")
        sink = MemorySink()
        with TrialRecorder(sink, tmp_path, QUICK.recording) as recorder:
            run(QUICK, Recording(recorder))
    (tmp_path / "log.mcap").write_bytes(sink.logs[0])
    log = read_log(tmp_path / "log.mcap")
    world = json.loads(log.start.world_json)
    (acknowledged,) = world["acknowledged"]
    assert (acknowledged["by"], acknowledged["reason"]) == ("Ada", "the limit was a joke")
    assert re.search(cause, acknowledged["cause"])
    assert describe(info_of(log)).count(f"Ada: the limit was a joke (after: {acknowledged['cause']})") == 1
    assert recorded_sensor(json.dumps(world)) == rig.sensor_facts


@pytest.mark.parametrize("learning", [True, False])
def test_a_policy_is_recorded_as_what_it_is(tmp_path, learning):
    perception = build_perception(QUICK)
    policy = learning_policy(QUICK, perception)
    if not learning:
        document = document_of(policy, created_with={}, perception=perception_settings(QUICK, perception))
        policy = loaded_policy(document, QUICK, perception, frozen=True)
    sink = MemorySink()
    with SimulatedRig(QUICK, ready_pose()) as rig, TrialRecorder(sink, tmp_path, QUICK.recording) as recorder:
        run_policy(QUICK, rig, policy, 1, Recording(recorder))
    (tmp_path / "log.mcap").write_bytes(sink.logs[0])
    assert read_log(tmp_path / "log.mcap").start.frozen is not learning
    assert replay_file(tmp_path / "log.mcap", Rebuilder()).verdict is Verdict.EQUAL


AWAY_RAD = (0.3, 1.0, -1.2, 0.1, 0.5, 0.2)


def dry_rig(q_rad, monkeypatch):
    config = scenario("paper")
    rig = SimulatedRig(config, ready_pose())
    rig.__enter__()
    rig.prepare(0)
    rig.cell.place(q_rad)
    monkeypatch.setattr(rig, "prepare", lambda trial: None)
    monkeypatch.setattr(rig.cell, "command", lambda q: pytest.fail("the arm was commanded"))
    rig.ports = replace(rig.ports, arm=NoArm("none"))
    return rig, config


@pytest.mark.parametrize("q_rad", [tuple(ready_pose().q_rad.tolist()), AWAY_RAD], ids=["ready", "anywhere"])
def test_the_arm_stays_where_it_is_and_the_task_decides(q_rad, monkeypatch):
    rig, config = dry_rig(q_rad, monkeypatch)
    scored, lines = dry_trial(ChosenPolicy("torque", config), config, ready_pose(), rig)
    assert [scored.report.outcome, scored.trip] == [Outcome.INTERRUPTED, ""]
    assert "tare" in [each.name for each in scored.report.events]
    assert rig.ports.joint_encoder.read().position_rad == pytest.approx(q_rad, abs=2e-3)
    force, tip, way, requested = lines
    assert "(stated 0.1 N)" in force
    assert tip.startswith("tip by the model of zebra-zero: (")
    assert "go to the ready pose, joints by up to" in way
    # By whatever pose it begins: straight along the tool, at the speed of the approach.
    assert "along the tool and 0.00 mm across" in requested
    assert not requested.startswith("the task did not")


def test_a_dry_run_that_trips_ends(monkeypatch):
    rig, config = dry_rig(AWAY_RAD, monkeypatch)
    measure, loads = rig.cell.measure_wrench, iter(range(1000))
    monkeypatch.setattr(rig.cell, "measure_wrench", lambda: [value + 60.0 * (next(loads) > 60) for value in measure()])
    scored, lines = dry_trial(ChosenPolicy("torque", config), config, ready_pose(), rig)
    assert scored.trip
    assert lines


def test_warm_up_goes_through_every_phase_and_finds_out_what_logs_state():
    """In the first trial, that kept every other thread of the program from running for half a second."""
    processor.cache_clear()
    report = warm_up(scenario("paper"), ready_pose())
    assert processor.cache_info().currsize == 1
    assert report.outcome is Outcome.INSERTED
    assert {event.detail for event in report.events if event.name == "phase"} >= {"transfer", "explore", "insert"}
