"""How late a C program is that does nothing but sleep: cyclictest of rt-tests, the customary measure.

    python -m benchmarks.latency_floor --rate 1000 --seconds 120            with SCHED_FIFO and locked memory
    python -m benchmarks.latency_floor --rate 140 --seconds 120 --ordinary  with neither

The floor beside which ``benchmarks.jitter`` is read: nothing in Python can be more punctual on the same machine. Needs
``cyclictest`` (Debian's rt-tests). It keeps idle processors awake as ``benchmarks.jitter --awake`` does, or with
``--drowsy`` does not.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from pathlib import Path

from benchmarks.jitter import stolen_ms

LONGEST_US = 100_000


def histogram(options: argparse.Namespace) -> dict[int, int]:
    """How many ticks were how many microseconds late."""
    tool = shutil.which("cyclictest")
    if tool is None:
        raise SystemExit("cyclictest is not installed; Debian has it in the package rt-tests")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "histogram"
        command = [tool, "--quiet", f"--interval={round(1e6 / options.rate)}", f"--duration={options.seconds}"]
        command += [f"--histogram={LONGEST_US}", f"--histfile={file}"]
        command += ["--policy=other"] if options.ordinary else ["--mlockall", f"--priority={options.priority}"]
        command += [f"--affinity={options.cpu}"] if options.cpu >= 0 else []
        command += ["--default-system"] if options.drowsy else []
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        lines = file.read_text().splitlines()
    if (beyond := next(line for line in lines if "Overflows" in line).split(":")[1].strip()) != "00000":
        raise SystemExit(f"{beyond} ticks were more than {LONGEST_US} us late: beyond the histogram")
    rows = [line.split() for line in lines if line and not line.startswith("#")]
    return {int(us): int(count) for us, count in rows if int(count)}


def quantile(late: dict[int, int], share: float) -> int:
    """What that share of the ticks was not later than, us."""
    left = share * sum(late.values())
    for us, count in sorted(late.items()):
        left -= count
        if left <= 0:
            return us
    return max(late)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rate", type=int, default=140, help="ticks per second")
    parser.add_argument("--seconds", type=int, default=120)
    parser.add_argument("--priority", type=int, default=50)
    parser.add_argument("--cpu", type=int, default=-1, help="stay on this CPU")
    parser.add_argument("--ordinary", action="store_true", help="ordinary scheduling, memory not locked")
    parser.add_argument("--drowsy", action="store_true", help="leave idle processors as they are")
    options = parser.parse_args()
    if options.rate < 1 or options.seconds < 1:
        parser.error("--rate and --seconds must be 1 or more")
    stolen = stolen_ms()
    late = histogram(options)
    period_us = 1e6 / options.rate
    print(
        f"{sum(late.values())} ticks at {options.rate} Hz: lateness median {quantile(late, 0.5)} us,"
        f" p99.9 {quantile(late, 0.999)} us, largest {max(late)} us;"
        f" later than 1 ms: {sum(count for us, count in late.items() if us > 1000)};"
        f" skipped slots: {sum(int(us / period_us) * count for us, count in late.items())};"
        f" a hypervisor took {stolen_ms() - stolen:.0f} ms of all processors meanwhile"
    )


if __name__ == "__main__":
    main()
