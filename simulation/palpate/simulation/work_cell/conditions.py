"""What is not the same in every trial, or not throughout one, beyond the hole's scatter and the sensor's noise."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, TypeAlias

from typing_extensions import override

from palpate.core.ports import OneOf, Range, Settings

DRAWN: Final = "drawn"
_Heading: TypeAlias = Annotated[str, OneOf("set", DRAWN)]
_Batch: TypeAlias = Annotated[int, Range(0, 100_000)]


@dataclass(frozen=True)
class ConditionsConfig(Settings):
    """Conditions that change: hole, grip, sensor's zero, wear. As they come, nothing of it happens."""

    TABLE: ClassVar[str] = "cell.conditions"

    hole_shift_mm: Annotated[float, Range(0.0, 50.0)] = 0.0
    """The plate is set up anew for each batch: the middle of the disc in which its holes are drawn lies anywhere
    within this distance of the nominal goal."""
    hole_shift_trials: _Batch = 0
    """Trials of such a batch; 0: all trials of a seed are one."""
    tilt_heading: _Heading = "set"
    """set: the peg leans towards cell.tilt_heading_deg; drawn: anywhere, drawn anew for each grip."""
    grip_trials: _Batch = 0
    """Trials until the peg is gripped anew; 0: never in a seed's trials."""
    zero_shift_N: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Force, across the tool axis, by which the sensor's zero moves under load: a tare in free air cannot see it."""
    zero_shift_Nm: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Torque, across the tool axis, by which it moves with it."""
    zero_drift_N_s: Annotated[float, Range(0.0, 1000.0)] = 0.0
    """Force, across the tool axis, by which the zero drifts throughout a trial."""
    zero_drift_Nm_s: Annotated[float, Range(0.0, 1000.0)] = 0.0
    """Torque, across the tool axis, by which it drifts with it."""
    zero_heading: _Heading = "set"
    """set: the zero moves towards zero_heading_deg; drawn: anywhere, drawn anew for each batch."""
    zero_heading_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Direction of these forces and torques, from x towards y of the sensor's frame."""
    zero_trials: _Batch = 0
    """Trials of such a batch; 0: all trials of a seed are one."""
    wear_mm: Annotated[float, Range(-5.0, 5.0)] = 0.0
    """By how much the clearance has grown after wear_trials trials: evenly up to there, and then no more."""
    wear_trials: Annotated[int, Range(1, 100_000)] = 100
    """Trials that wear takes."""
    yaw_deg: Annotated[float, Range(0.0, 180.0)] = 0.0
    """The hole is turned about its axis by anything up to this, either way, drawn anew for each trial."""
    plate_lean_mrad: Annotated[float, Range(0.0, 200.0)] = 0.0
    """The plate leans by this, about the hole's mouth, in a direction that is drawn anew for each trial."""

    @override
    def check(self) -> None:
        for trials, heading in (("grip_trials", "tilt_heading"), ("zero_trials", "zero_heading")):
            accepted = f"0, unless {self.dotted(heading)} is drawn: nothing would change from batch to batch"
            self.require(trials, not getattr(self, trials) or getattr(self, heading) == DRAWN, accepted)
        accepted = f"0, unless {self.dotted('hole_shift_mm')} is more: no hole would move"
        self.require("hole_shift_trials", not self.hole_shift_trials or self.hole_shift_mm > 0.0, accepted)
