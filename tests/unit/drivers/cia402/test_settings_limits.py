from palpate.core.ports.values import CommandReason
from palpate.drivers.device import AppliedReason

PERIOD_S = 0.01
HERE = (0.0,) * 6


def test_the_reasons_are_those_of_the_core() -> None:
    assert [r.name for r in AppliedReason] == [r.name for r in CommandReason]
