"""Whether the arm comes to rest when the loop falls silent, on each emulated bus.

    python -m benchmarks.deadman --trials 100              stopped (SIGSTOP), killed and hanging, 100 times each
    python -m benchmarks.deadman --trials 5 --arm cia402   one bus

A loop sends set-points that are far away, so that the arm goes on towards the last of them at 0.5 rad/s, the limit in
the rig files that come with palpate, if nobody stops it. Time counts from the last set-point, and the arm is at rest
when what the emulated motors hold moves no more: the simulated arm itself swings for another fifth of a second, after
any stop, which is told beside it.
"""

from __future__ import annotations

import argparse
import sys

from benchmarks.deadman.trials import bench
from palpate.adapters.config import EMULATED_ARMS

WAYS = ("stopped", "killed", "hanging")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20, help="of each way to fall silent")
    parser.add_argument("--arm", default="", help="one emulated arm; all of them without it")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--deadman-ms", type=float, default=100.0)
    parser.add_argument("--rt", action="store_true", help="ask for SCHED_FIFO")
    options = parser.parse_args()
    sys.setswitchinterval(0.0002)
    for arm in (options.arm,) if options.arm else EMULATED_ARMS:
        bench(arm, options)


if __name__ == "__main__":
    main()
