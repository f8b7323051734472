"""What a stopwatch came to: as a table for people, and as plain data for a log."""

from dataclasses import asdict
from typing import Any

from palpate.adapters.hardware.real_time.sections import COLUMNS, LATE, NAMES
from palpate.adapters.hardware.real_time.stopwatch import Stopwatch


def table(stopwatch: Stopwatch) -> str:
    """A table of all sections, in microseconds, and what was late."""
    period_ns = 1e9 / stopwatch.rate_Hz
    lines = [f"{'us':<12}{'ticks':>9}{'median':>9}{'p99':>9}{'p99.9':>9}{'max':>10}{'of period':>11}"]
    ticks = max(stopwatch.spread(LATE).count, 1)
    for column in range(COLUMNS):
        s = stopwatch.spread(column)
        if not s.count:
            continue
        times = f"{s.median_ns * 1e-3:>9.1f}{s.p99_ns * 1e-3:>9.1f}{s.p999_ns * 1e-3:>9.1f}{s.max_ns * 1e-3:>10.1f}"
        # Being late is no use of time.
        share = "" if column == LATE else f"{s.mean_ns * s.count / ticks / period_ns:>11.2%}"
        lines.append(f"{NAMES[column]:<12}{s.count:>9}{times}{share}")
    lines.append(f"skipped slots: {stopwatch.skipped_slots}; {_late_words(stopwatch)}")
    if stopwatch.limits.warn_core_ns:
        limit = f"{stopwatch.limits.warn_core_ns * 1e-6:g} ms"
        lines.append(f"ticks in which the core took longer than {limit}: {stopwatch.slow_cores}")
    return "\n".join(lines)


def plain(stopwatch: Stopwatch) -> dict[str, Any]:
    """The same as values that JSON can hold, times in ns."""
    sections = {NAMES[column]: asdict(stopwatch.spread(column)) for column in range(COLUMNS)}
    return {
        "ticks": stopwatch.ticks,
        "skipped_slots": stopwatch.skipped_slots,
        "slow_cores": stopwatch.slow_cores,
        "late_ticks": {cause.value: count for cause, count in stopwatch.late_ticks.items() if count},
        "blamed": dict(stopwatch.blamed),
        "sections": sections,
    }


def _late_words(stopwatch: Stopwatch) -> str:
    limit_ns = stopwatch.limits.warn_late_ns
    if not limit_ns:
        return "late ticks were not looked for"
    causes = ", ".join(f"{count} {blame}" for blame, count in stopwatch.blamed.most_common())
    total = stopwatch.blamed.total()
    return f"ticks later than {limit_ns * 1e-6:g} ms: {total}{f' ({causes})' if causes else ''}"
