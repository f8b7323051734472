"""The arm moves by a hair's breadth and back: do the servos follow?"""

from __future__ import annotations

from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.core.errors import DeviceError
from palpate.core.ports.devices import ArmCommand, Clock, JointEncoder
from palpate.core.ports.values import CONTROL_RATE_HZ, CommandReason, JointCommand, JointVector, Validity

STEP_RAD: Final = 1e-3
"""The step, on the last joint."""
_RAMP_TICKS: Final = CONTROL_RATE_HZ // 2
_WAIT_TICKS: Final = CONTROL_RATE_HZ // 2
_GOOD_RAD: Final = 0.25 * STEP_RAD
"""Error that is borne at rest: friction and the servo's dead band leave some counts. A choice."""


def examine_following(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, upper_rad: JointVector, notes: Notebook
) -> None:
    """Moves the last joint by :data:`STEP_RAD` and back. The arm is stopped on every way out.

    Args:
        arm: Active.
        encoder: Active.
        clock: The run's clock.
        upper_rad: Upper joint limits, (n,); the step goes away from it.
        notes: Where it goes.

    Raises:
        DeviceError: The arm is held back, or its samples are not valid.
    """
    try:
        start = encoder.read().position_rad
        step = STEP_RAD if start[-1] + STEP_RAD < upper_rad[-1] else -STEP_RAD
        there, most = _go(arm, encoder, clock, start, step)
        back, most_back = _go(arm, encoder, clock, (*start[:-1], start[-1] + step), -step)
    finally:
        arm.stop()
    moved, returned = there[-1] - start[-1], back[-1] - start[-1]
    aside = max((abs(q - s) for q, s in zip(there[:-1], start[:-1], strict=True)), default=0.0)
    notes.fact("step", f"{step * 1e3:+.1f} mrad asked of the last joint, {moved * 1e3:+.3f} mrad made,"
               f" {returned * 1e3:+.3f} mrad left after the way back", moved)  # fmt: skip
    notes.fact("lag", f"{max(most, most_back) * 1e3:.3f} mrad at most", max(most, most_back))
    well = abs(moved - step) <= _GOOD_RAD and abs(returned) <= _GOOD_RAD
    remedy = "look at gains, brake and motor supply of the last joint"
    if moved * step < 0 and abs(moved) > _GOOD_RAD:
        remedy = "the joint turned the other way: mend the sign of its counts, before anything else moves"
    notes.judge(well, "the last joint follows", "the last joint does not follow", remedy)
    if aside > _GOOD_RAD:
        remedy = "mend the transmission in the adapter's settings (coupled wrist, order of the axes)"
        notes.wrong(f"another joint moved along by {aside * 1e3:.3f} mrad", remedy)


def _go(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, start: JointVector, step: float
) -> tuple[JointVector, float]:
    """Where the arm is in the end, and the largest distance on the way between set-point and last joint."""
    begin_ns, most = clock.now_ns(), 0.0
    for tick in range(_RAMP_TICKS + _WAIT_TICKS):
        clock.sleep_until(begin_ns + tick * 1_000_000_000 // CONTROL_RATE_HZ)
        share = min(1.0, (tick + 1) / _RAMP_TICKS)
        applied = arm.send(JointCommand((*start[:-1], start[-1] + share * step)))
        if applied.reason in (CommandReason.STOPPED, CommandReason.POSITION_LIMIT):
            raise DeviceError("arm", f"the step was held back: {applied.reason.value}")
        sample = encoder.read()
        if sample.validity is not Validity.VALID:
            raise DeviceError("arm", f"the joint sample is {sample.validity.value} during the step")
        most = max(most, abs(sample.position_rad[-1] - applied.position_rad[-1]))
    return encoder.read().position_rad, most
