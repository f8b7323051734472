"""Devices of strangers' adapters, of which only the ports are known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import distances, rate_Hz, spread_of
from palpate.adapters.hardware.doctor.wrench import WrenchReading, examine_wrench
from palpate.core.ports.devices import Clock, ForceSensor, JointEncoder
from palpate.core.ports.values import CONTROL_RATE_HZ, JointSample, JointVector, Validity, WrenchSample

_Sample = TypeVar("_Sample", WrenchSample, JointSample)
_POLL_NS = 1_000_000
_SILENT = "check cable and power, and the adapter's own settings"


def examine_force_sensor(sensor: ForceSensor, clock: Clock, seconds: float, notes: Notebook) -> None:
    """Rate, marks, noise of an active force sensor.

    Args:
        sensor: Active.
        clock: The run's clock.
        seconds: How long to listen.
        notes: Where it goes.
    """
    found = _heard(sensor.read, clock, seconds, notes)
    readings = [
        WrenchReading(s.force_N, s.torque_Nm, s.receive_time_ns, s.validity is Validity.SATURATED)
        for s in found
        if s.validity is not Validity.INVALID
    ]
    examine_wrench(readings, notes)


def examine_encoder(
    encoder: JointEncoder, clock: Clock, seconds: float, lower_rad: JointVector, upper_rad: JointVector, notes: Notebook
) -> None:
    """Rate, marks and pose of active joint encoders.

    Args:
        encoder: Active.
        clock: The run's clock.
        seconds: How long to listen.
        lower_rad: Lower joint limits of the kinematic model, (n,).
        upper_rad: Upper ones, (n,).
        notes: Where it goes.
    """
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
    notes.fact("samples", f"{len(samples)} in {reads} reads, {got:.1f} Hz, {stale} reads were stale", got)
    if spread is not None:
        notes.fact("between samples", str(spread), spread.median_ms)
    invalid = sum(sample.validity is Validity.INVALID for sample in samples)
    if stale:
        notes.wrong(f"{stale} of {reads} reads brought stale samples", _SILENT)
    if invalid:
        notes.wrong(f"{invalid} of {len(samples)} samples are marked invalid", _SILENT)
    if got < CONTROL_RATE_HZ / 2:
        notes.note(f"samples come at {got:.1f} Hz only, the control loop runs at {CONTROL_RATE_HZ} Hz", _SILENT)
    elif not stale and not invalid:
        notes.ok(f"samples come at {got:.1f} Hz")
