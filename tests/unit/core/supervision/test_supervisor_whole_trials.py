"""Whole trials over bare ports: a clean one is left alone, and a bad one ends with the peg out of the hole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import pytest

from palpate.core.control_loop import next_slot, tick_time_ns
from palpate.core.insertion.expectation import Expectation, Supervised, TripReason
from palpate.core.insertion.task import InsertionTask
from palpate.core.insertion.trial import Outcome, Phase, TrialSetup
from palpate.core.ports.values import AppliedCommand, CommandReason, Snapshot, Validity, WrenchSample
from palpate.core.supervision.config import SupervisionConfig
from palpate.core.supervision.supervisor import Guard, Supervisor
from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task
from tests.unit.core.supervision.bench import supervisor

HOLE = Pit(1.2e-3, -0.7e-3)
SETUP = TrialSetup(0, 1, (-1e-3, 1e-3))
FREE = (Phase.TRANSFER, Phase.SETTLE)


def expectation_of(task: InsertionTask) -> Expectation:
    area = task._area if task.phase is Phase.EXPLORE else None
    return Expectation(task.phase not in FREE, task._measurement._bias if task._tared else None, area)  # type: ignore[arg-type]


@dataclass
class Trial:
    """One trial under supervision, and all that the supervisor saw and said."""

    world: FakeWorld
    supervisor: Supervisor = field(default_factory=supervisor)
    on_snapshot: Callable[[Snapshot], Snapshot] = lambda snapshot: snapshot
    snapshots: list[Snapshot] = field(default_factory=list)
    results: list[Supervised] = field(default_factory=list)
    tips_z_m: list[float] = field(default_factory=list)

    def run(self) -> InsertionTask:
        ports, task, guard = self.world.ports, build_task(FollowTorque()), self.supervisor
        applied: AppliedCommand | None = None
        slot = 0
        with self.world:
            task.begin(SETUP)
            guard.begin()
            start_ns = ports.clock.now_ns()
            while guard.retracting or not (task.done or guard.trip):
                ports.clock.sleep_until(tick_time_ns(start_ns, slot))
                now = ports.clock.now_ns()
                read, joints = ports.force_sensor.read(), ports.joint_encoder.read()
                seen = self.on_snapshot(Snapshot(len(self.snapshots), now, read, joints, applied))
                if guard.retracting:
                    done = guard.retreat(seen)
                else:
                    asked = task.step(seen)
                    done = guard.check(seen, asked, expectation_of(task), task._measurement.position_m)
                applied = done.applied(ports.arm.send(done.command))
                self.snapshots.append(seen)
                self.results.append(done)
                self.tips_z_m.append(self.world.tip_m[2])
                slot = next_slot(start_ns, slot, now)
            ports.clock.advance(1)
            self.world.load()
            self.tips_z_m.append(self.world.tip_m[2])
        return task


def test_a_clean_trial_is_left_alone() -> None:
    trial = Trial(FakeWorld(HOLE))
    task = trial.run()
    assert task.report.outcome is Outcome.INSERTED
    assert trial.supervisor.trip is None
    assert [done for done in trial.results if done.intervention is not None] == []
    assert task.report.clamped_ticks == 0


def test_a_trial_that_begins_in_the_hole_is_left_alone() -> None:
    trial = Trial(FakeWorld(Pit(0.0, 0.0), start_m=(0.0, 0.0, 8e-3)))
    task = trial.run()
    assert trial.supervisor.trip is None
    assert task.report.outcome is not None


def test_a_blow_while_exploring_leads_the_peg_off_the_plate() -> None:
    def struck(snapshot: Snapshot) -> Snapshot:
        x, y, z = snapshot.wrench.force_N
        hit = replace(snapshot.wrench, force_N=(x, y + 22.0, z))
        return replace(snapshot, wrench=hit) if snapshot.tick == 140 else snapshot

    trial = Trial(FakeWorld(HOLE), on_snapshot=struck)
    trial.run()
    trip = trial.supervisor.trip
    assert trip is not None
    assert (trip.reason, trip.tick) == (TripReason.FORCE_RATE, 140)
    tips = trial.tips_z_m
    assert tips[-1] == pytest.approx(tips[141] - 15e-3, abs=3e-4)
    assert all(later <= before + 1e-9 for before, later in pairwise(tips[141:]))
    assert trial.supervisor.state is Guard.TRIPPED_HOLDING


def test_an_obstacle_on_the_way_to_the_start_is_noticed() -> None:
    def touched(snapshot: Snapshot) -> Snapshot:
        x, y, z = snapshot.wrench.force_N
        return replace(snapshot, wrench=replace(snapshot.wrench, force_N=(x + 0.5 * snapshot.tick, y, z)))

    trial = Trial(FakeWorld(HOLE), on_snapshot=touched)
    trial.run()
    assert trial.supervisor.trip is not None
    assert (trial.supervisor.trip.reason, trial.supervisor.trip.tick) == (TripReason.UNEXPECTED_CONTACT, 7)


def test_a_silent_sensor_trips_on_the_tick_on_which_the_task_ends() -> None:
    world = FakeWorld(HOLE)
    world.spoil = lambda sample: _stale(sample) if sample.sequence > 200 else sample
    trial = Trial(world)
    task = trial.run()
    assert task.report.outcome is Outcome.SENSOR_FAULT
    assert trial.supervisor.trip is not None
    assert trial.supervisor.trip.reason is TripReason.SAMPLE_INVALID
    assert trial.supervisor.trip.tick == task.report.ticks - 1
    assert trial.tips_z_m[-1] < trial.tips_z_m[task.report.ticks] - 14e-3  # led back, not left where it pressed


def test_recorded_snapshots_answer_whether_another_limit_would_have_tripped() -> None:
    trial = Trial(FakeWorld(HOLE))
    task = trial.run()
    peak = task.report.peak_force_N
    for limit, trips in ((peak + 0.01, False), (peak - 0.01, True)):
        guard = supervisor(SupervisionConfig(max_force_N=limit))
        guard.begin()
        again, expected = build_task(FollowTorque()), trial.results
        again.begin(SETUP)
        for snapshot, result in zip(trial.snapshots, expected, strict=True):
            asked = again.step(snapshot)
            done = guard.check(snapshot, asked, expectation_of(again), again._measurement.position_m)
            if guard.trip is not None:
                break
            assert done == result
        assert (guard.trip is not None) is trips
        if guard.trip is not None:
            assert guard.trip.reason is TripReason.FORCE_LIMIT
            assert limit < guard.trip.value <= peak * (1 + 1e-9)


def test_an_arm_slower_than_asked_is_no_reason_to_trip() -> None:
    world = FakeWorld(HOLE)
    world.arm._max_step_rad = 4e-4
    trial = Trial(world)
    task = trial.run()
    assert trial.supervisor.trip is None
    assert task.report.outcome is Outcome.INSERTED
    assert any(s.applied is not None and s.applied.reason is CommandReason.VELOCITY_LIMIT for s in trial.snapshots)


def _stale(sample: WrenchSample) -> WrenchSample:
    return replace(sample, validity=Validity.STALE)
