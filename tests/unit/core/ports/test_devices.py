"""The life cycle of devices, commands within limits, and values of which none that is not finite passes unmarked."""

import pickle
from functools import partialmethod
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError, DeviceError, FaultLatchedError, LifecycleError, PalpateError
from palpate.core.ports import CommandLimiter, CommandReason
from palpate.core.ports.lifecycle import TRANSITIONS, Life, LifeRequest, ManagedDevice
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, Snapshot, Validity, WrenchSample


class Device(ManagedDevice):
    """Notes which hooks were called; a hook named in ``failing`` raises."""

    def __init__(self, *failing):
        super().__init__("probe")
        self.calls = []
        self.failing = failing

    def _note(self, hook):
        self.calls.append(hook)
        if hook in self.failing:
            raise DeviceError("probe", f"{hook} failed")

    _on_configure = partialmethod(_note, "configure")
    _on_activate = partialmethod(_note, "activate")
    _on_deactivate = partialmethod(_note, "deactivate")
    _on_acknowledge = partialmethod(_note, "acknowledge")
    _on_close = partialmethod(_note, "close")


def device_in(life):
    device = Device()
    if life is not Life.CONSTRUCTED:
        device.configure()
    if life in (Life.ACTIVE, Life.FAULTED):
        device.activate()
    if life is Life.FAULTED:
        device._latch("too hot")
    if life is Life.CLOSED:
        device.close()
    assert device.life is life
    device.calls.clear()
    return device


PAIRS = [(life, request) for life in Life for request in LifeRequest]


class TestLifeCycle:
    @pytest.mark.parametrize(("life", "request_"), PAIRS)
    def test_each_request_in_each_state(self, life, request_):
        device = device_in(life)
        target = TRANSITIONS.get((life, request_))
        ask = getattr(device, request_.value)
        if target is not None:
            ask()
            assert device.life is target
            return
        with pytest.raises(FaultLatchedError if life is Life.FAULTED else LifecycleError):
            ask()
        assert device.life is life
        assert device.calls == []

    def test_way_to_active_never_starts_at_a_fault(self):
        assert [life for (life, _), target in TRANSITIONS.items() if target is Life.ACTIVE] == [Life.CONFIGURED]

    def test_error_tells_what_would_be_possible(self):
        with pytest.raises(LifecycleError) as caught:
            Device().activate()
        assert caught.value.state == "constructed"
        assert caught.value.request == "activate()"
        assert str(caught.value) == (
            "probe: activate() is not possible while constructed; possible now: configure(), close()"
        )

    def test_failed_hook_leaves_the_state_as_it_was(self):
        device = Device("configure")
        with pytest.raises(DeviceError):
            device.configure()
        assert device.life is Life.CONSTRUCTED

    def test_fault_that_cannot_be_cleared_stays(self):
        device = device_in(Life.FAULTED)
        device.failing = ("acknowledge",)
        with pytest.raises(DeviceError):
            device.acknowledge_fault()
        assert device.life is Life.FAULTED
        assert device.fault == "too hot"

    def test_closed_device_latches_nothing(self):
        device = device_in(Life.CLOSED)
        device._latch("late news")
        assert device.life is Life.CLOSED
        assert device.fault is None

    def test_device_that_fails_to_close_is_closed_all_the_same(self):
        device = device_in(Life.ACTIVE)
        device.failing = ("close",)
        with pytest.raises(DeviceError):
            device.close()
        assert device.life is Life.CLOSED
        device.close()

    @pytest.mark.parametrize("hook", ["configure", "activate"])
    def test_context_manager_closes_when_it_cannot_be_entered(self, hook):
        device = Device(hook)
        with pytest.raises(DeviceError, match=hook), device:
            pytest.fail("must not be entered")
        assert device.life is Life.CLOSED
        assert device.calls[-1] == "close"


LOWER, UPPER, SPEED, RATE = (-1.0, -2.0), (1.0, 0.5), (14.0, 1.4), 140.0
PERIOD_NS = 10**9 // 140
ANGLES = st.tuples(st.floats(-3, 3), st.floats(-3, 3))


def limiter(held=(0.0, 0.0)):
    made = CommandLimiter(LOWER, UPPER, SPEED, RATE)
    made.start(held)
    return made


class TestCommandLimits:
    def test_fast_step_is_shortened_in_its_own_direction(self):
        applied = limiter().limited((0.05, -0.5), 0)
        assert applied.reason is CommandReason.VELOCITY_LIMIT
        assert applied.position_rad == pytest.approx((0.001, -0.01))

    def test_command_that_comes_early_after_a_late_one_is_not_held_back(self):
        made, reached = limiter((-1.0, 0.0)), -1.0
        for k in range(18):
            reached += 0.0999
            applied = made.limited((reached, 0.0), k * PERIOD_NS + 1_000_000 * (k % 2))
            assert applied.reason is CommandReason.AS_REQUESTED

    @given(st.lists(st.tuples(ANGLES, st.integers(0, 3 * PERIOD_NS)), min_size=1, max_size=20))
    def test_no_sequence_of_commands_leaves_the_limits(self, commands):
        made, before, now_ns = limiter(), (0.0, 0.0), 0
        for requested, passed_ns in commands:
            now_ns += passed_ns
            applied = made.limited(requested, now_ns)
            for q, old, low, high, speed in zip(applied.position_rad, before, LOWER, UPPER, SPEED, strict=True):
                assert low <= q <= high
                # Twice: a newer command of the same time goes from one side to the other.
                assert abs(q - old) <= speed / RATE * (2.0 if passed_ns == 0 else 1.0) * (1 + 1e-9) + 1e-12
                assert abs(q) <= speed * (now_ns * 1e-9 + 1.25 / RATE + 2e-6) + 1e-12
            assert (applied.reason is CommandReason.AS_REQUESTED) == (applied.position_rad == requested)
            before = applied.position_rad


WRENCH = WrenchSample((1.0, 2.0, -3.0), (0.1, 0.2, 0.3), 10, 20, 7)
JOINTS = JointSample((0.1, -0.2), 10, 20, 7)
COMMAND = JointCommand((0.1, -0.2))
APPLIED = AppliedCommand((0.1, -0.2))
SNAPSHOT = Snapshot(0, 30, WRENCH, JOINTS)
VALUES = [WRENCH, JOINTS, COMMAND, APPLIED, SNAPSHOT]
not_finite = st.sampled_from([nan, inf, -inf])


class TestValues:
    @pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
    def test_frozen_slotted_hashable_and_picklable(self, value):
        with pytest.raises(AttributeError):
            setattr(value, value.__match_args__[0], 1)
        assert not hasattr(value, "__dict__")
        copy = pickle.loads(pickle.dumps(value))
        assert copy == value
        assert hash(copy) == hash(value)

    @given(st.integers(0, 5), not_finite, st.sampled_from([v for v in Validity if v is not Validity.INVALID]))
    def test_wrench_that_is_not_finite_must_be_marked_invalid(self, place, bad, validity):
        numbers = [0.0] * 6
        numbers[place] = bad
        fx, fy, fz, tx, ty, tz = numbers
        with pytest.raises(CommandError, match="must be marked INVALID"):
            WrenchSample((fx, fy, fz), (tx, ty, tz), 0, 0, 0, validity)
        assert WrenchSample((fx, fy, fz), (tx, ty, tz), 0, 0, 0, Validity.INVALID).sequence == 0

    def test_infinities_of_both_signs_do_not_cancel(self):
        with pytest.raises(CommandError):
            WrenchSample((inf, -inf, 0.0), (0.0, 0.0, 0.0), 0, 0, 0)
        with pytest.raises(CommandError):
            JointCommand((inf, -inf))

    @given(st.integers(0, 2), not_finite)
    def test_angles_that_are_not_finite_must_be_marked_invalid(self, place, bad):
        angles = tuple(bad if i == place else 0.5 for i in range(3))
        with pytest.raises(CommandError, match="must be marked INVALID"):
            JointSample(angles, 0, 0, 0)
        assert JointSample(angles, 0, 0, 0, Validity.INVALID).sequence == 0

    @given(st.integers(0, 2), not_finite)
    def test_command_that_is_not_finite_cannot_be_made(self, place, bad):
        angles = tuple(bad if i == place else 0.5 for i in range(3))
        with pytest.raises(CommandError, match="a joint command must be finite") as caught:
            JointCommand(angles)
        assert caught.value.value == angles
        assert isinstance(caught.value, PalpateError)
        assert isinstance(caught.value, ValueError)
