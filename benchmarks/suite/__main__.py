"""Costs of the framework, each next to a floor of the same run.

    python -m benchmarks.suite --quick         under three minutes (make bench)
    python -m benchmarks.suite --json FILE     the full form (make bench-full)
    python -m benchmarks.suite --quick --only throughput

A benchmark that fails does not stop the others; the exit code is then 1.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

from benchmarks.suite import processes, ticks
from benchmarks.suite.figures import FULL, QUICK, Benchmark, Form, Group, as_dict, machine, table

ALL = (
    Benchmark("throughput", "Trials and their bare physics, CPU time", ticks.throughput),
    Benchmark("tick", "Control tick without physics, wall time", ticks.tick),
    Benchmark("supervisor", "Supervisor over recorded snapshots, wall time", ticks.supervisor),
    Benchmark("recording", "Recording, trial by trial in one process, wall time", ticks.recording),
    Benchmark("replay", "Replay, CPU time", processes.replayed),
    Benchmark("automata", "Automata from strings, CPU time", processes.inferred),
    Benchmark("environment", "Gymnasium environments, CPU time", processes.environment),
    Benchmark("start-up", "Start-up of whole processes, wall time", processes.start_up),
    Benchmark("memory", "Largest resident memory of a process", processes.memory),
)


def measured(benchmark: Benchmark, form: Form) -> Group:
    """The figures of one benchmark, or why there are none."""
    began = time.perf_counter()
    sys.stderr.write(f"{benchmark.name} ... ")
    sys.stderr.flush()
    group = Group(benchmark.title)
    try:
        group = replace(group, rows=tuple(benchmark.measure(form)))
    except (Exception, SystemExit) as error:
        group = replace(group, missing=f"{type(error).__name__}: {error}")
    group = replace(group, seconds=time.perf_counter() - began)
    sys.stderr.write(f"{group.seconds:.0f} s{' ' + group.missing if group.missing else ''}\n")
    return group


def main() -> int:
    names = [benchmark.name for benchmark in ALL]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="the quick form")
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--cache", default="", help="folder with environments of others, made if need be")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    form, facts, load = replace(QUICK if options.quick else FULL, cache=options.cache), machine(), os.getloadavg()[0]
    groups = [measured(benchmark, form) for benchmark in ALL if benchmark.name in options.only]
    sys.stdout.write(table(form, facts, load, groups))
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(as_dict(form, facts, load, groups), indent=1) + "\n", encoding="utf-8")
    return int(any(group.missing for group in groups))


if __name__ == "__main__":
    sys.exit(main())
