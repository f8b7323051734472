"""A polled force sensor on a computer that is slower than its readings come."""

from dataclasses import dataclass

from typing_extensions import override

from palpate.adapters.contracts import FakeClock
from palpate.adapters.hardware.polled_sensor import PolledForceSensor
from palpate.core.ports import Validity
from palpate.drivers.device import ForceSample, PolledSensor


class Busy(PolledSensor):
    """A poll takes longer than a reading: each finds a new one."""

    def __init__(self, clock):
        super().__init__("sensor", "wait")
        self.clock, self.count = clock, 0

    @override
    def poll(self, now_ns):
        self.clock.sleep_until(now_ns + 6_000_000)
        self.count += 1
        zero = (0.0, 0.0, 0.0)
        self.latest = ForceSample(zero, zero, self.count, self.clock.now_ns())
        return [self.latest]

    @override
    def check(self): ...


@dataclass
class Table:
    max_age_ms: float = 50.0
    start_timeout_s: float = 30.0


class Sensor(PolledForceSensor[Busy]):
    period_ns = 5_000_000

    @override
    def _connect(self):
        self.device = Busy(self._clock)  # type: ignore[arg-type]

    @override
    def _leave(self, device): ...


def test_sensor_whose_readings_come_faster_than_they_are_taken_is_activated():
    clock = FakeClock()
    with Sensor("sensor", clock, Table()) as sensor:
        assert clock.now_ns() < 2 * 10**9
        assert sensor.read().validity is Validity.VALID
