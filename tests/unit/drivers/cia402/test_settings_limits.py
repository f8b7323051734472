from math import inf, nan

import pytest

from palpate.core.ports.values import CommandReason
from palpate.drivers.cia402.settings import require_sound
from palpate.drivers.device import AppliedReason
from palpate.drivers.errors import RefusedError
from tests.unit.drivers.cia402.bench import joints

PERIOD_S = 0.01
HERE = (0.0,) * 6


def test_the_reasons_are_those_of_the_core() -> None:
    assert [r.name for r in AppliedReason] == [r.name for r in CommandReason]


@pytest.mark.parametrize("bad", [nan, inf, -inf])
def test_what_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(RefusedError):
        require_sound((0.0, 0.0, bad, 0.0, 0.0, 0.0), joints())


@pytest.mark.parametrize("number", [0, 5, 7])
def test_a_wrong_number_of_angles_is_refused(number: int) -> None:
    with pytest.raises(RefusedError):
        require_sound((0.0,) * number, joints())
