"""A policy at work on a rig, and what a trip means for whoever calls next."""

import json
import re
from dataclasses import replace

import pytest

from palpate.adapters.experiments import (
    NOT_RECORDED,
    Recording,
    baseline,
    build_perception,
    learning_policy,
    loaded_policy,
)
from palpate.adapters.experiments.policies import perception_settings
from palpate.adapters.log import TrialRecorder, describe, info_of, read_log, recorded_sensor
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.adapters.replay.batch import replay_file
from palpate.adapters.replay.engine import Verdict
from palpate.adapters.replay.rebuild import Rebuilder
from palpate.core.errors import DeviceError, FaultLatchedError
from palpate.core.policy import document_of
from tests.support.faults import FaultPlan, faulty
from tests.support.memory_sink import MemorySink
from tests.unit.adapters.samples import QUICK, ready_pose, run_policy


@pytest.mark.parametrize(
    ("broken", "cause"),
    [
        (None, r"limit 5\.5 N"),
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
            with pytest.raises(FaultLatchedError, match=f"{cause}.*acknowledge it before going on"):
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
