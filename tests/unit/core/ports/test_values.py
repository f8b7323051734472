"""Value objects: frozen, equal by value, and nothing that is not finite passes unmarked."""

import pickle
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.core.errors import CommandError, PalpateError
from palpate.core.ports.values import (
    AppliedCommand,
    JointCommand,
    JointSample,
    Snapshot,
    Validity,
    WrenchSample,
)

WRENCH = WrenchSample((1.0, 2.0, -3.0), (0.1, 0.2, 0.3), 10, 20, 7)
JOINTS = JointSample((0.1, -0.2), 10, 20, 7)
COMMAND = JointCommand((0.1, -0.2))
APPLIED = AppliedCommand((0.1, -0.2))
SNAPSHOT = Snapshot(0, 30, WRENCH, JOINTS)
VALUES = [WRENCH, JOINTS, COMMAND, APPLIED, SNAPSHOT]
finite = st.floats(min_value=-1e6, max_value=1e6)
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
