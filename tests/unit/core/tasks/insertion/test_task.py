"""The insertion task over bare ports: a trial as it should be, and what does not depend on the trial."""

from math import hypot

import numpy as np
import pytest

from palpate.core.policy import ActionOutcome, Transition
from palpate.core.ports import PERIOD_S
from palpate.core.trial import N_PER_KGF, Outcome, Phase, Purpose, TrialSetup, generator
from tests.unit.core.fake_world import (
    ACTIONS,
    WEIGHT_AND_BIAS_N,
    WEIGHT_AND_BIAS_NM,
    FakeWorld,
    FollowTorque,
    Pit,
    build_task,
)
from tests.unit.core.tasks.insertion.whole_trial import HOLE, PRESS_N, START, Trial


@pytest.fixture(scope="module")
def good() -> Trial:
    """A trial as it should be."""
    return Trial(FakeWorld(HOLE))


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
