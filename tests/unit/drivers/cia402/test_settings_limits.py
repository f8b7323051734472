from math import inf, nan

import pytest

from palpate.core.ports.values import CommandReason
from palpate.drivers.arm import AppliedReason
from palpate.drivers.cia402.settings import limited, require_sound
from palpate.drivers.errors import RefusedError
from tests.unit.drivers.cia402.bench import joints

PERIOD_S = 0.01
HERE = (0.0,) * 6


def test_the_reasons_are_those_of_the_core() -> None:
    assert [r.name for r in AppliedReason] == [r.name for r in CommandReason]


def test_a_legal_step_is_untouched() -> None:
    asked = (0.01, -0.01, 0.0, 0.003, 0.0, 0.0)
    applied = limited(asked, HERE, joints(), PERIOD_S)
    assert applied.position_rad == asked
    assert applied.reason is AppliedReason.AS_ASKED


def test_a_fast_step_is_shortened_in_its_own_direction() -> None:
    applied = limited((0.04, -0.02, 0.0, 0.0, 0.0, 0.0), HERE, joints(), PERIOD_S)
    assert applied.reason is AppliedReason.VELOCITY_LIMIT
    assert applied.position_rad == pytest.approx((0.01, -0.005, 0.0, 0.0, 0.0, 0.0))


def test_a_step_across_the_limit_ends_there() -> None:
    near = (0.995, 0.0, 0.0, 0.0, 0.0, 0.0)
    applied = limited((1.004, 0.0, 0.0, 0.0, 0.0, 0.0), near, joints(), PERIOD_S)
    assert applied.reason is AppliedReason.POSITION_LIMIT
    assert applied.position_rad[0] == 1.0


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_what_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(RefusedError):
        require_sound((0.0, 0.0, bad, 0.0, 0.0, 0.0), joints())


@pytest.mark.parametrize("number", [0, 5, 7])
def test_a_wrong_number_of_angles_is_refused(number: int) -> None:
    with pytest.raises(RefusedError):
        require_sound((0.0,) * number, joints())
