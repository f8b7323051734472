"""An arm of CiA 402 drives. They get no power here."""

from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.adapters.hardware.doctor.pace import at_rate, judge_cycles, rate_Hz, spread_of
from palpate.core.ports import Clock
from palpate.drivers.cia402 import ArmStatistics, Cia402Arm, DrivesMeasured, DriveState, bits_per_cycle, outside

_CABLE: Final = "check the bus: 60 ohm between CAN_H and CAN_L with the power off, shield, one bit rate for all nodes"
_OTHER_WORK: Final = (
    "end other work on this computer, or on that which emulates the drives; ask for real-time scheduling"
)
_MISSED_SHARE: Final = 0.01


def examine_cia402(arm: Cia402Arm, clock: Clock, seconds: float, notes: Notebook) -> None:
    """Drives, their states, bus, budget; cycles without power."""
    settings = arm.settings
    nodes = [joint.node for joint in settings.joints]
    notes.fact("drives", f"{len(nodes)}, nodes {', '.join(map(str, nodes))}; the host's heartbeat {settings.host_node}")
    notes.fact("bit rate", f"{settings.bitrate} bit/s")
    notes.fact("mode", settings.mode.name)
    for note in arm.notes:
        notes.note(note)
    before = arm.statistics()
    cycles: list[DrivesMeasured] = []
    begun: list[int] = []
    late_ns: list[int] = []

    def turn() -> None:
        begun.append(clock.now_ns())
        cycles.append(arm.cycle())

    try:
        at_rate(clock, float(settings.rate_Hz), seconds, turn, late_ns)
    finally:
        notes.fact("state", arm.state.value if arm.fault is None else f"{arm.state.value}: {arm.fault}")
        _drives(arm, cycles[-1] if cycles else None, notes)
        _traffic(before, arm.statistics(), notes)
        _budget(arm, begun, late_ns, notes)


def _drives(arm: Cia402Arm, last: DrivesMeasured | None, notes: Notebook) -> None:
    rows = []
    faults = 0
    for i, (joint, who) in enumerate(zip(arm.settings.joints, arm.identities, strict=True)):
        state = None if last is None else last.states[i]
        angle = None if last is None else last.position_rad[i]
        rows.append((
            str(joint.node), who.name or "?", _hex(who.vendor), _hex(who.product), _hex(who.revision),
            "?" if who.serial is None else str(who.serial), "?" if state is None else state.value,
            "?" if angle is None else f"{angle:+.4f}", f"{joint.lower_rad:.2f} to {joint.upper_rad:.2f}",
        ))  # fmt: skip
        if state in (DriveState.FAULT, DriveState.FAULT_REACTION):
            faults += 1
            remedy = "look its code up in the drive's manual (object 0x603F), mend the cause, then acknowledge"
            notes.wrong(f"drive {joint.node} is in fault", remedy)
        if angle is not None and outside(angle, joint, arm.settings.pose_margin_rad):
            faults += 1
            remedy = "mend [arm] zero_counts and counts_per_rad, or move the joint back by hand"
            notes.wrong(f"joint {i + 1} stands at {angle:.4f} rad, beyond its limits", remedy)
    columns = ("node", "name", "vendor", "product", "revision", "serial", "state", "joint (rad)", "limits (rad)")
    notes.table(columns, tuple(rows))
    if last is not None and not faults:
        notes.ok("no drive reports a fault, and every joint is within its limits")


def _traffic(before: ArmStatistics, now: ArmStatistics, notes: Notebook) -> None:
    cycles = now.cycles - before.cycles
    old = {node.node: node for node in before.nodes}
    rows = []
    missed = delayed = odd = 0
    for node in now.nodes:
        was = old[node.node]
        lost, late = node.missed - was.missed, node.late - was.late
        twice, bad = node.duplicates - was.duplicates, node.malformed - was.malformed
        emergencies = node.emergencies - was.emergencies
        gap_ms = 1e-6 * node.longest_gap_ns
        rows.append((*map(str, (node.node, lost, late, twice, bad, emergencies)), f"{gap_ms:.0f} ms"))
        # One that comes in the next cycle is its answer, and that one's own a second.
        behind = min(lost, late + twice)
        missed, delayed, odd = missed + lost, delayed + behind, odd + bad + twice - max(behind - late, 0)
    columns = ("node", "missed", "late", "duplicates", "malformed", "emergencies", "longest heartbeat gap")
    notes.table(columns, tuple(rows))
    if missed > _MISSED_SHARE * max(1, cycles * len(rows)):
        is_late = 2 * delayed > missed
        remedy = f"{_OTHER_WORK if is_late else _CABLE}; or a larger [arm] divider"
        notes.wrong(f"{missed} answers missing in {cycles} cycles, {delayed} of them came late", remedy)
    elif cycles:
        notes.ok(f"{missed} answers missing in {cycles} cycles")
    if odd:
        remedy = f"see whether two nodes have the same number, or another program talks; {_CABLE}"
        notes.wrong(f"{odd} answers came twice or had another length", remedy)
    for emergency in now.emergencies:
        if not emergency.clears:
            told = f"drive {emergency.node} sent EMCY 0x{emergency.code:04X}, register 0x{emergency.register:02X}"
            notes.wrong(told, "look the code up in the drive's manual")


def _budget(arm: Cia402Arm, begun: list[int], late_ns: list[int], notes: Notebook) -> None:
    settings, statistics, late = arm.settings, arm.statistics(), spread_of(late_ns)
    trips = spread_of(statistics.round_trips_ns)
    if late is None or trips is None:
        return
    drives = len(settings.joints)
    wire_ms = 1e3 * bits_per_cycle(drives, stuffed=False) / settings.bitrate
    latency_ms = max(0.0, trips.median_ms - wire_ms)
    notes.fact("round trip", f"{trips}, all drives; their frames alone need {wire_ms:.2f} ms")
    told = f"{latency_ms:.2f} ms a cycle beyond the frames, adapter and drives together"
    notes.fact("adapter latency", told)
    highest = settings.answer_share * 1e3 / trips.p99_ms
    told = (
        f"computed {settings.budget.max_rate_Hz:.0f} Hz at most ({bits_per_cycle(drives)} bits a cycle), "
        f"measured {highest:.1f} Hz (answers within {settings.answer_share:.0%} of the period)"
    )
    slow = f"answers take {trips.p99_ms:.2f} ms (99 %)"
    remedy = "or an adapter with less latency (socketcan instead of slcan)"
    judge_cycles((float(settings.rate_Hz), rate_Hz(begun), late), highest, told, slow, remedy, notes)


def _hex(number: int | None) -> str:
    return "?" if number is None else f"0x{number:X}"
