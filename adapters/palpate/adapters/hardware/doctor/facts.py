"""Compares the facts of a force sensor with what was measured, and gives the line for the rig file."""

from typing import Final

from palpate.adapters.config import SensorFactsTable
from palpate.adapters.hardware.doctor.findings import DeviceReport, Level, Topic
from palpate.adapters.hardware.doctor.measure import MeasuredNoise
from palpate.adapters.hardware.sensor_facts import gathered, missing_facts
from palpate.core.errors import ConfigurationError

_FACTOR: Final = 2.0
"""Measured and stated noise may differ by it: noise depends on what runs nearby."""
_BY_HAND: Final = "[x, y, z]"


def report_facts(
    stated: SensorFactsTable, reported: SensorFactsTable, measured: MeasuredNoise, report: DeviceReport
) -> None:
    """Judge whether a run knows enough of the sensor, and whether that agrees with the measurement."""
    missing = missing_facts(stated, reported)
    remedy = f"below [force_sensor] write {facts_line(missing or ('noise_N', 'noise_Nm'), measured)}"
    if missing:
        text = f"neither rig file nor sensor states {', '.join(missing)}, without which no run begins"
        report.add(Level.WRONG, Topic.FACTS, text, remedy)
        return
    try:
        facts = gathered(stated, reported)
    except ConfigurationError as error:
        report.error(error)
        return
    found = ((measured.force_N, facts.noise_N, "N"), (measured.torque_Nm, facts.noise_Nm, "N m"))
    for value, known, unit in found:
        good = known / _FACTOR <= value <= known * _FACTOR
        text = f"measured noise {value:.2g} {unit}, stated {known:g} {unit}"
        report.judge(Topic.FACTS, good, text, f"leave the tool alone and try again; if it stays, {remedy}")


def facts_line(names: tuple[str, ...], measured: MeasuredNoise) -> str:
    """Return the line of a rig file that states these facts."""
    values = {
        "noise_N": f"{measured.force_N:.2g}",
        "noise_Nm": f"{measured.torque_Nm:.2g}",
        "rate_Hz": f"{measured.rate_Hz:.3g}",
    }
    entries = ", ".join(f"{name} = {values.get(name, _BY_HAND)}" for name in names)
    by_hand = " (x, y, z: from the data sheet)" if _BY_HAND in entries else ""
    return f"facts = {{ {entries} }}{by_hand}"
