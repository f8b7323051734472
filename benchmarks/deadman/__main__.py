"""Whether the arm comes to rest when the loop falls silent, on each emulated bus; and what its own process costs.

    python -m benchmarks.deadman --trials 100              stopped (SIGSTOP), killed and hanging, 100 times each
    python -m benchmarks.deadman --trials 5 --arm cia402   one bus
    python -m benchmarks.deadman --lateness 120 --rt       lateness of loop and bus beside an arm in the loop's process

A loop sends set-points that are far away, so that the arm goes on towards the last of them at 0.5 rad/s, the limit in
the rig files that come with palpate, if nobody stops it. Time counts from the last set-point, and the arm is at rest
when what the emulated motors hold moves no more: the simulated arm itself swings for another fifth of a second, after
any stop, which is told beside it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

from benchmarks.deadman.lateness import measure_lateness
from benchmarks.deadman.trials import bench
from palpate.adapters.config import EMULATED_ARMS

WAYS = ("stopped", "killed", "hanging")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20, help="of each way to fall silent")
    parser.add_argument("--arm", default="", help="one emulated arm; all of them without it")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--deadman-ms", type=float, default=100.0)
    parser.add_argument(
        "--lateness", type=float, default=0.0, help="seconds to measure what it costs, and nothing else"
    )
    parser.add_argument("--segment", type=float, default=10.0, help="seconds between two turns of that")
    parser.add_argument("--rt", action="store_true", help="ask for SCHED_FIFO")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    measure: Callable[[str, argparse.Namespace], None] = measure_lateness if options.lateness else bench
    for arm in (options.arm,) if options.arm else EMULATED_ARMS:
        measure(arm, options)


if __name__ == "__main__":
    main()
