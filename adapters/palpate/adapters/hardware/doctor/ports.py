"""What the ports alone show: a force sensor's noise and range, joint encoders, and whether the arm follows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot
from statistics import fmean, pstdev
from typing import Final, TypeVar

from palpate.adapters.hardware.doctor.facts import MeasuredNoise
from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import distances, rate_Hz, spread_of
from palpate.core.errors import DeviceError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    ArmCommand,
    Clock,
    CommandReason,
    ForceSensor,
    JointCommand,
    JointEncoder,
    JointSample,
    JointVector,
    Validity,
    Vector3,
    WrenchSample,
)

CHANNELS: Final = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_UNITS: Final = ("N",) * 3 + ("N m",) * 3
_STILL_N: Final = 1.0
"""Standard deviation above which something moves, or disturbs. A choice; the paper's contact threshold is above it."""


@dataclass(frozen=True)
class WrenchReading:
    """One reading, whichever adapter it came through."""

    force_N: Vector3
    torque_Nm: Vector3
    time_ns: int
    near_saturation: bool


def examine_wrench(
    readings: Sequence[WrenchReading], notes: Notebook, full_scales: Sequence[float] = (), resolution: float = 0.0
) -> MeasuredNoise | None:
    """Offsets, noise and saturation; what was measured of the noise, if anything.

    Args:
        full_scales: N and N m at full scale, (6,), where known.
        resolution: Offsets smaller than this, in N and N m, count as zero.
    """
    if len(readings) < 2:
        notes.wrong(f"only {len(readings)} readings in all this time", "check cable and power, then try again")
        return None
    series = list(zip(*((*r.force_N, *r.torque_Nm) for r in readings), strict=True))
    means, sigmas = [fmean(s) for s in series], [pstdev(s) for s in series]
    peaks = [max(max(s), -min(s)) for s in series]
    rows = []
    for i, (name, unit) in enumerate(zip(CHANNELS, _UNITS, strict=True)):
        row = (name, f"{means[i]:+.3f} {unit}", f"{sigmas[i]:.4f} {unit}", f"{peaks[i]:.3f} {unit}")
        share = (f"{full_scales[i]:g} {unit}", f"{peaks[i] / full_scales[i]:.0%}") if full_scales else ()
        rows.append((*row, *share))
    columns = ("channel", "offset", "noise (sigma)", "peak")
    notes.table((*columns, *(("full scale", "peak of it") if full_scales else ())), tuple(rows))
    _judge_range(readings, notes)
    _judge_noise(means, sigmas, notes, resolution)
    return MeasuredNoise(max(sigmas[:3]), max(sigmas[3:]), rate_Hz([reading.time_ns for reading in readings]))


def _judge_range(readings: Sequence[WrenchReading], notes: Notebook) -> None:
    near = sum(reading.near_saturation for reading in readings)
    notes.judge(
        near == 0,
        "no reading is near the end of the range",
        f"{near} of {len(readings)} readings are near the end of the range (saturation)",
        "take the load off the tool; if that does not help, the sensor is overloaded, or its cable is damaged",
    )


def _judge_noise(means: Sequence[float], sigmas: Sequence[float], notes: Notebook, resolution: float) -> None:
    force = hypot(*sigmas[:3])
    if max(sigmas) == 0.0:
        remedy = "switch the sensor's board off and on; check the cable between sensor and board"
        notes.wrong("every reading is the same to the last bit: the sensor seems dead", remedy)
    elif force > _STILL_N:
        remedy = "leave the tool alone and let the arm rest; if it stays, look at shield, ground and cut-off"
        notes.note(f"the force wanders by {force:.2f} N (sigma)", remedy)
    else:
        notes.ok(f"the force is still to {force:.3f} N (sigma)")
    if resolution and max(map(abs, means)) < resolution:
        remedy = "with a tool on it this firmware zeroes at each start: begin every run with the tool free"
        notes.note("all offsets are zero, though a sensor with a tool on it carries its weight", remedy)


_Sample = TypeVar("_Sample", WrenchSample, JointSample)
_POLL_NS = 1_000_000
_SILENT = "check cable and power, and the adapter's own settings"


def examine_force_sensor(sensor: ForceSensor, clock: Clock, seconds: float, notes: Notebook) -> MeasuredNoise | None:
    """Rate, marks, noise of an active force sensor."""
    found = _heard(sensor.read, clock, seconds, notes)
    readings = [
        WrenchReading(s.force_N, s.torque_Nm, s.receive_time_ns, s.validity is Validity.SATURATED)
        for s in found
        if s.validity is not Validity.INVALID
    ]
    return examine_wrench(readings, notes)


def examine_encoder(
    encoder: JointEncoder, clock: Clock, seconds: float, lower_rad: JointVector, upper_rad: JointVector, notes: Notebook
) -> None:
    """Rate, marks and pose of active joint encoders."""
    found = _heard(encoder.read, clock, seconds, notes)
    pose = found[-1].position_rad if found else ()
    if len(pose) != len(lower_rad):
        remedy = "--arm names the kinematic model: palpate doctor --help"
        notes.wrong(f"{len(pose)} joint angles, the kinematic model has {len(lower_rad)}", remedy)
        return
    rows = tuple(
        (str(i + 1), f"{angle:+.4f}", f"{lower:.2f} to {upper:.2f}")
        for i, (angle, lower, upper) in enumerate(zip(pose, lower_rad, upper_rad, strict=True))
    )
    notes.table(("axis", "joint (rad)", "limits (rad)"), rows)
    beyond = [
        i + 1 for i, (q, a, b) in enumerate(zip(pose, lower_rad, upper_rad, strict=True)) if not a <= q <= b
    ]  # fmt: skip
    notes.judge(
        not beyond,
        "every joint is within its limits",
        f"joints {', '.join(map(str, beyond))} are beyond the limits of the model",
        "mend the adapter's zero and sign of these joints, or move them back by hand",
    )


def _heard(read: Callable[[], _Sample], clock: Clock, seconds: float, notes: Notebook) -> list[_Sample]:
    """Different samples that came in that time; how they came goes into the notes."""
    samples: dict[int, _Sample] = {}
    reads = stale = 0
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while (now_ns := clock.now_ns()) < end_ns:
        sample = read()
        reads, stale = reads + 1, stale + (sample.validity is Validity.STALE)
        samples.setdefault(sample.sequence, sample)
        clock.sleep_until(now_ns + _POLL_NS)
    found = list(samples.values())
    _tell_samples(found, reads, stale, notes)
    return found


def _tell_samples(samples: Sequence[WrenchSample | JointSample], reads: int, stale: int, notes: Notebook) -> None:
    times = [sample.receive_time_ns for sample in samples]
    got, spread = rate_Hz(times), spread_of(distances(times))
    notes.fact("samples", f"{len(samples)} in {reads} reads, {got:.1f} Hz, {stale} reads were stale")
    if spread is not None:
        notes.fact("between samples", str(spread))
    invalid = sum(sample.validity is Validity.INVALID for sample in samples)
    if stale:
        notes.wrong(f"{stale} of {reads} reads brought stale samples", _SILENT)
    if invalid:
        notes.wrong(f"{invalid} of {len(samples)} samples are marked invalid", _SILENT)
    if got < CONTROL_RATE_HZ / 2:
        notes.note(f"samples come at {got:.1f} Hz only, the control loop runs at {CONTROL_RATE_HZ} Hz", _SILENT)
    elif not stale and not invalid:
        notes.ok(f"samples come at {got:.1f} Hz")


STEP_RAD: Final = 1e-3
"""The step of each joint."""
_RAMP_TICKS: Final = CONTROL_RATE_HZ // 2
_WAIT_TICKS: Final = CONTROL_RATE_HZ // 2
_GOOD_RAD: Final = 0.25 * STEP_RAD
"""Error that is accepted at rest: friction and the servo's dead band leave some counts. A choice."""


def examine_following(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, upper_rad: JointVector, notes: Notebook
) -> None:
    """Move each joint by :data:`STEP_RAD` and back, the last one first, up to the first that does not follow.

    The arm is stopped on every way out.
    """
    rows: list[tuple[str, ...]] = []
    try:
        for joint in reversed(range(len(upper_rad))):
            row, remedy = _step(arm, encoder, clock, joint, upper_rad[joint])
            rows.append(row)
            if remedy:
                notes.wrong(f"joint {joint + 1} does not follow", remedy)
                break
        else:
            notes.ok("every joint follows in direction and size")
    finally:
        arm.stop()
        notes.table(("joint", "asked (mrad)", "made", "left after the way back", "lag at most", "others"), tuple(rows))


def _step(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, joint: int, upper_rad: float
) -> tuple[tuple[str, ...], str]:
    """Return what became of a joint's step, and a remedy where it does not follow."""
    start = encoder.read().position_rad
    step = STEP_RAD if start[joint] + STEP_RAD < upper_rad else -STEP_RAD
    there, most = _go(arm, encoder, clock, start, joint, 0.0, step)
    back, most_back = _go(arm, encoder, clock, start, joint, step, 0.0)
    moved, left = there[joint] - start[joint], back[joint] - start[joint]
    aside = max((abs(q - s) for i, (q, s) in enumerate(zip(there, start, strict=True)) if i != joint), default=0.0)
    figures = (f"{1e3 * value:+.3f}" for value in (step, moved, left, max(most, most_back), aside))
    remedy = ""
    if moved * step < 0.0 and abs(moved) > _GOOD_RAD:
        remedy = "it turned the other way: correct the sign of its counts, before anything else moves"
    elif abs(moved - step) > _GOOD_RAD and abs(moved) > _GOOD_RAD and abs(left) <= _GOOD_RAD:
        remedy = f"it made {moved / step:.2f} times the step: correct its counts per radian"
    elif abs(moved - step) > _GOOD_RAD or abs(left) > _GOOD_RAD:
        remedy = "look at gains, brake and motor supply of that joint"
    elif aside > _GOOD_RAD:
        remedy = (
            f"another joint moved along by {aside * 1e3:.3f} mrad: correct the transmission in the adapter's settings"
            " (coupled wrist, order of the axes)"
        )
    return (str(joint + 1), *figures), remedy


def _go(
    arm: ArmCommand, encoder: JointEncoder, clock: Clock, start: JointVector, joint: int, begin: float, end: float
) -> tuple[JointVector, float]:
    """Return where the arm is in the end, and the largest distance on the way between set-point and joint."""
    begin_ns, most = clock.now_ns(), 0.0
    for tick in range(_RAMP_TICKS + _WAIT_TICKS):
        clock.sleep_until(begin_ns + tick * 1_000_000_000 // CONTROL_RATE_HZ)
        at = begin + min(1.0, (tick + 1) / _RAMP_TICKS) * (end - begin)
        applied = arm.send(JointCommand((*start[:joint], start[joint] + at, *start[joint + 1 :])))
        if applied.reason in (CommandReason.STOPPED, CommandReason.POSITION_LIMIT):
            raise DeviceError("arm", f"the step was held back: {applied.reason.value}")
        sample = encoder.read()
        if sample.validity is not Validity.VALID:
            raise DeviceError("arm", f"the joint sample is {sample.validity.value} during the step")
        most = max(most, abs(sample.position_rad[joint] - applied.position_rad[joint]))
    return encoder.read().position_rad, most
