"""What the force sensor really felt in a run, whatever a fault makes of it further on."""

from __future__ import annotations

from math import dist

from palpate.core.ports.decorator import SensorDecorator
from palpate.core.ports.devices import ForceSensor
from palpate.core.ports.values import Validity, Vector3, WrenchSample


class ForceProbe(SensorDecorator[WrenchSample], ForceSensor):
    """Passes samples on and keeps the largest change of the force since the first one.

    Args:
        sensor: The sensor itself, without faults.

    Attributes:
        peak_N: That change.
    """

    def __init__(self, sensor: ForceSensor) -> None:
        super().__init__(sensor, sensor.read, self._noted)
        self.peak_N = 0.0
        self._first_N: Vector3 | None = None

    def _noted(self, sample: WrenchSample) -> WrenchSample:
        if sample.validity is not Validity.INVALID:
            if self._first_N is None:
                self._first_N = sample.force_N
            self.peak_N = max(self.peak_N, dist(sample.force_N, self._first_N))
        return sample
