"""What the clauses send to an arm that somebody could stand beside."""

from itertools import pairwise
from typing import ClassVar

import pytest

from palpate.adapters.contracts import NO_MOTION, ArmCommandRig, ClauseOutcome, FakeClock, MotionLimits, run_clauses
from palpate.core.errors import ConfigurationError
from palpate.core.ports.values import JointVector
from tests.contracts import test_fake as fake
from tests.fake_devices import FakeArm

HOME = fake.HOME_RAD


class Obedient(FakeArm):
    """Knows no limits, and remembers what it was asked, and when."""

    asked: ClassVar[list[tuple[int, JointVector]]] = []

    def send(self, command):
        if len(command.position_rad) == len(HOME):
            self.asked.append((self.clock.now_ns(), command.position_rad))
        return super().send(command)


class Checked(fake.TestFakeArm):
    """Its clauses on one clock, so that all of them together are one way of the arm."""

    __test__ = False
    kind = Obedient

    def __init__(self, motion):
        self.motion, self.clock = motion, FakeClock()
        Obedient.asked = []

    def make(self):
        arm = Obedient(self.clock, home_rad=HOME, lower_rad=(-3.0,) * 3, upper_rad=(3.0,) * 3, max_step_rad=10.0)
        return ArmCommandRig(
            device=arm, clock=self.clock, advance=self.clock.advance, home_rad=HOME, lower_rad=fake.LOWER_RAD,
            upper_rad=fake.UPPER_RAD, fast_step_rad=0.1, position_rad=arm.position_rad, provoke_fault=arm.fail,
        )  # fmt: skip


def apart(one, other):
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


def furthest_in_a_tick():
    """The longest step of a joint from one tick to the next, rad."""
    by_tick = {}
    for time_ns, pose in Obedient.asked:
        by_tick.setdefault(time_ns, []).append(pose)
    ticks = list(by_tick.values())
    return max(apart(pose, before[-1]) for before, now in pairwise(ticks) for pose in now)


def test_nothing_is_sent_without_leave():
    results = run_clauses(Checked(NO_MOTION))
    assert Obedient.asked == []
    assert not [result for result in results if result.outcome is ClauseOutcome.FAILED]


def test_an_arm_without_limits_is_found_out_within_rate_and_reach():
    motion = MotionLimits(rate_rad_s=0.3, reach_rad=0.25)
    results = run_clauses(Checked(motion))
    failed = [result.clause.name for result in results if result.outcome is ClauseOutcome.FAILED]
    assert failed == ["test_position_limit_is_applied_and_told"]
    assert furthest_in_a_tick() <= motion.tick_rad
    assert max(apart(pose, HOME) for _, pose in Obedient.asked) <= motion.reach_rad
    # It was led back from the limit.
    assert apart(Obedient.asked[-1][1], HOME) < 0.01


def test_a_limit_out_of_reach_is_not_tried():
    results = run_clauses(Checked(MotionLimits(rate_rad_s=0.3, reach_rad=0.05)))
    (limit,) = [result for result in results if result.clause.name == "test_position_limit_is_applied_and_told"]
    assert limit.outcome is ClauseOutcome.NOT_APPLICABLE
    assert "from home" in limit.message


def test_a_simulated_arm_is_led_to_its_limit_step_by_step_as_well():
    suite = Checked(None)
    with pytest.raises(AssertionError, match="position limit"):
        suite.test_position_limit_is_applied_and_told()
    assert furthest_in_a_tick() <= 1e-3 + 1e-12


def test_a_rate_at_which_nothing_shows_is_refused():
    with pytest.raises(ConfigurationError, match="rate_rad_s"):
        Checked(NO_MOTION).make().within(MotionLimits(1e-5, 1.0))
