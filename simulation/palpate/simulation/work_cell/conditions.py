"""Conditions that vary between or within trials, in addition to the scatter in hole position and the sensor noise."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.core.ports import OneOf, Range, Settings

DRAWN: Final = "drawn"
_Heading: TypeAlias = Annotated[str, OneOf("set", DRAWN)]
_Batch: TypeAlias = Annotated[int, Range(0, 100_000)]


@dataclass(frozen=True)
class ConditionsConfig(Settings):
    """Varying conditions: hole, grip, sensor zero and wear. All are off by default."""

    TABLE: ClassVar[str] = "cell.conditions"

    hole_shift_mm: Annotated[float, Range(0.0, 50.0)] = 0.0
    """Set-up error of the plate for each batch: the centre of the disc that contains its holes is within this distance
    of the nominal goal."""
    hole_shift_trials: _Batch = 0
    """Number of trials per batch; 0 puts all trials of a seed into one."""
    tilt_heading: _Heading = "set"
    """set: the peg is tilted towards cell.tilt_heading_deg; drawn: in a direction drawn for each grip."""
    grip_trials: _Batch = 0
    """Number of trials between regrips; 0 disables regrips."""
    zero_shift_N: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Lateral force by which the sensor's zero shifts under load; a tare in free space cannot detect it."""
    zero_shift_Nm: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Lateral torque by which the zero shifts under load."""
    zero_drift_N_s: Annotated[float, Range(0.0, 1000.0)] = 0.0
    """Drift rate of the force zero across the tool axis during a trial."""
    zero_drift_Nm_s: Annotated[float, Range(0.0, 1000.0)] = 0.0
    """Drift rate of the torque zero across the tool axis."""
    zero_heading: _Heading = "set"
    """set: the zero shifts towards zero_heading_deg; drawn: in a direction drawn for each batch."""
    zero_heading_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Direction of these shifts and drifts, measured from x towards y in the sensor's frame."""
    zero_trials: _Batch = 0
    """Number of trials per batch; 0 puts all trials of a seed into one."""
    wear_mm: Annotated[float, Range(-5.0, 5.0)] = 0.0
    """Increase of the clearance after wear_trials trials; linear until then, constant afterwards."""
    wear_trials: Annotated[int, Range(1, 100_000)] = 100
    """Number of trials until wear is complete."""
    yaw_deg: Annotated[float, Range(0.0, 180.0)] = 0.0
    """Maximum rotation of the hole about its axis in either direction, drawn for each trial."""
    plate_tilt_mrad: Annotated[float, Range(0.0, 200.0)] = 0.0
    """Tilt of the plate about the hole's mouth, in a direction drawn for each trial."""

    @override
    def check(self) -> None:
        for trials, heading in (("grip_trials", "tilt_heading"), ("zero_trials", "zero_heading")):
            accepted = f"0, unless {self.dotted(heading)} is drawn: nothing would change from batch to batch"
            self.require(trials, not getattr(self, trials) or getattr(self, heading) == DRAWN, accepted)
        accepted = f"0, unless {self.dotted('hole_shift_mm')} is more: no hole would move"
        self.require("hole_shift_trials", not self.hole_shift_trials or self.hole_shift_mm > 0.0, accepted)
