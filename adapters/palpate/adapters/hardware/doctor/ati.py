"""ATI's Net F/T."""

from typing import Final

from palpate.adapters.hardware.ati import NetFtForceSensor
from palpate.adapters.hardware.doctor.facts import MeasuredNoise
from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.jr3 import judge_rate, listen
from palpate.adapters.hardware.doctor.ports import examine_wrench
from palpate.core.ports import Clock

_CABLE: Final = "connect box and computer directly, or through one switch that carries nothing else"


def examine_netft(sensor: NetFtForceSensor, clock: Clock, seconds: float, notes: Notebook) -> MeasuredNoise | None:
    """How the box is set, its rate, what was lost on the way, noise. The sensor is active."""
    device = sensor.opened()
    box = device.box
    notes.fact("identity", f"calibration {box.calibration}, firmware {box.firmware}")
    forces, torques = (", ".join(f"{most:g}" for most in ranges) for ranges in (box.range_N, box.range_Nm))
    notes.fact("full scales", f"{forces} N; {torques} N m")
    readings, _ = listen(device, clock, seconds)
    found = device.statistics
    told = (
        f"{found.samples} new, {found.lost} lost, {found.late} late, {found.repeated} repeated,"
        f" {found.unchanged} under a new number with the sample of before; {found.malformed} datagrams were none"
    )
    notes.fact("records", told)
    judge_rate(
        readings, box.rate_Hz, "set the RDT output rate on the box's page Communications, or look at lost ones", notes
    )
    astray = found.lost + found.late + found.repeated
    told = f"{astray} of {found.samples} records were lost, late or repeated"
    notes.judge(astray <= 0.01 * found.samples, told, told, _CABLE)
    return examine_wrench(
        readings, notes, (*box.range_N, *box.range_Nm), 2.0 / min(box.counts_per_N, box.counts_per_Nm)
    )
