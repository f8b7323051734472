"""Are the facts of the force sensor known, and do they agree with what was measured? The line for the rig file."""

from dataclasses import dataclass
from typing import Final

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.sensor_facts import gathered, missing_facts
from palpate.core.errors import ConfigurationError

_FACTOR: Final = 2.0
"""Measured and stated noise may differ by it. A choice: noise depends on what runs nearby."""
_BY_HAND: Final = "[x, y, z]"


@dataclass(frozen=True, slots=True)
class MeasuredNoise:
    """What was measured of a sensor while nobody touched the tool."""

    force_N: float
    torque_Nm: float
    rate_Hz: float


def judge_facts(
    stated: SensorFactsTable, reported: SensorFactsTable, measured: MeasuredNoise | None, notes: Notebook
) -> None:
    """Say what is missing, what contradicts what, and what to write.

    Args:
        measured: None where it could not be measured: then that is what has to be mended first.
    """
    if measured is None or min(measured.force_N, measured.torque_Nm) <= 0.0:
        return
    missing = missing_facts(stated, reported)
    remedy = f"below [force_sensor] write: {facts_line(missing or ('noise_N', 'noise_Nm'), measured)}"
    if missing:
        notes.wrong(f"the rig file does not state {', '.join(missing)} of the sensor: no run begins", remedy)
        return
    try:
        facts = gathered(stated, reported)
    except ConfigurationError as error:
        notes.wrong(str(error), "mend the rig file")
        return
    found = (("force", measured.force_N, facts.noise_N, "N"), ("torque", measured.torque_Nm, facts.noise_Nm, "N m"))
    for name, value, told, unit in found:
        notes.judge(
            told / _FACTOR <= value <= told * _FACTOR,
            f"the noise of the {name} is {value:.2g} {unit}, {told:g} {unit} are stated",
            f"the noise of the {name} is {value:.2g} {unit}, the rig file states {told:g} {unit}",
            f"leave the tool alone and try again; if it stays, {remedy}",
        )


def facts_line(names: tuple[str, ...], measured: MeasuredNoise) -> str:
    """The line of a rig file that states these facts; a range stands in the sensor's data sheet."""
    values = {
        "noise_N": f"{measured.force_N:.2g}",
        "noise_Nm": f"{measured.torque_Nm:.2g}",
        "rate_Hz": f"{measured.rate_Hz:.3g}",
    }
    entries = ", ".join(f"{name} = {values.get(name, _BY_HAND)}" for name in names)
    by_hand = " (x, y, z: from the data sheet)" if _BY_HAND in entries else ""
    return f"facts = {{ {entries} }}{by_hand}"
