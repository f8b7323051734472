"""A force sensor that is turned about the tool's axis, read as if it were not."""

from dataclasses import replace
from math import cos, radians, sin

from palpate.core.ports import ForceSensor, SensorDecorator, WrenchSample


class TurnedForceSensor(SensorDecorator[WrenchSample], ForceSensor):
    """Gives wrenches in the frame of the tool.

    Args:
        mounting_deg: Its turn about the tool's axis, from x towards y.
    """

    def __init__(self, sensor: ForceSensor, mounting_deg: float) -> None:
        super().__init__(sensor, self._turned)
        self._cos, self._sin = cos(radians(mounting_deg)), sin(radians(mounting_deg))

    def _turned(self, sample: WrenchSample) -> WrenchSample:
        c, s = self._cos, self._sin
        (fx, fy, fz), (tx, ty, tz) = sample.force_N, sample.torque_Nm
        return replace(
            sample, force_N=(c * fx - s * fy, c * fy + s * fx, fz), torque_Nm=(c * tx - s * ty, c * ty + s * tx, tz)
        )
