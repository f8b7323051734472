"""How late a loop is that shares the interpreter with another thread, by how long it waits before it asks for it.

    python -m benchmarks.interpreter

The loop only sleeps, with SCHED_FIFO where that is granted; the other thread is always busy in Python, which is worse
than any thread of a rig. Python's own interval is 5 ms; ``RealTime.loop`` sets 0.1 ms, before it was 0.5 ms.
"""

from __future__ import annotations

import sys
import threading
import time

from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.hardware.real_time import RealTime

RATE_HZ, TICKS, ROUNDS = 140, 600, 3
INTERVALS_S = (0.005, 0.0005, 0.0001)


def lateness_ms(interval_s: float) -> list[float]:
    """How late each tick began, in order of size."""
    ended = threading.Event()

    def busy() -> None:
        while not ended.is_set():
            pass

    other = threading.Thread(target=busy)
    other.start()
    late = []
    with RealTime(RealTimeConfig(scheduling=True)) as real_time, real_time.loop():
        sys.setswitchinterval(interval_s)
        start_ns = time.monotonic_ns()
        for tick in range(1, TICKS + 1):
            deadline_ns = start_ns + tick * 1_000_000_000 // RATE_HZ
            time.sleep(max(0.0, (deadline_ns - time.monotonic_ns()) * 1e-9))
            late.append((time.monotonic_ns() - deadline_ns) * 1e-6)
    ended.set()
    other.join()
    return sorted(late)


def main() -> None:
    for _ in range(ROUNDS):
        for interval_s in INTERVALS_S:
            late = lateness_ms(interval_s)
            print(
                f"asks after {interval_s * 1e3:g} ms: lateness median {late[TICKS // 2]:.2f} ms,"
                f" p99 {late[TICKS * 99 // 100]:.2f} ms, largest {late[-1]:.2f} ms"
            )


if __name__ == "__main__":
    main()
