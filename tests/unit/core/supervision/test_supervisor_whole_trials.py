"""Whole trials over bare ports: a clean one is left alone, and a bad one ends with the peg out of the hole."""

from dataclasses import replace
from itertools import pairwise

import pytest

from palpate.core.control_loop import run_trial
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import CommandReason, JointCommand, SensorFacts, Snapshot, Validity, Vector3, WrenchSample
from palpate.core.supervision import SupervisionConfig, Supervisor
from palpate.core.supervision.supervisor import Guard
from palpate.core.tasks.insertion import INSERTION
from palpate.core.trial import Expectation, Outcome, Supervised, TaskConfig, TrialSetup, TripReason
from tests.unit.core.fake_world import TOOL, FakeWorld, FollowTorque, Pit, build_task
from tests.unit.core.supervision.bench import supervisor

HOLE = Pit(1.2e-3, -0.7e-3)
SETUP = TrialSetup(0, 1, (-1e-3, 1e-3))


class Trial(Supervisor):
    """One trial under supervision, with all that the supervisor was given and gave back."""

    def __init__(self, world: FakeWorld) -> None:
        super().__init__(
            SupervisionConfig(),
            TaskConfig(),
            INSERTION.workspace(TaskConfig()),
            Kinematics(arm_named("zebra-zero"), TOOL),
            SensorFacts(0.0, 0.0),
            (1.0,) * 6,
        )
        self.world, self.task = world, build_task(FollowTorque())
        self.snapshots: list[Snapshot] = []
        self.results: list[Supervised] = []
        self.tips_z_m: list[float] = []
        with world:
            self.report = run_trial(self.task, world.ports, SETUP, self)
            world.clock.advance(1)
            world.load()
            self.tips_z_m.append(world.tip_m[2])

    def check(
        self,
        snapshot: Snapshot,
        asked: JointCommand,
        expectation: Expectation,
        tip_m: Vector3 | None = None,
        turned_rad: tuple[float, float] = (0.0, 0.0),
    ) -> Supervised:
        self.snapshots.append(snapshot)
        self.tips_z_m.append(self.world.tip_m[2])
        self.results.append(super().check(snapshot, asked, expectation, tip_m, turned_rad))
        return self.results[-1]

    def retreat(self, snapshot: Snapshot) -> Supervised:
        self.tips_z_m.append(self.world.tip_m[2])
        return super().retreat(snapshot)


def test_a_clean_trial_is_left_alone() -> None:
    trial = Trial(FakeWorld(HOLE))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.trip is None
    assert [done for done in trial.results if done.intervention is not None] == []
    assert trial.report.clamped_ticks == 0


def test_a_trial_that_begins_in_the_hole_is_left_alone() -> None:
    trial = Trial(FakeWorld(Pit(0.0, 0.0), start_m=(0.0, 0.0, 8e-3)))
    assert trial.trip is None
    assert trial.report.outcome is not None


def test_a_blow_while_exploring_leads_the_peg_off_the_plate() -> None:
    def struck(sample: WrenchSample) -> WrenchSample:
        x, y, z = sample.force_N
        return replace(sample, force_N=(x, y + 22.0, z)) if sample.sequence == 140 else sample

    world = FakeWorld(HOLE)
    world.spoil = struck
    trial = Trial(world)
    assert trial.report.outcome is Outcome.TRIPPED
    assert trial.trip is not None
    assert (trial.trip.reason, trial.trip.tick) == (TripReason.FORCE_RATE, 140)
    tips = trial.tips_z_m
    assert tips[-1] == pytest.approx(tips[141] - 15e-3, abs=3e-4)
    assert all(later <= before + 1e-9 for before, later in pairwise(tips[141:]))
    assert trial.state is Guard.TRIPPED_HOLDING


def test_an_obstacle_on_the_way_to_the_start_is_noticed() -> None:
    def touched(sample: WrenchSample) -> WrenchSample:
        x, y, z = sample.force_N
        return replace(sample, force_N=(x + 0.5 * sample.sequence, y, z))

    world = FakeWorld(HOLE)
    world.spoil = touched
    trial = Trial(world)
    assert trial.trip is not None
    assert (trial.trip.reason, trial.trip.tick) == (TripReason.UNEXPECTED_CONTACT, 7)


def test_a_silent_sensor_trips_on_the_tick_on_which_the_task_ends() -> None:
    world = FakeWorld(HOLE)
    world.spoil = lambda sample: replace(sample, validity=Validity.STALE) if sample.sequence > 200 else sample
    trial = Trial(world)
    assert trial.report.outcome is Outcome.SENSOR_FAULT
    assert trial.trip is not None
    assert trial.trip.reason is TripReason.SAMPLE_INVALID
    assert trial.trip.tick == trial.report.ticks - 1
    # Led back, not left where it pressed.
    assert trial.tips_z_m[-1] < trial.tips_z_m[trial.report.ticks] - 14e-3


def test_recorded_snapshots_answer_whether_another_limit_would_have_tripped() -> None:
    trial = Trial(FakeWorld(HOLE))
    peak = trial.report.peak_force_N
    for limit, trips in ((peak + 0.01, False), (peak - 0.01, True)):
        guard = supervisor(SupervisionConfig(max_force_N=limit))
        guard.begin()
        again = build_task(FollowTorque())
        again.begin(SETUP)
        for snapshot, result in zip(trial.snapshots, trial.results, strict=True):
            done = guard.check(snapshot, again.step(snapshot), again.expectation, again.tip_m)
            if guard.trip is not None:
                break
            assert done == result
        assert (guard.trip is not None) is trips
        if guard.trip is not None:
            assert guard.trip.reason is TripReason.FORCE_LIMIT
            told_N = float(guard.trip.text.split()[1])
            assert limit - 0.005 <= told_N <= peak + 0.005


def test_an_arm_slower_than_asked_is_no_reason_to_trip() -> None:
    world = FakeWorld(HOLE)
    world.arm._max_step_rad = 4e-4
    trial = Trial(world)
    assert trial.trip is None
    assert trial.report.outcome is Outcome.INSERTED
    assert any(s.applied is not None and s.applied.reason is CommandReason.VELOCITY_LIMIT for s in trial.snapshots)


def test_a_trip_in_the_tick_in_which_the_task_calls_the_peg_inserted_takes_that_back() -> None:
    last = Trial(FakeWorld(HOLE)).snapshots[-1].wrench.sequence

    def struck(sample: WrenchSample) -> WrenchSample:
        x, y, z = sample.force_N
        return replace(sample, force_N=(x + 25.0, y, z)) if sample.sequence == last else sample

    world = FakeWorld(HOLE)
    world.spoil = struck
    trial = Trial(world)
    assert trial.trip is not None
    assert (trial.trip.reason, trial.trip.tick) == (TripReason.FORCE_RATE, trial.snapshots[-1].tick)
    assert [event.name for event in trial.report.events][-2:] == ["end", "trip"]
    assert trial.report.outcome is Outcome.TRIPPED
