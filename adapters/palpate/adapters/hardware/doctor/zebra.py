"""A Zebra Zero on its NMC bus. Its servos are never switched on here."""

from __future__ import annotations

from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import at_rate, rate_Hz, spread_of
from palpate.core.ports import CONTROL_RATE_HZ, Clock
from palpate.drivers.nmc import Aux, BusStatistics, NmcStatus, Reply
from palpate.drivers.zebra_zero import Fault, FaultKind, ZebraMeasured, ZebraZero, fault_in

_CABLE: Final = "check cable, termination and ground, and that no other program talks on this bus; or lower the baud"
_LOST_SHARE: Final = 0.001


def tell_modules(arm: ZebraZero, notes: Notebook) -> None:
    """Who the modules are."""
    report = arm.report
    kinds = sorted({module.identity.name for module in report.modules})
    notes.fact("modules", f"{len(report.modules)}, addresses 1 to {len(report.modules)}: {'; '.join(kinds)}")
    notes.fact("line", f"{report.baud} baud", report.baud)
    notes.fact("woken by us", "yes: they came out of a reset" if arm.was_reset else "no: they still had addresses")
    notes.fact("set-points by", report.streaming.value, report.streaming.value)
    if len(kinds) > 1:
        notes.note(
            "the modules have different firmware", "see that set-points reach all of them: palpate doctor --move"
        )
    else:
        notes.ok(f"{len(report.modules)} servo modules answer at {report.baud} baud")
    if not arm.keeps_counts:
        remedy = '[arm] counts_file = "zebra.counts.json" keeps the counters from run to run'
        notes.note("the next program finds the modules awake and their counters without meaning", remedy)


def examine_zebra(arm: ZebraZero, clock: Clock, seconds: float, notes: Notebook) -> None:
    """Line, budget and axes, by cycles without a set-point."""
    report = arm.report
    notes.fact("state", report.state.value if report.fault is None else f"{report.state.value}: {report.fault}")
    cycles: list[ZebraMeasured] = []
    late_ns: list[int] = []
    before = report.statistics
    try:
        at_rate(clock, arm.settings.rate_Hz, seconds, lambda: cycles.append(arm.cycle()), late_ns)
    finally:
        _line(before, arm, notes)
        if cycles:
            _axes(arm, cycles[-1], notes)
        _budget(arm, cycles, late_ns, notes)


def _line(before: BusStatistics, arm: ZebraZero, notes: Notebook) -> None:
    now = arm.report.statistics
    exchanges = now.exchanges - before.exchanges
    if (spread := spread_of(now.round_trips_ns)) is not None:
        notes.fact("round trip", f"{spread}, one axis", spread.median_ms)
    lost = {why: count - before.discarded.get(why, 0) for why, count in now.discarded.items()}
    told = ", ".join(f"{count} {why.value}" for why, count in lost.items() if count) or "none lost"
    stray, resyncs = now.stray_bytes - before.stray_bytes, now.resyncs - before.resyncs
    notes.fact("replies", f"{exchanges} asked for, {told}; {stray} stray bytes, {resyncs} resyncs", exchanges)
    errors = sum(lost.values())
    if errors > _LOST_SHARE * max(exchanges, 1):
        notes.wrong(f"{errors} of {exchanges} replies were lost or damaged", _CABLE)
    elif exchanges:
        notes.ok(f"{errors} of {exchanges} replies were lost or damaged")
    if stray:
        notes.wrong(f"{stray} bytes came that nobody had asked for", _CABLE)
    if exchanges:
        _latency(before, now, exchanges, arm, notes)


def _latency(before: BusStatistics, now: BusStatistics, exchanges: int, arm: ZebraZero, notes: Notebook) -> None:
    beyond_s = (now.waiting_s - before.waiting_s) - (now.wire_s - before.wire_s)
    extra_ms = max(0.0, 1e3 * beyond_s / exchanges)
    bus = arm.settings.bus
    told_ms = 1e3 * (bus.adapter_latency_s + bus.turnaround_s)
    own_ms = 1e3 * (now.own_s - before.own_s) / exchanges
    told = (
        f"{extra_ms:.2f} ms an exchange beyond the bytes' own time, adapter and module together; "
        f"the settings say {told_ms:.2f} ms; our own part {own_ms:.2f} ms"
    )
    notes.fact("adapter latency", told, extra_ms)
    if extra_ms > told_ms + 0.5:
        remedy = f"set the adapter's latency timer to 1 ms, or write [arm] adapter_latency_ms = {extra_ms:.1f}"
        notes.wrong(f"the adapter adds {extra_ms:.2f} ms, the budget reckons with {told_ms:.2f} ms", remedy)
    else:
        notes.ok(f"the adapter adds {extra_ms:.2f} ms, the budget reckons with {told_ms:.2f} ms")


def _budget(arm: ZebraZero, cycles: list[ZebraMeasured], late_ns: list[int], notes: Notebook) -> None:
    report, late = arm.report, spread_of(late_ns)
    took = spread_of([cycle.end_ns - cycle.begin_ns for cycle in cycles])
    if took is None or late is None:
        return
    wanted, got = arm.settings.rate_Hz, rate_Hz([cycle.begin_ns for cycle in cycles])
    notes.fact("cycle", f"{took}; computed {1e3 * report.budget.cycle_s:.2f} ms", took.median_ms)
    notes.fact("jitter", f"cycles begin late by {late}", late.median_ms)
    notes.fact("cycle rate", f"{got:.1f} Hz, asked for {wanted:.1f} Hz", got)
    highest = (1.0 - arm.settings.reserve) * 1e3 / took.p99_ms
    fits = next((k for k in range(1, CONTROL_RATE_HZ) if CONTROL_RATE_HZ / k <= highest), CONTROL_RATE_HZ)
    told = (
        f"computed {report.budget.max_rate_Hz:.1f} Hz at most, measured {highest:.1f} Hz "
        f"({arm.settings.reserve:.0%} left free); divider = {fits} fits, {CONTROL_RATE_HZ / fits:.1f} Hz"
    )
    notes.fact("budget", told, fits)
    notes.judge(
        got > 0.97 * wanted and highest >= wanted,
        f"{wanted:.1f} Hz fit the bus",
        f"{wanted:.1f} Hz do not fit: cycles take {took.p99_ms:.2f} ms (99 %), {got:.1f} Hz were achieved",
        f"[arm] divider = {fits}, a higher baud, or an adapter with less latency",
    )


def _axes(arm: ZebraZero, last: ZebraMeasured, notes: Notebook) -> None:
    settings, limits = arm.settings, arm.settings.limits
    rows = []
    for i, module in enumerate(arm.report.modules):
        status, aux = last.status[i], last.aux[i]
        servo = "?" if aux is None else "on" if aux & Aux.SERVO_ON else "off"
        power = "on" if status & NmcStatus.POWER_ON else "OFF"
        inside = f"{limits.lower_rad[i]:.2f} to {limits.upper_rad[i]:.2f}"
        row = (str(module.address), module.identity.name, servo, power, _bits(status, servo), f"{last.counts[i]}")
        rows.append((*row, f"{last.position_rad[i]:+.4f}", inside))
    columns = ("axis", "module", "servo", "supply", "bits", "motor counts", "joint (rad)", "limits (rad)")
    notes.table(columns, tuple(rows))
    faults = [_fault(arm, last, i) for i in range(len(rows))]
    joint = limits.outside(last.position_rad, settings.limit_tolerance_rad)
    if joint is not None:
        faults.append(Fault(FaultKind.OUT_OF_LIMITS, None, f"joint {joint + 1} at {last.position_rad[joint]:.4f} rad"))
    shown = [fault for fault in faults if fault is not None]
    for fault in shown:
        notes.wrong(str(fault), fault.error().remedy)
    if not shown:
        notes.ok("no axis reports a fault, and every joint is within its limits")


def _fault(arm: ZebraZero, last: ZebraMeasured, i: int) -> Fault | None:
    status, aux = last.status[i], last.aux[i]
    is_on = bool(aux and aux & Aux.SERVO_ON)
    if arm.settings.require_power and not status & NmcStatus.POWER_ON:
        return Fault(FaultKind.POWER_LOST, i + 1)
    return fault_in(i + 1, Reply(status=status, aux=aux), arm.settings, should_be_on=is_on)


def _bits(status: NmcStatus, servo: str) -> str:
    told = status & ~(NmcStatus.MOVE_DONE | NmcStatus.POWER_ON)
    if servo == "off":
        # A servo that is off always shows one.
        told &= ~NmcStatus.POS_ERROR
    return (told.name or hex(told)).lower() if told else "-"
