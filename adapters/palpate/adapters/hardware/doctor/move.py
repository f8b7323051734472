"""Move each joint by one milliradian and back to check that its encoder follows."""

from typing import Final

from palpate.adapters.hardware.doctor.findings import DeviceReport, Topic
from palpate.core.errors import DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    ArmCommand,
    Clock,
    CommandReason,
    JointCommand,
    JointEncoder,
    JointVector,
    Validity,
)

STEP_RAD: Final = 1e-3
"""Step of each joint."""
_RAMP_TICKS: Final = CONTROL_RATE_HZ // 2
_WAIT_TICKS: Final = CONTROL_RATE_HZ // 2
_GOOD_RAD: Final = 0.25 * STEP_RAD
"""Accepted error of a stationary arm. Friction and the servo's dead band cause errors of a few counts."""


def report_moves(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, upper_rad: JointVector, report: DeviceReport
) -> None:
    """Move the joints one by one, starting with the last, until one does not follow. Always stop the arm at the end."""
    behind_rad = 0.0
    try:
        for joint in reversed(range(len(upper_rad))):
            text, remedy, lag_rad = _step(arm, encoder, clock, joint, upper_rad[joint])
            report.judge(Topic.MOVE, not remedy, f"joint {joint + 1} {text}", remedy)
            if remedy:
                return
            behind_rad = max(behind_rad, lag_rad)
        lag_ms = 1e3 * behind_rad / STEP_RAD * _RAMP_TICKS / CONTROL_RATE_HZ
        report.facts["lag"] = f"{lag_ms:.0f} ms at most, for [rig] arm_lag_ms"
    finally:
        arm.stop()


def _step(arm: ArmCommand, encoder: JointEncoder, clock: Clock, joint: int, upper_rad: float) -> tuple[str, str, float]:
    """Move a joint; return a description of its motion, a remedy if it does not follow, and its maximum lag."""
    start = encoder.read().position_rad
    step = STEP_RAD if start[joint] + STEP_RAD < upper_rad else -STEP_RAD
    there, lag = _go(arm, encoder, clock, start, joint, (0.0, step))
    back, _ = _go(arm, encoder, clock, start, joint, (step, 0.0))
    moved, left = there[joint] - start[joint], back[joint] - start[joint]
    aside = max((abs(q - s) for i, (q, s) in enumerate(zip(there, start, strict=True)) if i != joint), default=0.0)
    text = f"made {1e3 * moved:+.3f} of {1e3 * step:+.0f} mrad, {1e3 * lag:.3f} mrad behind at most"
    wrong_size = abs(moved - step) > _GOOD_RAD
    if moved * step < 0.0 and abs(moved) > _GOOD_RAD:
        return text, "correct the sign of its counts before anything else moves", lag
    if wrong_size and abs(moved) > _GOOD_RAD and abs(left) <= _GOOD_RAD:
        return text, f"correct its counts per radian, by the factor {moved / step:.2f}", lag
    if wrong_size or abs(left) > _GOOD_RAD:
        return text, "check gains, brake and motor supply of that joint", lag
    if aside > _GOOD_RAD:
        return f"{text}, and another joint {aside * 1e3:.3f} mrad", "correct transmission and order of the axes", lag
    return text, "", lag


def _go(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, start: JointVector, joint: int, way: tuple[float, float]
) -> tuple[JointVector, float]:
    """Move a joint; return the arm's final pose and the maximum difference between set-point and joint angle."""
    begin_ns, most = clock.now_ns(), 0.0
    for tick in range(_RAMP_TICKS + _WAIT_TICKS):
        clock.sleep_until(begin_ns + tick * 1_000_000_000 // CONTROL_RATE_HZ)
        at = way[0] + min(1.0, (tick + 1) / _RAMP_TICKS) * (way[1] - way[0])
        applied = arm.send(JointCommand((*start[:joint], start[joint] + at, *start[joint + 1 :])))
        if applied.reason in (CommandReason.STOPPED, CommandReason.POSITION_LIMIT):
            raise DeviceError("arm", f"the step was held back: {applied.reason.value}")
        sample = encoder.read()
        if sample.validity is not Validity.VALID:
            raise DeviceError("arm", f"the joint sample is {sample.validity.value} during the step")
        most = max(most, abs(sample.position_rad[joint] - applied.position_rad[joint]))
    return encoder.read().position_rad, most


def report_pose(
    position_rad: JointVector, lower_rad: JointVector, upper_rad: JointVector, report: DeviceReport
) -> None:
    """Check that the joint angles match the arm's model."""
    report.facts["joints"] = f"{', '.join(f'{angle:+.4f}' for angle in position_rad)} rad"
    fits = len(position_rad) == len(lower_rad)
    text = f"{len(position_rad)} joint angles, the model of the arm has {len(lower_rad)}"
    report.judge(Topic.JOINTS, fits, text, "name the arm's model in the rig file: [arm] name or urdf")
    if not fits:
        return
    limits = zip(position_rad, lower_rad, upper_rad, strict=True)
    beyond = [str(i + 1) for i, (angle, lower, upper) in enumerate(limits) if not lower <= angle <= upper]
    text = f"joints beyond the limits of the model: {', '.join(beyond) or 'none'}"
    remedy = "correct zero and sign of these joints, or move them back by hand"
    report.judge(Topic.LIMITS, not beyond, text, remedy)
