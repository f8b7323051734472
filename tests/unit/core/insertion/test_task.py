"""The insertion task over bare ports, without a simulator: whole trials, and every way in which they end."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from math import hypot, inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palpate.core.control_loop import run_trial
from palpate.core.errors import ConfigurationError, DeviceError
from palpate.core.insertion.config import N_PER_KGF, ControlConfig, TaskConfig
from palpate.core.insertion.task import PERIOD_S, InsertionTask
from palpate.core.insertion.trial import Outcome, Phase, Purpose, TrialReport, TrialSetup, generator
from palpate.core.policy import ActionOutcome, Observation, Transition
from palpate.core.ports.values import (
    CommandReason,
    JointCommand,
    JointSample,
    Snapshot,
    Validity,
    Vector3,
    WrenchSample,
)
from tests.unit.core.fake_world import (
    ACTIONS,
    WEIGHT_AND_BIAS_N,
    WEIGHT_AND_BIAS_NM,
    FakeWorld,
    FollowTorque,
    Pit,
    Steps,
    build_task,
)

HOLE = Pit(1.2e-3, -0.7e-3)
FAR_AWAY = Pit(0.03, 0.03)
START = (-1.0e-3, 1.0e-3)
PRESS_N = 0.5 * N_PER_KGF
EAST = (0.5e-3, 0.0)


class Trial:
    """One trial, run to its end, with a look at every tick.

    Attributes:
        report: What the core says.
        snapshots, commands, phases, tips, forces: What happened, tick by tick; phases after the step, forces as the
            contact really was.
        world, policy, task: The parts.
    """

    def __init__(
        self,
        world: FakeWorld,
        policy: FollowTorque | None = None,
        start_m: tuple[float, float] = START,
        config: TaskConfig | None = None,
        *,
        on_step: Callable[[int, Snapshot], Snapshot] | None = None,
        task: InsertionTask | None = None,
        index: int = 0,
    ) -> None:
        self.world, self.policy = world, policy or FollowTorque()
        self.task = task or build_task(self.policy, config)
        self.snapshots: list[Snapshot] = []
        self.commands: list[JointCommand] = []
        self.phases: list[Phase] = []
        self.tips: list[Vector3] = []
        self.forces: list[Vector3] = []
        self._on_step = on_step
        self.begin, self.choose = self.task.begin, self.task.choose
        with world:
            run_trial(self, world.ports, TrialSetup(index, 1, start_m))  # type: ignore[arg-type]
            here = world.arm.position_rad()
            self.stopped = world.arm.send(JointCommand(here)).reason is CommandReason.STOPPED

    @property
    def report(self) -> TrialReport:
        return self.task.report

    def sense(self, snapshot: Snapshot) -> Observation | None:
        self.tips.append(self.world.tip_m)
        self.forces.append(self.world.force_N)
        seen = snapshot if self._on_step is None else self._on_step(snapshot.tick, snapshot)
        self.snapshots.append(seen)
        return self.task.sense(seen)

    def act(self) -> JointCommand:
        self.commands.append(self.task.act())
        self.phases.append(self.task.phase)
        return self.commands[-1]

    def events(self, name: str) -> list[Any]:
        return [event for event in self.report.events if event.name == name]

    def in_phase(self, phase: Phase) -> list[int]:
        """Ticks at whose beginning the task was in this phase."""
        return [tick for tick in range(1, len(self.phases)) if self.phases[tick - 1] is phase]


@pytest.fixture(scope="module")
def good() -> Trial:
    """A trial as it should be."""
    return Trial(FakeWorld(HOLE))


# A trial as it should be.


def test_a_trial_goes_through_its_phases_in_order(good: Trial) -> None:
    assert good.report.outcome is Outcome.INSERTED
    entered = [event.detail for event in good.events("phase")]
    assert entered == ["transfer", "settle", "approach", "explore", "insert"]
    order = list(Phase)
    positions = [order.index(phase) for phase in good.phases]
    assert positions == sorted(positions)
    assert good.phases[-1] is Phase.DONE
    assert Phase.DONE not in good.phases[:-1]
    assert good.events("end")[0].detail == "inserted: depth 10.000 mm"
    assert good.report.events[-1].name == "end"
    assert good.report.ticks == len(good.snapshots)
    assert good.stopped


def test_the_sensor_is_tared_once_at_rest_and_says_so(good: Trial) -> None:
    (tare,) = good.events("tare")
    (settle,) = [event for event in good.events("phase") if event.detail == "settle"]
    assert tare.tick - settle.tick == 56  # as many ticks of rest as of averaging
    numbers = [float(word) for word in tare.detail.replace(",", "").split() if word[-1].isdigit()]
    assert numbers == pytest.approx([*WEIGHT_AND_BIAS_N, *WEIGHT_AND_BIAS_NM], rel=1e-5)
    rest = good.snapshots[settle.tick + 1 : tare.tick + 1]
    still = np.ptp([snapshot.joints.position_rad for snapshot in rest], axis=0)
    assert still.max() < 1e-5
    assert all(good.forces[tick][2] == 0.0 for tick in range(tare.tick + 1))  # in free air


def test_the_start_is_where_the_setup_says(good: Trial) -> None:
    (tare,) = good.events("tare")
    assert good.tips[tare.tick] == pytest.approx((*START, -3e-3), abs=5e-6)


def test_the_approach_goes_straight_down_to_contact(good: Trial) -> None:
    (contact,) = good.events("contact")
    approach = good.in_phase(Phase.APPROACH)
    assert contact.tick == approach[-1]
    assert np.ptp([good.tips[tick][:2] for tick in approach], axis=0).max() < 1e-6
    speeds = np.diff([good.tips[tick][2] for tick in approach]) / PERIOD_S
    assert speeds.min() > 0.0
    assert speeds.max() == pytest.approx(PRESS_N / 400.0, rel=1e-3)
    # The reaction is above the threshold, and was not before: the filter needs a few ticks.
    assert good.forces[contact.tick][2] < -0.1 * N_PER_KGF
    assert good.forces[contact.tick - 20][2] == 0.0
    assert contact.detail.startswith("surface at 0.000 mm")


def test_exploration_presses_steadily_and_acts_ten_times_a_second(good: Trial) -> None:
    ticks = [record.tick for record in good.report.decisions]
    (contact,) = good.events("contact")
    assert np.diff([contact.tick, *ticks]).tolist() == [14] * len(ticks)
    for tick in ticks[1:]:
        assert good.forces[tick][2] == pytest.approx(-PRESS_N, rel=0.05)
    steps = np.diff([good.tips[tick][:2] for tick in ticks], axis=0)
    assert np.hypot(*steps.T) == pytest.approx(np.full(len(steps), 0.5e-3), rel=0.02)


def test_the_peg_stays_where_it_landed_until_the_first_choice(good: Trial) -> None:
    (contact,) = good.events("contact")
    first = good.report.decisions[0].tick
    for tick in range(contact.tick, first + 1):
        assert good.tips[tick][:2] == pytest.approx(START, abs=1e-6)


def test_a_step_ends_where_the_reaction_is_lost(good: Trial) -> None:
    (lost,) = good.events("contact lost")
    threshold = -0.1 * N_PER_KGF
    pressed = [tick for tick in good.in_phase(Phase.EXPLORE) if good.forces[tick][2] < threshold]
    assert lost.tick - pressed[-1] == 4  # unfiltered samples in a row, the fourth decides
    still = [good.tips[tick][:2] for tick in range(pressed[-1] + 2, lost.tick + 1)]
    assert np.ptp(still, axis=0).max() < 1e-7


def test_a_step_is_slow_and_steady_and_over_before_the_torque_is_read(good: Trial) -> None:
    for record in good.report.decisions[1:]:
        way = np.diff([good.tips[tick][:2] for tick in range(record.tick - 14, record.tick + 1)], axis=0)
        moved = np.hypot(*way.T)
        assert moved.max() < 0.1 * 0.5e-3
        assert moved[-1] < 0.02 * 0.5e-3


def test_the_torque_leads_to_the_hole(good: Trial) -> None:
    (contact,), (lost,) = good.events("contact"), good.events("contact lost")
    assert good.report.exploration_time_s == pytest.approx((lost.tick - contact.tick) * PERIOD_S)
    distance = hypot(START[0] - HOLE.x_m, START[1] - HOLE.y_m)
    assert good.report.actions == len(good.report.decisions)
    assert 0.5e-3 * good.report.actions < distance + 0.5e-3
    assert good.events("hole")[0].detail == f"found after {good.report.exploration_time_s:.3f} s"
    assert {record.state for record in good.report.decisions[1:]} == {"tx0 ty+"}


def test_the_policy_sees_the_cue_at_the_tip(good: Trial) -> None:
    for seen in good.policy.seen[1:]:
        x, y, _ = seen.position_m
        toward = np.array([HOLE.x_m - x, HOLE.y_m - y])
        cue = np.array([seen.torque_Nm[1], -seen.torque_Nm[0]])
        assert cue @ toward > 0.9 * np.linalg.norm(cue) * np.linalg.norm(toward)
        assert seen.force_N[2] == pytest.approx(-PRESS_N, rel=0.25)


def test_learning_ends_with_the_goal(good: Trial) -> None:
    learned = good.policy.learned
    states = [seen.state for seen in good.policy.seen]
    assert [t.state for t in learned] == states
    assert [t.next_state for t in learned] == [*states[1:], None]
    assert all(isinstance(t, Transition) and t.reinforcement == -1.0 for t in learned)
    assert [record.reinforcement for record in good.report.decisions] == [-1.0] * len(states)
    assert [record.action for record in good.report.decisions] == [ACTIONS[t.action_index].name for t in learned]


def test_the_peg_ends_at_the_bottom_of_the_hole(good: Trial) -> None:
    x, y, z = good.tips[-1]
    true_depth = z - 1e-3 * abs(good.forces[-1][2]) / 5.0  # the gripper's spring gives way
    assert (x, y) == pytest.approx((HOLE.x_m, HOLE.y_m), abs=1e-5)
    assert true_depth == pytest.approx(0.010, abs=1e-5)
    assert good.report.depth_m == pytest.approx(true_depth, abs=2e-5)


def test_the_lateral_force_in_the_hole_is_regulated_away(good: Trial) -> None:
    insertion = good.in_phase(Phase.INSERT)
    across = [hypot(*good.forces[tick][:2]) for tick in insertion]
    assert max(across) > 5.0  # the peg fell in beside the middle
    assert across[-1] < 0.1
    speeds = np.diff([good.tips[tick][:2] for tick in insertion], axis=0) / PERIOD_S
    assert np.hypot(*speeds.T).max() < 5.0e-3 * (1 + 1e-3)


def test_the_effort_of_each_action_is_what_was_measured() -> None:
    outcomes: list[ActionOutcome] = []

    def note(outcome: ActionOutcome) -> float:
        outcomes.append(outcome)
        return -1.0

    policy = FollowTorque()
    trial = Trial(FakeWorld(HOLE), policy, task=build_task(policy, reinforcement=note))
    assert len(outcomes) == trial.report.actions
    for outcome in outcomes[1:-1]:
        assert outcome.duration_s == pytest.approx(0.1)
        assert outcome.mean_force_N == pytest.approx(PRESS_N, rel=0.05)
        assert outcome.peak_force_N == pytest.approx(PRESS_N, rel=0.05)
        assert outcome.distance_m == pytest.approx(0.5e-3, rel=0.1)


def test_the_report_adds_up(good: Trial) -> None:
    norms = [float(np.linalg.norm(force)) for force in good.forces]
    assert good.report.peak_force_N == pytest.approx(max(norms), rel=1e-6)
    assert good.report.clamped_ticks == 0
    assert good.report.setup == TrialSetup(0, 1, START)
    assert good.report.temperature is None


def test_a_trial_does_not_depend_on_the_one_before(good: Trial) -> None:
    policy = FollowTorque()
    task = build_task(policy)
    Trial(FakeWorld(Pit(0.0, 0.0, depth_m=5e-3)), policy, (0.5e-3, 0.0), task=task)
    second = Trial(FakeWorld(HOLE), policy, task=task)
    assert second.commands == good.commands
    assert second.report == good.report


def test_the_policy_draws_from_the_stream_of_its_trial() -> None:
    begun: list[tuple[int, float]] = []

    class Drawing(FollowTorque):
        def begin_trial(self, trial: int, rng: np.random.Generator) -> None:
            begun.append((trial, rng.random()))

    build_task(Drawing()).begin(TrialSetup(17, 99, START))
    assert begun == [(17, generator(99, Purpose.POLICY, 17).random())]


# Other worlds.


@pytest.mark.parametrize("height_m", [-1.5e-3, -0.5e-3, 0.5e-3, 1.5e-3])
def test_depth_counts_from_the_surface_that_was_touched(height_m: float) -> None:
    trial = Trial(FakeWorld(HOLE, height_m=height_m))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)
    assert f"surface at {height_m * 1e3:.3f} mm" in trial.events("contact")[0].detail


def test_a_hole_right_below_the_start() -> None:
    trial = Trial(FakeWorld(Pit(*START)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.exploration_time_s == 0.0
    assert trial.report.actions == 0
    assert trial.policy.learned == []
    assert Phase.EXPLORE not in trial.phases
    assert trial.events("hole")[0].detail == "the approach went straight into it"
    assert trial.events("contact") == []
    assert trial.report.depth_m == pytest.approx(0.010, abs=5e-5)


def test_an_arm_that_stands_deep_is_lifted_straight_up_first() -> None:
    # As after a trial that ended in the hole.
    below = Pit(0.5e-3, 0.5e-3, depth_m=0.02)
    trial = Trial(FakeWorld(below, start_m=(0.5e-3, 0.5e-3, 9e-3)), start_m=(0.0, 2e-3))
    lift = trial.in_phase(Phase.LIFT)
    assert len(lift) > 60
    assert np.ptp([trial.tips[tick][:2] for tick in lift], axis=0).max() < 1e-6
    heights = np.array([trial.tips[tick][2] for tick in lift])
    assert (np.diff(heights) < 0.0).all()
    assert heights[-1] == pytest.approx(-3e-3, abs=1e-5)
    assert np.abs(np.diff(heights)).max() == pytest.approx(0.02 * PERIOD_S, rel=1e-3)
    assert trial.report.outcome is Outcome.INSERTED


def test_what_the_sensor_does_while_the_arm_comes_to_rest_is_not_tared_in() -> None:
    world = FakeWorld(HOLE)
    reads = iter(range(10_000))

    def ring(sample: WrenchSample) -> WrenchSample:
        # Until 26 ticks after the arm has arrived, as in the good trial.
        return replace(sample, force_N=_sum(sample.force_N, (3.0, 2.0, 1.0))) if next(reads) <= 16 + 26 else sample

    world.spoil = ring
    trial = Trial(world)
    assert trial.events("phase")[1].tick == 16
    numbers = [float(word) for word in trial.events("tare")[0].detail.split()[:3]]
    assert numbers == pytest.approx(WEIGHT_AND_BIAS_N, rel=1e-5)


def test_a_tilted_plate_is_not_taken_for_a_hole() -> None:
    world = FakeWorld(FAR_AWAY)
    world.slope = 0.05
    policy = Steps(displacements_m=[EAST] * 14)
    trial = Trial(world, policy, (-3e-3, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.tips[-1][0] > 3.4e-3  # more than 0.3 mm lower than where it began, as deep as a drop
    assert Phase.INSERT not in trial.phases


def test_a_dent_is_not_taken_for_the_surface() -> None:
    # Too shallow to lose contact; depth goes on counting from the plate round it.
    dent = Pit(0.5e-3, 0.0, depth_m=0.2e-3, walls=False)
    trial = Trial(FakeWorld(dent), Steps(displacements_m=[EAST]), (0.0, 0.0), TaskConfig(time_limit_s=2.0))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert Phase.INSERT not in trial.phases
    assert trial.report.depth_m == pytest.approx(0.2e-3, abs=2e-5)


def test_a_peg_that_sinks_against_friction_has_found_the_hole() -> None:
    # The wall goes on pushing back with more than the contact threshold.
    trial = Trial(FakeWorld(replace(HOLE, friction_N=2.0)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.events("contact lost") == []
    assert len(trial.events("sunk below the surface")) == 1
    assert trial.report.depth_m == pytest.approx(0.010, abs=2.5e-4)  # contact and depth: the tolerance is enough


def test_a_big_weight_is_no_contact_force() -> None:
    # 50 N are above the limit; they are there before the tare, and are gone with it.
    world = FakeWorld(HOLE)
    world.spoil = lambda sample: replace(sample, force_N=_sum(sample.force_N, (0.0, 0.0, 50.0)))
    trial = Trial(world)
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.peak_force_N < 30.0


def test_a_false_drop_goes_back_to_exploration() -> None:
    dent = Pit(1e-3, 0.0, depth_m=0.25e-3, walls=False)
    hole = Pit(3e-3, 0.0)
    config = TaskConfig(contact_kgf=0.45)
    policy = Steps(displacements_m=[EAST] * 9)
    trial = Trial(FakeWorld(dent, hole), policy, (0.0, 0.0), config)
    (drop,) = trial.events("false drop")
    assert float(drop.detail.split()[1]) == pytest.approx(0.25, abs=0.05)
    entered = [event.detail for event in trial.events("phase")][3:]
    assert entered == ["explore", "insert", "explore", "insert"]
    assert trial.report.outcome is Outcome.INSERTED
    first, second = trial.events("contact lost")
    (contact,) = trial.events("contact")
    assert trial.report.exploration_time_s == pytest.approx((second.tick - contact.tick) * PERIOD_S)
    assert drop.tick - first.tick > 70
    # No choice was made while the drop was looked into, and the steps went on where they had been.
    ticks = [record.tick for record in trial.report.decisions]
    assert not any(first.tick <= tick <= drop.tick for tick in ticks)
    assert 6 <= trial.report.actions <= 7


def test_a_false_drop_does_not_stop_the_clock() -> None:
    dent = Pit(1e-3, 0.0, depth_m=0.25e-3, walls=False)
    config = TaskConfig(contact_kgf=0.45, time_limit_s=2.5)
    trial = Trial(FakeWorld(dent), Steps(displacements_m=[EAST] * 3), (0.0, 0.0), config)
    assert len(trial.events("false drop")) == 1
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.report.exploration_time_s == pytest.approx(2.5)


def test_the_peg_stays_inside_the_exploration_area() -> None:
    policy = Steps(displacements_m=[EAST] * 12 + [(0.0, -0.5e-3)] * 12)
    trial = Trial(FakeWorld(FAR_AWAY), policy, (0.0, 0.0), TaskConfig(time_limit_s=3.0))
    tips = np.array([trial.tips[tick] for tick in trial.in_phase(Phase.EXPLORE)])
    assert tips[:, 0].max() == pytest.approx(3.5e-3, abs=1e-6)
    assert tips[:, 1].min() == pytest.approx(-3.5e-3, abs=1e-6)


# Ways to fail.


def test_the_time_limit_ends_the_exploration() -> None:
    trial = Trial(FakeWorld(FAR_AWAY), config=TaskConfig(time_limit_s=1.5))
    assert trial.report.outcome is Outcome.TIME_LIMIT
    assert trial.report.exploration_time_s == pytest.approx(1.5)
    assert trial.report.actions == len(trial.report.decisions) == 14
    assert trial.events("end")[0].detail == "time limit: 1.5 s"
    # The last action cost like any other, and it is not the goal.
    assert [t.next_state for t in trial.policy.learned].count(None) == 0
    assert len(trial.policy.learned) == 14
    assert trial.report.decisions[-1].reinforcement == -1.0
    assert trial.report.depth_m == pytest.approx(0.0, abs=2e-5)
    assert trial.stopped


def test_a_hole_that_is_not_deep_enough_is_a_jam() -> None:
    trial = Trial(FakeWorld(replace(HOLE, depth_m=5e-3)))
    assert trial.report.outcome is Outcome.JAMMED
    assert trial.report.depth_m == pytest.approx(5e-3, abs=5e-5)
    (lost,) = trial.events("contact lost")
    assert trial.report.exploration_time_s == pytest.approx((lost.tick - trial.events("contact")[0].tick) * PERIOD_S)
    assert 3 * 140 < trial.report.ticks - lost.tick < 4 * 140
    # The last action cost like any other, and it is not the goal.
    assert len(trial.policy.learned) == len(trial.report.decisions)
    assert all(t.next_state is not None for t in trial.policy.learned)
    assert trial.report.decisions[-1].reinforcement == -1.0
    assert trial.stopped


@pytest.mark.parametrize(("depth_mm", "outcome"), [(9.85, Outcome.INSERTED), (9.7, Outcome.JAMMED)])
def test_the_depth_tolerance_decides(depth_mm: float, outcome: Outcome) -> None:
    trial = Trial(FakeWorld(replace(HOLE, depth_m=depth_mm * 1e-3)))
    assert trial.report.outcome is outcome


def test_a_hole_without_a_bottom_is_deep_enough() -> None:
    trial = Trial(FakeWorld(replace(HOLE, depth_m=0.05)))
    assert trial.report.outcome is Outcome.INSERTED
    assert trial.report.depth_m == pytest.approx(0.0102, abs=1e-4)


def test_without_a_plate_there_is_no_contact() -> None:
    trial = Trial(FakeWorld(height_m=inf))
    assert trial.report.outcome is Outcome.NO_CONTACT
    assert Phase.EXPLORE not in trial.phases
    assert max(tip[2] for tip in trial.tips) == pytest.approx(0.018, abs=2e-4)
    assert trial.report.exploration_time_s == 0.0
    assert trial.stopped


def test_an_arm_that_is_stopped_from_outside_ends_the_trial() -> None:
    world = FakeWorld(HOLE)

    def stop(tick: int, snapshot: Snapshot) -> Snapshot:
        if tick == 90:
            world.arm.stop()
        return snapshot

    trial = Trial(world, on_step=stop)
    assert trial.report.outcome is Outcome.STOPPED
    # The command of tick 90 is the first that is not applied; the snapshot after it tells.
    assert trial.report.ticks == 92
    assert trial.stopped


def test_an_arm_that_does_not_follow_ends_the_approach() -> None:
    world = FakeWorld(HOLE)

    def jam_the_servos(tick: int, snapshot: Snapshot) -> Snapshot:
        world.arm._max_step_rad = 0.0 if tick >= 90 else PERIOD_S
        return snapshot

    trial = Trial(world, on_step=jam_the_servos)
    assert trial.report.outcome is Outcome.NO_CONTACT
    assert trial.report.ticks < 600
    assert trial.report.clamped_ticks == trial.report.ticks - 91
    here = np.array(trial.snapshots[-1].joints.position_rad)
    assert np.abs(np.array(trial.commands[-1].position_rad) - here).max() <= PERIOD_S * (1 + 1e-9)


@pytest.mark.parametrize(("depth_mm", "slack_mm", "inserted"), [(9.4, 0.5, True), (9.4, 0.3, False), (9.85, 0.0, True)])
def test_without_a_touch_the_surface_is_known_only_roughly(depth_mm: float, slack_mm: float, inserted: bool) -> None:
    hole = Pit(*START, depth_m=depth_mm * 1e-3)
    config = TaskConfig(surface_uncertainty_mm=slack_mm, time_limit_s=0.5)
    trial = Trial(FakeWorld(hole), Steps(), config=config)
    assert (trial.report.outcome is Outcome.INSERTED) is inserted


def test_a_slow_way_to_the_start_is_no_reason_to_give_up() -> None:
    trial = Trial(
        FakeWorld(HOLE, start_m=(0.0, 0.0, -3e-3)), config=TaskConfig(travel_speed_mm_s=1.0, ready_height_mm=70.0)
    )
    assert trial.phases.index(Phase.SETTLE) > 60 * 140
    assert trial.report.outcome is Outcome.INSERTED


def test_a_wedged_peg_is_noticed_before_the_sensor_is_tared() -> None:
    world = FakeWorld(HOLE)
    reads = iter(range(10_000))
    world.spoil = lambda sample: replace(
        sample, force_N=_sum(sample.force_N, (0.0, 0.0, 31.0 if next(reads) >= 5 else 0.0))
    )
    trial = Trial(world)
    assert trial.report.outcome is Outcome.FORCE_LIMIT
    assert trial.report.ticks == 6
    assert trial.phases[-2] in (Phase.LIFT, Phase.TRANSFER)
    assert trial.stopped


def test_the_force_limit_ends_the_trial_in_the_same_tick() -> None:
    world = FakeWorld(HOLE)
    reads = iter(range(10_000))
    world.spoil = lambda sample: (
        replace(sample, force_N=_sum(sample.force_N, (0.0, 0.0, -31.0))) if next(reads) == 100 else sample
    )
    trial = Trial(world)
    assert trial.report.outcome is Outcome.FORCE_LIMIT
    assert trial.report.ticks == 101
    assert trial.report.peak_force_N == pytest.approx(31.0)
    assert trial.events("end")[0].detail == "force limit: 31.00 N, limit 30 N"
    assert trial.stopped


def test_a_force_from_the_side_counts_as_well() -> None:
    trial = Trial(FakeWorld(HOLE), config=TaskConfig(max_force_N=5.5))
    assert trial.report.outcome is Outcome.FORCE_LIMIT
    assert abs(trial.forces[-1][2]) < 5.5 < hypot(*trial.forces[-1][:2])  # the wall of the hole did it
    assert trial.report.peak_force_N == pytest.approx(float(np.linalg.norm(trial.forces[-1])))


BAD_WRENCHES: dict[str, Callable[[WrenchSample], WrenchSample]] = {
    "stale": lambda w: replace(w, validity=Validity.STALE),
    "saturated": lambda w: replace(w, validity=Validity.SATURATED),
    "invalid": lambda w: replace(w, force_N=(nan, 0.0, 0.0), validity=Validity.INVALID),
}
BAD_JOINTS: dict[str, Callable[[JointSample], JointSample]] = {
    "stale": lambda j: replace(j, validity=Validity.STALE),
    "invalid": lambda j: replace(j, position_rad=(nan,) * 6, validity=Validity.INVALID),
}


def spoiled(snapshot: Snapshot, device: str, kind: str) -> Snapshot:
    if device == "force":
        return replace(snapshot, wrench=BAD_WRENCHES[kind](snapshot.wrench))
    return replace(snapshot, joints=BAD_JOINTS[kind](snapshot.joints))


@pytest.mark.parametrize(
    ("device", "kind"), [*(("force", kind) for kind in BAD_WRENCHES), *(("joint", kind) for kind in BAD_JOINTS)]
)
@pytest.mark.parametrize("when", [0, 1, 90, 250])
def test_a_bad_sample_ends_the_trial(device: str, kind: str, when: int, good: Trial) -> None:
    world = FakeWorld(HOLE)

    def spoil(tick: int, snapshot: Snapshot) -> Snapshot:
        return spoiled(snapshot, device, kind) if tick == when else snapshot

    if device == "joint" and when == 0:
        with pytest.raises(DeviceError, match=f"the first sample of the trial is {kind}"):
            Trial(world, on_step=spoil)
        return
    trial = Trial(world, on_step=spoil)
    assert trial.report.outcome is Outcome.SENSOR_FAULT
    assert trial.report.ticks == when + 1
    found = {"force": "valid", "joint": "valid", device: kind}
    assert (
        trial.events("end")[0].detail == f"sensor fault: force sample {found['force']}, joint sample {found['joint']}"
    )
    assert trial.commands[:-1] == good.commands[:when]
    if when:
        # The last command holds still where the one before led.
        assert trial.commands[-1].position_rad == pytest.approx(trial.commands[-2].position_rad, abs=1e-6)
    assert all(t.next_state is not None for t in trial.policy.learned)
    assert trial.stopped


def test_a_silent_sensor_is_noticed_through_the_ports() -> None:
    world = FakeWorld(HOLE)

    def silence(tick: int, snapshot: Snapshot) -> Snapshot:
        world.sensor.silent = tick >= 100
        return snapshot

    trial = Trial(world, on_step=silence)
    assert trial.report.outcome is Outcome.SENSOR_FAULT
    assert trial.report.ticks in (106, 107)  # the age limit of the sensor is five ticks
    assert trial.stopped


def test_a_fault_at_once_reports_nothing_of_the_trial_before() -> None:
    policy = FollowTorque()
    task = build_task(policy)
    assert Trial(FakeWorld(HOLE), policy, task=task).report.depth_m > 9e-3
    trial = Trial(
        FakeWorld(HOLE),
        policy,
        task=task,
        on_step=lambda tick, s: spoiled(s, "force", "stale"),
    )
    assert trial.report.outcome is Outcome.SENSOR_FAULT
    assert trial.report.depth_m == 0.0
    assert trial.report.peak_force_N == 0.0
    assert trial.report.decisions == []


def test_a_clamped_command_is_adopted_and_counted(good: Trial) -> None:
    world = FakeWorld(HOLE)
    world.arm._max_step_rad = 4e-4  # slower than the transfer wants to be
    trial = Trial(world)
    assert trial.report.outcome is Outcome.INSERTED
    clamped = [
        tick
        for tick, snapshot in enumerate(trial.snapshots)
        if snapshot.applied is not None and snapshot.applied.reason is not CommandReason.AS_ASKED
    ]
    assert trial.report.clamped_ticks == len(clamped) > 3
    assert trial.report.ticks >= good.report.ticks
    for tick in clamped:
        applied = trial.snapshots[tick].applied
        assert applied is not None
        step = np.array(trial.commands[tick].position_rad) - applied.position_rad
        assert np.abs(step).max() <= PERIOD_S * (1 + 1e-9)  # from where the arm is, not from where it was to be


def interrupted(when: int) -> Trial:
    policy = FollowTorque()
    task = build_task(policy)

    def interrupt(tick: int, snapshot: Snapshot) -> Snapshot:
        if tick == when:
            task.interrupt()
        return snapshot

    return Trial(FakeWorld(HOLE), policy, task=task, on_step=interrupt)


@pytest.mark.parametrize("when", [0, 60, 90, 230])
def test_an_interrupt_ends_a_trial_that_is_not_exploring_at_once(when: int) -> None:
    trial = interrupted(when)
    assert trial.report.outcome is Outcome.INTERRUPTED
    assert trial.report.ticks == when + 1
    assert trial.events("end")[0].detail == "interrupted: on request"
    assert all(t.next_state is not None for t in trial.policy.learned)
    assert trial.stopped


@pytest.mark.parametrize("when", [119, 130, 131, 132, 133, 146])
def test_an_interrupt_lets_the_running_action_end(when: int, good: Trial) -> None:
    (contact,) = good.events("contact")
    assert contact.tick == 118
    trial = interrupted(when)
    assert trial.report.outcome is Outcome.INTERRUPTED
    last = trial.report.ticks - 1
    assert when <= last < when + 14
    assert (last - contact.tick) % 14 == 0
    assert len(trial.report.decisions) == (last - contact.tick) // 14 - 1  # no further choice was made
    assert trial.commands[:-1] == good.commands[:last]


def test_a_trial_ends_for_one_reason_only() -> None:
    task = build_task(FollowTorque())

    def interrupt_and_hit(tick: int, s: Snapshot) -> Snapshot:
        if tick < 100:
            return s
        task.interrupt()
        return replace(s, wrench=replace(s.wrench, force_N=_sum(s.wrench.force_N, (0.0, 0.0, -31.0))))

    trial = Trial(FakeWorld(HOLE), task=task, on_step=interrupt_and_hit)
    assert trial.report.outcome is Outcome.INTERRUPTED
    assert len(trial.events("end")) == 1


# Configuration and independence.


def test_gains_are_checked_against_the_stiffness_when_the_task_is_made() -> None:
    # B = 400 N s/m bears 28 N/mm, and k_i = 0.00025 m/(N s) bears 560 N/mm.
    build_task(FollowTorque(), control=ControlConfig(axial_stiffness_N_per_mm=27.9, lateral_stiffness_N_per_mm=559.0))
    with pytest.raises(ConfigurationError) as axial:
        build_task(FollowTorque(), control=ControlConfig(axial_stiffness_N_per_mm=28.1))
    assert axial.value.field == "control.damping_N_s_per_m"
    with pytest.raises(ConfigurationError) as lateral:
        build_task(FollowTorque(), control=ControlConfig(lateral_stiffness_N_per_mm=561.0))
    assert lateral.value.field == "control.force_integral_m_per_N_s"


def test_the_core_runs_without_mujoco() -> None:
    code = (
        "import sys\n"
        "from palpate.core.control_loop import run_trial\n"
        "from palpate.core.insertion.trial import TrialSetup\n"
        "from tests.unit.core.fake_world import FakeWorld, FollowTorque, Pit, build_task\n"
        "with FakeWorld(Pit(1e-3, 0.0)) as world:\n"
        "    report = run_trial(build_task(FollowTorque()), world.ports, TrialSetup(0, 1, (0.0, 0.0)))\n"
        "heavy = [m for m in ('mujoco', 'torch', 'sklearn', 'matplotlib', 'scipy.signal') if m in sys.modules]\n"
        "print(report.outcome.value, heavy)\n"
    )
    root = Path(__file__).parents[4]
    roots = [str(root / name) for name in ("core", "adapters", "drivers", "simulation", ".")]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {roots!r}\n{code}"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.stderr == ""
    assert done.stdout == "inserted []\n"


def _sum(a: Vector3, b: Vector3) -> Vector3:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
