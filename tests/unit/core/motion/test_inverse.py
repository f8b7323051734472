"""Inverse kinematics: reaches what can be reached, keeps every limit, and never jumps."""

from math import pi

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.core.errors import UnreachableError
from palpate.core.motion import InverseKinematics, Kinematics, arm_named
from palpate.core.motion.arm import ARMS
from palpate.core.ports import PERIOD_S
from palpate.core.trial import GoalConfig, goal_in_base
from tests.support.tool import TOOL
from tests.unit.core.motion.limits import within_limits

ZEBRA = arm_named("zebra-zero")
SIX = ("zebra-zero", "ur5")
arms = pytest.mark.parametrize("arm", [arm_named(name) for name in SIX], ids=SIX)


class Bench:
    """An arm, its inverse kinematics, and a second work space to look at the result with."""

    def __init__(self, arm):
        self.look = Kinematics(arm, TOOL)
        self.inverse = InverseKinematics(Kinematics(arm, TOOL), PERIOD_S)
        self.posture = np.array(arm.posture_rad)
        self.reach = self.look.velocity_limit_rad_s * PERIOD_S

    def tip(self, q):
        self.look.update(q)
        return self.look.tip_in_base

    def shifted(self, q, *offset_m):
        """The tip placement at ``q``, moved in its own frame."""
        return self.tip(q) * pin.SE3(np.eye(3), np.array(offset_m))

    def step(self, q, target):
        """One with arrays, which tests reckon with."""
        q_rad, limited = self.inverse.step(tuple(q.tolist()), target)
        return np.array(q_rad), limited

    def ready(self):
        goal = goal_in_base(GoalConfig())
        return self.inverse.solve(goal, free_yaw=True, seed_rad=self.posture, field="place")


@pytest.fixture(params=SIX)
def bench(request):
    return Bench(arm_named(request.param))


@pytest.fixture(params=ARMS)
def each(request):
    return Bench(arm_named(request.param))


@pytest.fixture
def zebra():
    return Bench(ZEBRA)


# Solving for a pose.


@pytest.mark.parametrize("x_mm", [370.0, 400.0, 450.0])
@pytest.mark.parametrize("y_mm", [-100.0, 0.0, 100.0])
def test_a_hole_is_reached_with_the_tool_straight_down(each, x_mm, y_mm):
    goal = goal_in_base(GoalConfig(x_mm, y_mm))
    q = each.inverse.solve(goal, free_yaw=True, seed_rad=each.posture, field="place")
    tip = each.tip(q)
    assert np.linalg.norm(tip.translation - goal.translation) < 2e-6
    assert np.linalg.norm(np.cross(tip.rotation[:, 2], goal.rotation[:, 2])) < 2e-6
    assert tip.rotation[2, 2] < 0.0
    assert within_limits(each.look, q)


def test_a_seed_outside_the_limits_gives_a_solution_inside(zebra):
    # A whole turn of the last joint: the seed has the very pose that is asked for, and may not be the answer.
    outside = zebra.posture + 2 * pi * np.eye(6)[5]
    target = zebra.tip(outside)
    for free_yaw in (False, True):
        q = zebra.inverse.solve(target, free_yaw=free_yaw, seed_rad=outside, field="pose")
        assert within_limits(zebra.look, q)
        np.testing.assert_allclose(zebra.tip(q).translation, target.translation, atol=2e-6)


def test_an_unreachable_pose_names_the_setting(bench):
    goal = goal_in_base(GoalConfig(x_mm=1900.0))
    with pytest.raises(UnreachableError, match="reaches with the required tool axis") as caught:
        bench.inverse.solve(goal, free_yaw=True, seed_rad=bench.posture, field="place")
    assert caught.value.field == "place"
    assert "(1900, 0, 20) mm" in str(caught.value)
    assert bench.look.arm.name in str(caught.value)


# Single steps.


def test_a_free_step_is_the_exact_gauss_newton_step(bench):
    rng = np.random.default_rng(5)
    for _ in range(50):
        q = bench.posture + rng.uniform(-0.2, 0.2, 6)
        target = bench.tip(q) * pin.exp6(rng.uniform(-1e-4, 1e-4, 6))
        after, limited = bench.step(q, target)
        error = pin.log6(bench.tip(q).actInv(target)).vector
        expected = np.linalg.solve(bench.look.tip_jacobian(q), error)
        np.testing.assert_allclose(after - q, expected, rtol=1e-9, atol=1e-15)
        assert not limited


def test_other_joints_share_the_work_of_one_at_its_limit(zebra):
    q = zebra.posture.copy()
    q[1] = zebra.look.upper_rad[1]
    beyond = q.copy()
    beyond[1] += 2e-3
    target = zebra.tip(beyond)
    others = [0, 2, 3, 4, 5]

    def error(q):
        """What is left, and how much of it the other joints could still take away."""
        left = pin.log6(zebra.tip(q).actInv(target)).vector
        slope = zebra.look.tip_jacobian(q)[:, others].T @ left
        return float(np.linalg.norm(left)), float(np.linalg.norm(slope))

    left, slope = error(q)
    for _ in range(300):
        q = zebra.step(q, target)[0]
        assert q[1] <= zebra.look.upper_rad[1]
    assert error(q)[0] < 0.5 * left
    assert error(q)[1] < 1e-3 * slope


def test_a_joint_outside_its_limits_finds_the_way_back(bench):
    # An encoder's rounding can put an arm that stands at a limit just beyond it.
    q = bench.posture.copy()
    q[1] = bench.look.upper_rad[1] + 1e-4
    inside = q.copy()
    inside[1] -= 0.05
    target = bench.tip(inside)
    for _ in range(30):
        previous, q = q, bench.step(q, target)[0]
        assert q[1] <= previous[1]
    assert within_limits(bench.look, q)
    np.testing.assert_allclose(bench.tip(q).translation, target.translation, atol=1e-6)


@pytest.mark.parametrize("excess", [1.01, 1.5, 20.0])
def test_the_velocity_limit_keeps_the_direction(bench, excess):
    whole = excess * bench.reach * np.array([1.0, -0.5, 0.2, 0.7, -0.9, 0.3])
    target = bench.tip(bench.posture) * pin.exp6(bench.look.tip_jacobian(bench.posture) @ whole)
    after, limited = bench.step(bench.posture, target)
    dq = after - bench.posture
    assert limited
    assert (np.abs(dq) / bench.reach).max() == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_allclose(dq / np.linalg.norm(dq), whole / np.linalg.norm(whole), atol=1e-9)


@settings(deadline=None)
@given(
    bench=st.sampled_from((Bench(ZEBRA), Bench(arm_named("panda")))),
    angles=st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7),
    twist=st.lists(st.floats(-0.5, 0.5), min_size=6, max_size=6),
)
def test_no_step_breaks_a_limit_wherever_the_arm_stands(bench, angles, twist):
    lower, upper = bench.look.lower_rad, bench.look.upper_rad
    q = np.clip(lower + np.array(angles[: len(lower)]) * (upper - lower), lower, upper)
    after, _ = bench.step(q, bench.tip(q) * pin.exp6(np.array(twist)))
    assert np.isfinite(after).all()
    assert within_limits(bench.look, after)
    assert (np.abs(after - q) <= bench.reach * (1 + 1e-9)).all()


@arms
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0, 0, -1), (1, 1, -1)])
def test_near_a_singularity_steps_stay_small(arm, direction):
    bench = Bench(arm)
    straight = np.zeros(6)  # the zebra-zero straight up, the UR5 stretched out: elbow and wrist singular
    for bend in (0.0, 1e-9, 1e-6, 1e-3):
        q = straight + bend * np.array([0, 1, -1, 0, 1, 0])
        assert abs(np.linalg.det(bench.look.tip_jacobian(q))) < 2e-4
        target = bench.shifted(q, *(1e-4 * np.array(direction)))
        after, limited = bench.step(q, target)
        assert limited
        assert np.isfinite(after).all()
        # 0.1 mm with a damping of 0.1 can ask for 1e-4 / (2 x 0.1) rad at most; near the edge of the region more.
        assert np.abs(after - q).max() < 2e-3


@pytest.mark.parametrize("arm", ["panda", "xarm7"])
def test_what_a_seventh_joint_leaves_free_goes_back_to_the_posture_and_the_tip_stays(arm):
    bench = Bench(arm_named(arm))
    home = bench.ready()
    target, q = bench.tip(home), home
    for _ in range(100):  # Along what leaves the tip where it is, the elbow out to one side.
        free = np.linalg.svd(bench.look.tip_jacobian(q))[2][6]
        aside = q + 0.01 * free * np.sign(free[0])
        left = pin.log6(bench.tip(aside).actInv(target)).vector
        q = aside + np.linalg.pinv(bench.look.tip_jacobian(aside)) @ left
    assert np.abs(q - home).max() > 0.3
    last = np.zeros(7)
    for _ in range(1500):
        step = bench.step(q, target)[0] - q
        q = q + step
        assert np.abs(pin.log6(bench.tip(q).actInv(target)).vector).max() < 1e-5
        assert (np.abs(step - last) <= 0.25 * bench.reach).all()
        last = step
    np.testing.assert_allclose(q, home, atol=1e-3)


def test_damping_sets_in_gently(zebra):
    bends = np.linspace(0.0, 0.5, 5001)
    elbows = [np.array([0.0, 0.3, -bend, 0.2, 0.4, 0.1]) for bend in bends]
    place = np.searchsorted([abs(np.linalg.det(zebra.look.tip_jacobian(q))) for q in elbows], 2e-4)
    steps = [zebra.step(q, zebra.shifted(q, 1e-5, 0.0, 0.0)) for q in (elbows[place - 1], elbows[place])]
    assert [limited for _, limited in steps] == [True, False]
    damped, free = (after - q for (after, _), q in zip(steps, elbows[place - 1 :], strict=False))
    assert np.linalg.norm(damped - free) < 0.05 * np.linalg.norm(free)


def test_six_of_seven_joints_get_there_and_it_is_said_that_one_met_its_limit():
    panda = Bench(arm_named("panda"))
    q = panda.posture + 0.4
    q[1] = panda.look.upper_rad[1]
    beyond = panda.tip(q + 1e-4 * np.eye(7)[1])
    after, limited = panda.step(q, beyond)
    assert (limited, after[1]) == (True, q[1])
    np.testing.assert_allclose(panda.tip(after).translation, beyond.translation, atol=1e-6)
