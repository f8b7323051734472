"""How regularly something comes: rate, usual and longest distance in time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Final

from palpate.adapters.hardware.doctor.findings import Notebook
from palpate.core.ports import CONTROL_RATE_HZ, Clock

_NAPS: Final = 100
_NAP_NS: Final = 3_000_000
_LATE_MS: Final = 3.0
"""A computer that wakes as late as this, more than once in a hundred times, makes a 140 Hz loop limp: CALC, 7 ms."""


@dataclass(frozen=True)
class IntervalSpread:
    """A distribution of times."""

    min_ms: float
    median_ms: float
    p99_ms: float
    max_ms: float

    def __str__(self) -> str:
        return f"{self.min_ms:.2f} / {self.median_ms:.2f} / {self.max_ms:.2f} ms (min / median / max)"


def spread_of(times_ns: Sequence[int]) -> IntervalSpread | None:
    """The distribution of some times; None of none."""
    if not times_ns:
        return None
    times = sorted(time * 1e-6 for time in times_ns)
    return IntervalSpread(times[0], median(times), times[round(0.99 * (len(times) - 1))], times[-1])


def distances(times_ns: Sequence[int]) -> list[int]:
    """Time from each moment to the next, ns."""
    return [after - before for before, after in pairwise(times_ns)]


def rate_Hz(times_ns: Sequence[int]) -> float:
    """Mean rate of some moments; 0 when there are fewer than two."""
    span_ns = times_ns[-1] - times_ns[0] if len(times_ns) > 1 else 0
    return (len(times_ns) - 1) * 1e9 / span_ns if span_ns > 0 else 0.0


def at_rate(clock: Clock, wanted_Hz: float, seconds: float, act: Callable[[], None], late_ns: list[int]) -> None:
    """Do something again and again at absolute times, as a control loop does; a turn that is missed is left out.

    How late each turn began goes into ``late_ns``.
    """
    start_ns, period_ns, slot = clock.now_ns(), round(1e9 / wanted_Hz), 0
    while slot * period_ns < seconds * 1e9:
        due_ns = start_ns + slot * period_ns
        clock.sleep_until(due_ns)
        late_ns.append(clock.now_ns() - due_ns)
        act()
        slot = max(slot + 1, (clock.now_ns() - start_ns) // period_ns + 1)


def judge_cycles(
    times: tuple[float, float, IntervalSpread], highest_Hz: float, told: str, slow: str, remedy: str, notes: Notebook
) -> None:
    """Whether a bus carries the rate that is asked for, and which divider of the control rate would fit.

    Args:
        times: Rate asked for, rate achieved, both in Hz, and how late cycles began.
        told: What the budget says and what was measured.
        slow: What takes too long where the rate does not fit.
        remedy: What helps beside another divider.
    """
    wanted_Hz, got_Hz, late = times
    notes.fact("jitter", f"cycles begin late by {late}")
    notes.fact("cycle rate", f"{got_Hz:.1f} Hz, asked for {wanted_Hz:.1f} Hz")
    fits = next((k for k in range(1, CONTROL_RATE_HZ) if CONTROL_RATE_HZ / k <= highest_Hz), CONTROL_RATE_HZ)
    notes.fact("budget", f"{told}; divider = {fits} fits, {CONTROL_RATE_HZ / fits:.1f} Hz")
    notes.judge(
        got_Hz > 0.97 * wanted_Hz and highest_Hz >= wanted_Hz,
        f"{wanted_Hz:.1f} Hz fit the bus",
        f"{wanted_Hz:.1f} Hz do not fit: {slow}, {got_Hz:.1f} Hz were achieved",
        f"[arm] divider = {fits}, {remedy}",
    )


def examine_clock(clock: Clock, notes: Notebook) -> None:
    """Whether time goes on as it should, and how late this computer wakes."""
    late_ns, before_ns = [], clock.now_ns()
    for _ in range(_NAPS):
        due_ns = before_ns + _NAP_NS
        clock.sleep_until(due_ns)
        now_ns = clock.now_ns()
        if now_ns < due_ns:
            problem = f"the clock shows {(due_ns - now_ns) * 1e-6:.3f} ms before a time that it was to wait for"
            notes.wrong(problem, "use another clock source: /sys/devices/system/clocksource/clocksource0")
            return
        late_ns.append(now_ns - due_ns)
        before_ns = now_ns
    late = spread_of(late_ns)
    if late is None:
        return
    notes.fact("waking late", str(late))
    if late.p99_ms > _LATE_MS:
        remedy = "end other programs, set the processor's governor to performance, or use a kernel with PREEMPT_RT"
        notes.note(f"this computer wakes up to {late.p99_ms:.1f} ms late, a control tick is 7.1 ms", remedy)
    else:
        notes.ok("the clock goes on, and the computer wakes in time")
