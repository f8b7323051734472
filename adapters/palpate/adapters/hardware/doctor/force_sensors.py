"""Force sensors whose drivers are polled: a JR3, ATI's Net F/T, the tool force of Universal Robots."""

from typing import Final

from palpate.adapters.hardware.ati import NetFtForceSensor
from palpate.adapters.hardware.doctor.facts import MeasuredNoise
from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import distances, rate_Hz, spread_of
from palpate.adapters.hardware.doctor.ports import WrenchReading, examine_wrench
from palpate.adapters.hardware.jr3 import Jr3ForceSensor
from palpate.adapters.hardware.ur import UrToolForceSensor
from palpate.core.ports import CONTROL_RATE_HZ, Clock
from palpate.drivers.device import PolledSensor, listed
from palpate.drivers.jr3 import CAN_TIMING, Jr3Statistics
from palpate.drivers.ur import RANGE_N, RANGE_NM

_POLL_NS: Final = 1_000_000
_DIRECTLY: Final = "and computer directly, or through one switch that carries nothing else"
_QUIETEST_N: Final = 1e-6
_REMEDY: Final = (
    "look at gaps and garbage; on a serial line choose a longer period_us, on CAN see what else fills the bus"
)
_CLUMPED_MS: Final = 3.0
"""What readings may arrive late, usually, before an adapter is suspected. A choice: above a latency timer of 1 ms."""


def examine_jr3(sensor: Jr3ForceSensor, clock: Clock, seconds: float, notes: Notebook) -> MeasuredNoise | None:
    """Identity, rate, counters, noise. The sensor is active."""
    device = sensor.opened()
    identity = device.identity
    scales = identity.full_scales
    newtons, metres = scales.force_N, tuple(moment * 0.1 for moment in scales.moment_dNm)
    asked = sensor.settings
    notes.fact("identity", f"{identity.name}; it has neither serial number nor version to tell")
    notes.fact("full scales", f"{', '.join(map(str, newtons))} N; {', '.join(f'{m:.1f}' for m in metres)} N m")
    cutoff = f"{identity.cutoff_Hz:g} Hz" if identity.cutoff_Hz else "none"
    notes.fact("filter", f"{cutoff} (asked for {asked.cutoff_Hz:g} Hz)")
    best_us = CAN_TIMING.min_period_us
    told = f"the wire carries a reading every {best_us} us at best, {identity.period_us} us are set"
    notes.fact("budget", f"{told}: {best_us / identity.period_us:.0%}")
    before, before_ns = device.statistics(), clock.now_ns()
    try:
        readings, arrivals = listen(device, clock, seconds)
    finally:
        _counters(device.statistics(), notes)
    after = device.statistics()
    judge_rate(readings, 1e6 / identity.period_us, _REMEDY, notes)
    if identity.period_us * CONTROL_RATE_HZ > 1_000_000:
        remedy = f"period_us = {1_000_000 // CONTROL_RATE_HZ} or less"
        told = f"{1e6 / identity.period_us:.0f} Hz is slower than the control loop's {CONTROL_RATE_HZ} Hz"
        notes.note(told, remedy)
    _arrivals(arrivals, identity.period_us, notes)
    end_ns = clock.now_ns()
    expected = 0.9 * (end_ns - before_ns) / (identity.period_us * 1000)
    whole = after.missed == before.missed and len(readings) > expected
    _silence([before_ns, *arrivals, end_ns], asked.stall_ns, whole, notes)
    _judge_counters(before, after, notes)
    resolution = 2.0 * max(*scales.lsb_N, *scales.lsb_Nm)
    return examine_wrench(readings, notes, (*newtons, *metres), resolution)


def listen(device: PolledSensor, clock: Clock, seconds: float) -> tuple[list[WrenchReading], list[int]]:
    """Readings, and the times at which something arrived."""
    readings: list[WrenchReading] = []
    arrivals: list[int] = []
    # What has waited until now would look like a burst.
    device.poll(clock.now_ns())
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while (now_ns := clock.now_ns()) < end_ns:
        samples = device.poll(now_ns)
        if device.failure is not None:
            raise device.failure
        if samples:
            arrivals.append(now_ns)
        for s in samples:
            near = s.saturated or s.near_saturated or s.over_range
            readings.append(WrenchReading(s.force_N, s.torque_Nm, s.receive_time_ns, near))
        clock.sleep_until(now_ns + _POLL_NS)
    return readings, arrivals


def _counters(now: Jr3Statistics, notes: Notebook) -> None:
    wire = now.wire
    if (trips := spread_of(now.round_trips_ns)) is not None:
        told = f"{trips.min_ms:.1f} / {trips.median_ms:.1f} / {trips.max_ms:.1f} ms"
        notes.fact("round trip", f"{told} (min / median / max) from request to answer")
    told = f"{now.samples}, {now.missed} missed in {now.gaps} gaps, {now.duplicates} duplicates, {now.doubted} doubted"
    notes.fact("readings", told)
    told = (
        f"{wire.good} frames understood, {wire.garbage} garbage, {wire.foreign} of others, "
        f"{wire.orphans} halves alone, {wire.send_failures} not sent, {wire.bus_offs} bus-offs"
    )
    notes.fact("traffic", told)
    told = f"{now.boots} boots, {now.restarts} restarts, {now.timeouts} requests timed out, {now.strays} stray answers"
    notes.fact("board", told)


def judge_rate(readings: list[WrenchReading], wanted_Hz: float, remedy: str, notes: Notebook) -> None:
    """Whether readings come as often as they should."""
    got = rate_Hz([reading.time_ns for reading in readings])
    notes.fact("rate", f"{got:.1f} Hz, asked for {wanted_Hz:.1f} Hz")
    notes.judge(
        got > 0.9 * wanted_Hz,
        f"readings come at {got:.1f} Hz",
        f"readings come at {got:.1f} Hz instead of {wanted_Hz:.1f} Hz",
        remedy,
    )


def _arrivals(arrivals: list[int], period_us: int, notes: Notebook) -> None:
    spread = spread_of(distances(arrivals))
    if spread is None:
        return
    notes.fact("between arrivals", str(spread))
    # Readings held back come in clumps: then arrivals are further apart than readings.
    latency_ms = max(0.0, spread.median_ms - period_us * 1e-3)
    notes.fact("adapter latency", f"about {latency_ms:.1f} ms, from how readings clump")
    if latency_ms > _CLUMPED_MS:
        remedy = "set the latency timer of the USB adapter to 1 ms, or take another adapter"
        notes.wrong(f"readings come in clumps {spread.median_ms:.1f} ms apart", remedy)


def _silence(times_ns: list[int], stall_ns: int, whole: bool, notes: Notebook) -> None:
    longest_ns = max(distances(times_ns))
    if longest_ns > stall_ns and whole:
        told = f"this computer or its adapter held readings up for {longest_ns * 1e-6:.0f} ms; none is missing"
        notes.wrong(
            told, f"end other programs, ask for real-time scheduling; a run ends after {stall_ns * 1e-6:.0f} ms"
        )
    elif longest_ns > stall_ns:
        told = f"the sensor was silent for {longest_ns * 1e-6:.0f} ms, a run ends after {stall_ns * 1e-6:.0f} ms"
        notes.wrong(told, "check cable and power; end other programs that keep this computer busy")


def _judge_counters(before: Jr3Statistics, after: Jr3Statistics, notes: Notebook) -> None:
    garbage = after.wire.garbage - before.wire.garbage
    missed, readings = after.missed - before.missed, after.samples - before.samples
    cable = "check cable, shield and ground; on CAN the termination (60 ohm between CAN_H and CAN_L, power off)"
    notes.judge(garbage == 0, "no garbage on the wire", f"{garbage} frames or bytes made no sense", cable)
    told = f"{missed} readings missing, {readings} came"
    if missed > 0.01 * max(readings, 1):
        notes.wrong(told, cable)
    elif missed:
        notes.note(told, "harmless when rare; the loop takes the newest reading")
    else:
        notes.ok("no reading is missing")
    if after.restarts + after.boots > before.restarts + before.boots:
        notes.wrong("the board has restarted meanwhile", "check its supply voltage and its cable")
    if after.wire.bus_offs:
        notes.wrong(f"{after.wire.bus_offs} bus-offs", cable)


def examine_netft(sensor: NetFtForceSensor, clock: Clock, seconds: float, notes: Notebook) -> MeasuredNoise | None:
    """How the box is set, its rate, what was lost on the way, noise. The sensor is active."""
    device = sensor.opened()
    box, records = device.box, device.records
    notes.fact("identity", f"calibration {box.calibration}")
    notes.fact("full scales", f"{box.range_N} N; {box.range_Nm} N m")
    readings, _ = listen(device, clock, seconds)
    notes.fact("records", listed(records))
    judge_rate(readings, box.rate_Hz, "set the RDT output rate on the box's page Communications", notes)
    astray, new = records["lost"] + records["old"], records["new"]
    found = f"{astray} of {new} records were lost or old"
    notes.judge(astray <= 0.01 * new, found, found, f"connect box {_DIRECTLY}")
    ranges = (*box.range_N, *box.range_Nm)
    return examine_wrench(readings, notes, ranges, 2.0 / min(box.counts_per_N, box.counts_per_Nm))


def examine_tool_force(
    sensor: UrToolForceSensor, clock: Clock, seconds: float, notes: Notebook
) -> MeasuredNoise | None:
    """Rate and noise of the tool force. The sensor is active."""
    device = sensor.opened()
    notes.fact("full scales", f"{RANGE_N[0]:g} N; {RANGE_NM[0]:g} N m, a UR5e's")
    readings, _ = listen(device, clock, seconds)
    # Of packages that came between two looks only the newest is taken; the loop looks so often.
    judge_rate(readings, min(1e9 / sensor.period_ns, float(CONTROL_RATE_HZ)), f"connect controller {_DIRECTLY}", notes)
    return examine_wrench(readings, notes, (*RANGE_N, *RANGE_NM), _QUIETEST_N)
