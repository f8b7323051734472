"""What a force sensor says over a while: channel by channel noise, offset and room to the end of the range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from statistics import fmean, pstdev
from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.core.ports.values import Vector3

CHANNELS: Final = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_UNITS: Final = ("N",) * 3 + ("N m",) * 3
_STILL_N: Final = 1.0
"""Standard deviation above which something moves, or disturbs. A choice; the paper's contact threshold is above it."""


@dataclass(frozen=True)
class WrenchReading:
    """One reading, whichever adapter it came through.

    Attributes:
        force_N: Force, (3,).
        torque_Nm: Torque, (3,).
        time_ns: When the host had it.
        near_saturation: Whether it is near, or at, the end of the range.
    """

    force_N: Vector3
    torque_Nm: Vector3
    time_ns: int
    near_saturation: bool


def examine_wrench(
    readings: Sequence[WrenchReading], notes: Notebook, full_scales: Sequence[float] = (), resolution: float = 0.0
) -> None:
    """Offsets, noise and saturation.

    Args:
        readings: What was read while nobody touched the tool.
        notes: Where it goes.
        full_scales: N and N m at full scale, (6,), where known.
        resolution: Offsets smaller than this, in N and N m, count as zero.
    """
    if len(readings) < 2:
        notes.wrong(f"only {len(readings)} readings in all this time", "check cable and power, then try again")
        return
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
