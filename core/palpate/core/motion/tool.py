"""Poses of the force sensor and the peg's tip on the flange."""

from dataclasses import dataclass

from palpate.core.ports import Vector3

_ZERO: Vector3 = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ToolGeometry:
    """Poses of the sensor and the tip; the default is a bare flange.

    Attributes:
        sensor_m: Origin of the sensor's frame relative to the flange, (3,), in the flange's axes with z out of the arm.
        sensor_rpy_rad: Roll, pitch and yaw of the sensor's frame relative to these axes, (3,).
        tip_m: Centre of the peg's end face relative to the sensor's origin, (3,), sensor frame.
        tip_rpy_rad: Roll, pitch and yaw of the tip frame in the sensor frame, (3,).
    """

    sensor_m: Vector3 = _ZERO
    sensor_rpy_rad: Vector3 = _ZERO
    tip_m: Vector3 = _ZERO
    tip_rpy_rad: Vector3 = _ZERO
