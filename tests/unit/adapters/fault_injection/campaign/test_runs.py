import pytest

from palpate.adapters.fault_injection import FaultPlan, FaultyForceSensor
from palpate.adapters.fault_injection.campaign.runs import ForceProbe
from palpate.core.ports.contracts import FakeClock
from tests.fake_devices import FakeForceSensor


def test_what_a_fault_adds_or_hides_is_not_felt() -> None:
    clock = FakeClock()
    with FakeForceSensor(clock) as device:
        device.load_N = (1.0, 0.0, 5.0)
        felt = ForceProbe(device)
        grams = FaultPlan(kind="unit", port="force_sensor", factor=1000.0)
        faulty = FaultyForceSensor(felt, clock, [grams])
        for push in (0.0, -3.0, -4.0, -1.0):
            device.load_N = (1.0, 0.0, 5.0 + push)
            clock.advance()
            shown = faulty.read()
        assert shown.force_N == pytest.approx((1000.0, 0.0, 4000.0))
        assert felt.peak_N == pytest.approx(4.0)
