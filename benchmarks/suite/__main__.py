"""All benchmarks, each figure beside a floor or a peer of the same run.

    python -m benchmarks.suite --quick                            under three minutes (make bench)
    python -m benchmarks.suite --json FILE --write docs/results.md    the full form (make bench-full)
    python -m benchmarks.suite --from FILE --write docs/results.md    writes figures that are there already

A benchmark that needs what is not installed is left out, and the table says so. One that breaks does not keep the
others from being measured; the exit code is then 1.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.suite import automata, pictures, processes, ticks
from benchmarks.suite.machine import machine
from benchmarks.suite.rows import FULL, QUICK, Benchmark, Form, Group, MissingError, Suite
from benchmarks.suite.text import rewrite, section, table

ALL = (
    Benchmark("ticks", "Control tick by stage", ticks.stages, "Medians, wall time."),
    Benchmark("throughput", "Trials against bare physics", ticks.throughput),
    Benchmark("replay", "Replay", processes.replayed),
    Benchmark("recording", "Recording", ticks.recorded, "Turn by turn in one process, wall time."),
    Benchmark("automata", "Automata from strings", automata.inferred),
    Benchmark("minimise", "Minimisation and comparison of automata", automata.minimised, "Wall time."),
    Benchmark("scaling", "Studies on several processes", processes.scaling),
    Benchmark("environment", "Gymnasium environments", processes.environment),
    Benchmark("pictures", "Pictures of a trial", pictures.painted),
    Benchmark("start-up", "Start-up and imports", processes.start_up, "Whole processes, wall time; medians."),
    Benchmark("memory", "Memory", processes.memory, "Largest resident memory of a process."),
)


def measure(benchmarks: Sequence[Benchmark], form: Form) -> Suite:
    """Run benchmarks one after the other."""
    busy, facts = os.getloadavg()[0], machine()
    groups = []
    for benchmark in benchmarks:
        began = time.perf_counter()
        sys.stderr.write(f"{benchmark.name} ... ")
        sys.stderr.flush()
        group = Group(benchmark.title, notes=benchmark.notes)
        try:
            group = replace(group, rows=tuple(benchmark.measure(form)))
        except MissingError as error:
            group = replace(group, missing=str(error))
        except (Exception, SystemExit) as error:
            # Whatever broke, the figures before and after it are worth having.
            group = replace(group, missing=f"{type(error).__name__}: {error}", failed=True)
        group = replace(group, seconds=time.perf_counter() - began)
        sys.stderr.write(f"{group.seconds:.0f} s{' ' + group.missing if group.missing else ''}\n")
        groups.append(group)
    return Suite(form.name, facts, tuple(groups), busy)


def main(words: Sequence[str] | None = None) -> int:
    """Returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.suite", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    names = [benchmark.name for benchmark in ALL]
    parser.add_argument("--quick", action="store_true", help="the quick form")
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--cache", default="", help="folder with virtual environments of peers, made if need be")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--write", type=Path, help="document whose marked section is written anew")
    parser.add_argument("--from", dest="source", type=Path, help="figures of an earlier --json; nothing is measured")
    options = parser.parse_args(words)
    if options.source is not None:
        try:
            suite = Suite.of(json.loads(options.source.read_text(encoding="utf-8")))
        except (OSError, ValueError, KeyError, TypeError) as error:
            parser.error(f"{options.source} holds no figures of this suite ({error})")
    else:
        form = replace(QUICK if options.quick else FULL, cache=options.cache)
        suite = measure([benchmark for benchmark in ALL if benchmark.name in options.only], form)
    sys.stdout.write(table(suite))
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(suite.as_dict(), indent=1) + "\n", encoding="utf-8")
    if options.write is not None:
        try:
            rewrite(options.write, section(suite))
        except (OSError, ValueError) as error:
            parser.error(str(error))
    return int(any(group.failed for group in suite.groups))


if __name__ == "__main__":
    sys.exit(main())
