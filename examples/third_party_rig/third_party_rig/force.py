"""The adapter for the force sensor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware import RigContext
from palpate.core.ports import CONTROL_RATE_HZ, Clock, ForceSensor, Validity, WrenchSample
from third_party_rig.device import BenchDevice, address

RANGE_N, RANGE_Nm = 200.0, 20.0


class BenchForceSensor(BenchDevice, ForceSensor):
    """Sensor of raw wrenches in the sensor frame, with z along the tool axis and out of the tool. Pressing gives -Fz.

    Args:
        at: Host and port.
        clock: The run's clock.
    """

    def __init__(self, at: tuple[str, int], clock: Clock) -> None:
        super().__init__("bench-force", 6, at, clock)
        self._sample: WrenchSample | None = None

    def read(self) -> WrenchSample:
        """Return the latest wrench, or the same sample again if there is no new one."""
        self._require_active("read()")
        validity = self._take_in()
        x, y, z, a, b, c = self._newest.values
        at_the_end = max(abs(x), abs(y), abs(z)) >= RANGE_N or max(abs(a), abs(b), abs(c)) >= RANGE_Nm
        if at_the_end and validity is Validity.VALID:
            validity = Validity.SATURATED
        last = self._sample
        if last is None or (last.sequence, last.validity) != (self._sequence, validity):
            at_ns = self._source_ns, self._heard_ns
            self._sample = last = WrenchSample((x, y, z), (a, b, c), *at_ns, self._sequence, validity)
        return last

    def reported_facts(self) -> SensorFactsTable:
        """Return the sensor facts, which then need not be in the rig file."""
        ranges_N, ranges_Nm = (RANGE_N,) * 3, (RANGE_Nm,) * 3
        return SensorFactsTable(range_N=ranges_N, range_Nm=ranges_Nm, rate_Hz=CONTROL_RATE_HZ, frame="sensor")


def make_force_sensor(settings: Mapping[str, Any], context: RigContext) -> BenchForceSensor:
    """Create the sensor specified in the ``[force_sensor]`` table of a rig file."""
    return BenchForceSensor(address("force_sensor", settings), context.clock)
