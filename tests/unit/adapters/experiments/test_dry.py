"""Dry trials: what they see and decide, over a simulated rig whose arm must not be commanded."""

from dataclasses import replace

import pytest

from palpate.adapters.config import scenario
from palpate.adapters.experiments import ChosenPolicy, dry_trial
from palpate.adapters.experiments.evaluation import warm_up
from palpate.adapters.hardware.rig import NoArm
from palpate.adapters.log import processor
from palpate.adapters.mujoco import SimulatedRig
from palpate.core.trial import Outcome
from tests.unit.adapters.samples import ready_pose

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
    force, tip, way, asked = lines
    assert "(stated 0.1 N)" in force
    assert tip.startswith("tip by the model of zebra-zero: (")
    assert "go to the ready pose, joints by up to" in way
    # By whatever pose it begins: straight along the tool, at the speed of the approach.
    assert "along the tool and 0.00 mm across" in asked
    assert not asked.startswith("the task did not")


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
