"""A Zebra Zero on its NMC bus. Its servos are never switched on here."""

from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import at_rate, judge_cycles, rate_Hz, spread_of
from palpate.core.ports import Clock
from palpate.drivers.nmc import Aux, BusStatistics, NmcStatus, Reply
from palpate.drivers.zebra_zero import Fault, FaultKind, ZebraMeasured, ZebraZero, fault_in

_CABLE: Final = "check cable, termination and ground, and that no other program talks on this bus; or lower the baud"
_LOST_SHARE: Final = 0.001


def tell_modules(arm: ZebraZero, notes: Notebook) -> None:
    """Who the modules are."""
    kinds = sorted({module.identity.name for module in arm.modules})
    notes.fact("modules", f"{len(arm.modules)}, addresses 1 to {len(arm.modules)}: {'; '.join(kinds)}")
    notes.fact("line", f"{arm.baud} baud")
    notes.fact("woken by us", "yes: they came out of a reset" if arm.was_reset else "no: they still had addresses")
    notes.fact("set-points by", arm.streaming.value)
    if len(kinds) > 1:
        notes.note(
            "the modules have different firmware", "see that set-points reach all of them: palpate doctor --move"
        )
    else:
        notes.ok(f"{len(arm.modules)} servo modules answer at {arm.baud} baud")
    if not arm.keeps_counts:
        remedy = '[arm] counts_file = "zebra.counts.json" keeps the counters from run to run'
        notes.note("the next program finds the modules awake and their counters without meaning", remedy)


def examine_zebra(arm: ZebraZero, clock: Clock, seconds: float, notes: Notebook) -> None:
    """Line, budget and axes, by cycles without a set-point."""
    notes.fact("state", arm.state.value if arm.fault is None else f"{arm.state.value}: {arm.fault}")
    cycles: list[ZebraMeasured] = []
    late_ns: list[int] = []
    before = arm.statistics
    try:
        at_rate(clock, arm.settings.rate_Hz, seconds, lambda: cycles.append(arm.cycle()), late_ns)
    finally:
        _line(before, arm, notes)
        if cycles:
            _axes(arm, cycles[-1], notes)
        _budget(arm, cycles, late_ns, notes)


def _line(before: BusStatistics, arm: ZebraZero, notes: Notebook) -> None:
    now = arm.statistics
    exchanges = now.exchanges - before.exchanges
    if (spread := spread_of(now.round_trips_ns)) is not None:
        notes.fact("round trip", f"{spread}, one axis")
    lost = {why: count - before.discarded.get(why, 0) for why, count in now.discarded.items()}
    told = ", ".join(f"{count} {why.value}" for why, count in lost.items() if count) or "none lost"
    stray, resyncs = now.stray_bytes - before.stray_bytes, now.resyncs - before.resyncs
    notes.fact("replies", f"{exchanges} asked for, {told}; {stray} stray bytes, {resyncs} resyncs")
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
    notes.fact("adapter latency", told)
    if extra_ms > told_ms + 0.5:
        remedy = f"set the adapter's latency timer to 1 ms, or write [arm] adapter_latency_ms = {extra_ms:.1f}"
        notes.wrong(f"the adapter adds {extra_ms:.2f} ms, the budget reckons with {told_ms:.2f} ms", remedy)
    else:
        notes.ok(f"the adapter adds {extra_ms:.2f} ms, the budget reckons with {told_ms:.2f} ms")


def _budget(arm: ZebraZero, cycles: list[ZebraMeasured], late_ns: list[int], notes: Notebook) -> None:
    late, budget = spread_of(late_ns), arm.settings.budget()
    took = spread_of([cycle.end_ns - cycle.begin_ns for cycle in cycles])
    if took is None or late is None:
        return
    notes.fact("cycle", f"{took}; computed {1e3 * budget.cycle_s:.2f} ms")
    reserve = arm.settings.reserve
    highest = (1.0 - reserve) * 1e3 / took.p99_ms
    told = f"computed {budget.max_rate_Hz:.1f} Hz at most, measured {highest:.1f} Hz ({reserve:.0%} left free)"
    slow = f"cycles take {took.p99_ms:.2f} ms (99 %)"
    got = rate_Hz([cycle.begin_ns for cycle in cycles])
    remedy = "a higher baud, or an adapter with less latency"
    judge_cycles((arm.settings.rate_Hz, got, late), highest, told, slow, remedy, notes)


def _axes(arm: ZebraZero, last: ZebraMeasured, notes: Notebook) -> None:
    settings, limits = arm.settings, arm.settings.limits
    rows = []
    for i, module in enumerate(arm.modules):
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
