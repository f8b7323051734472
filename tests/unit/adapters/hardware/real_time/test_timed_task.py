"""Timing the core's parts and the ports changes nothing that a trial comes to."""

from __future__ import annotations

from palpate.adapters.hardware.real_time import Stopwatch, TickSection, timed, timed_parts
from palpate.core.control_loop import run_trial
from palpate.core.insertion.agent import Agent
from palpate.core.insertion.measurement import Measurement
from palpate.core.insertion.task import InsertionTask
from palpate.core.insertion.trial import Outcome, TrialReport, TrialSetup
from palpate.core.motion.tip_motion import TipMotion
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task

SETUP = TrialSetup(0, 1, (1e-3, 1e-3))


def parts(task: InsertionTask) -> tuple[Measurement, Agent, TipMotion]:
    return task._measurement, task._agent, task._motion


def run(stopwatch: Stopwatch | None) -> TrialReport:
    with FakeWorld(Pit(0.0, 0.0)) as world:
        task, ports = build_task(FollowTorque()), world.ports
        if stopwatch is not None:
            timed_parts(*parts(task), stopwatch)
            ports = timed(ports, stopwatch)
        return run_trial(task, ports, SETUP)


def test_a_timed_trial_is_the_same_trial_and_all_sections_are_there() -> None:
    stopwatch = Stopwatch()
    report = run(stopwatch)
    assert report.outcome is Outcome.INSERTED
    assert report == run(None)
    for section in (TickSection.PERCEIVE, TickSection.CONTROL, TickSection.SEND, TickSection.FORCE, TickSection.JOINTS):
        assert stopwatch.spread(section).count == report.ticks
    assert 0 < stopwatch.spread(TickSection.DECIDE).count < report.ticks


def test_only_the_parts_that_were_given_are_timed() -> None:
    stopwatch = Stopwatch()
    timed_parts(*parts(build_task(FollowTorque())), stopwatch)
    with FakeWorld(Pit(0.0, 0.0)) as world:
        run_trial(build_task(FollowTorque()), timed(world.ports, stopwatch), SETUP)
    assert stopwatch.spread(TickSection.PERCEIVE).count == 0
