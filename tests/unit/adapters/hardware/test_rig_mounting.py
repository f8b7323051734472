import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware import TurnedForceSensor
from palpate.core.ports import WrenchSample
from palpate.simulation.work_cell import HiddenValues
from tests.fake_devices import FakeForceSensor


@given(st.floats(-180.0, 180.0), st.tuples(*[st.floats(-10.0, 10.0)] * 6))
def test_a_turned_sensor_reads_as_if_it_were_not(turn_deg, wrench):
    felt = HiddenValues(mounting_deg=turn_deg).felt(list(wrench), (0.0, 0.0, 1.0))
    sensor = FakeForceSensor(FakeClock())
    sensor.read = lambda: WrenchSample(tuple(felt[:3]), tuple(felt[3:]), 1, 2, 3)  # type: ignore[method-assign, arg-type]
    read = TurnedForceSensor(sensor, turn_deg).read()
    assert (*read.force_N, *read.torque_Nm) == pytest.approx(wrench, abs=1e-12)
    assert (read.source_time_ns, read.receive_time_ns, read.sequence) == (1, 2, 3)
