"""Find mutants of core, log and replay that neither a golden log nor a unit test of their package kills.

    python -m benchmarks.gate --seeds 7101 7102 7103 --count 100 --jobs 2 --out gate.jsonl
    python -m benchmarks.gate --packages supervision tasks motion replay log --out gate.jsonl

A mutant is one small change (a dropped statement, another operator, constant, comparison, branch) at a place that a
recorded trial runs; checks on settings and texts are left out. Each seed draws ``--count`` places by their digests, so
that a change elsewhere draws no others. A mutant is killed when a golden log does not replay equal in every bit, or
else by the first unit test of its package that fails. Every log is replayed twice, in a fork of this process.

Verdicts go to ``--out`` as they are reached, and the next call resumes; one is reached again if the source, the logs
or the tests have changed. The table has killed and drawn mutants for each package; the survivors follow.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from benchmarks.common import share, table
from benchmarks.gate.candidates import Candidate, candidates, draw
from benchmarks.gate.replaying import (
    digest,
    failed_test,
    golden_logs,
    in_child,
    lines_run,
    loaded_as,
    replayed,
    sources,
    swapped,
)

CHECKOUT: Final = Path(__file__).parents[2]
_TESTS_CPU_S: Final = 600


def killer(one: Candidate, logs: Sequence[Path]) -> str:
    """What kills a mutant: a log and where it differs, or a test; empty if it survives. The core is imported."""
    path = str(CHECKOUT / one.mutant.file)
    text = one.place.applied(Path(path).read_text(encoding="utf-8"), one.variant)

    def replay() -> str:
        if swapped(path, one.mutant.function, text):
            return replayed(CHECKOUT, logs=logs)
        with loaded_as(path, text):
            return replayed(CHECKOUT, logs=logs)

    def test() -> str:
        with loaded_as(path, text):
            return failed_test(CHECKOUT, one.mutant.package)

    for work, cpu_s in ((replay, 30), (test, _TESTS_CPU_S)):
        kind, value = in_child(work, cpu_s)
        if kind != "done":
            return f"{kind} {value}"
        if value:
            return str(value)
    return ""


def judge(
    ones: Sequence[Candidate], lines: Mapping[str, Mapping[int, set[str]]], logs: Sequence[Path], of: str, out: Path
) -> None:
    """Append the verdicts of these mutants to the file."""
    # Short logs first: most mutants do not get far.
    logs = sorted(logs, key=lambda path: path.stat().st_size)
    for number, one in enumerate(ones, 1):
        runs = {log for line in one.lines for log in lines[one.mutant.file][line]}
        by = killer(one, [path for path in logs if not one.lines or path.stem in runs])
        # The log that killed one mutant often kills its neighbours.
        logs.sort(key=lambda path: path.stem != by.partition(":")[0])
        with out.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps({**asdict(one.mutant), "killed_by": by, "of": of}) + "\n")
        if not by or number % 25 == 0:
            print(f"{number}/{len(ones)} {one.mutant.file}:{one.mutant.line} {by or 'survives'}", flush=True)


def in_parts(jobs: int, ones: Sequence[Candidate], *arguments: Any) -> None:
    """Judge in several forks of this process."""
    children = []
    for first in range(jobs):
        child = os.fork()
        if child == 0:
            try:
                judge(ones[first::jobs], *arguments)
            except BaseException:  # what it leaves unjudged is missing from the table; why has to be seen
                traceback.print_exc()
            finally:
                os._exit(0)
        children.append(child)
    for child in children:
        os.waitpid(child, 0)


def verdicts(out: Path, of: str) -> dict[str, dict[str, Any]]:
    """Those in the file that hold for this source, these logs and these tests; a line cut short is left out."""
    found = {}
    for line in out.read_text(encoding="utf-8").splitlines() if out.exists() else []:
        try:
            verdict = json.loads(line)
        except ValueError:
            continue
        if verdict["of"] == of:
            found[verdict["id"]] = verdict
    return found


def report(judged: Sequence[dict[str, Any]]) -> str:
    """Killed and drawn mutants for each package, and the survivors."""
    rows = []
    for package in [*sorted({one["package"] for one in judged}), "all"]:
        ours = [one for one in judged if package in (one["package"], "all")]
        killed = [one for one in ours if one["killed_by"]]
        tests = sum("::" in one["killed_by"].partition(": ")[0] for one in killed)
        rows.append((package, len(killed), len(killed) - tests, tests, len(ours), share(len(killed), len(ours))))
    text = [table(("package", "killed", "by a log", "by a test", "drawn", "share"), rows)]
    for one in judged:
        if not one["killed_by"]:
            text.append(f"survived: {one['id']} {one['file']}:{one['line']} {one['function']} ({one['operator']})")
            text.append(f"    {one['was']}\n -> {one['becomes']}")
    return "\n".join(text)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", nargs="+", type=int, default=[17])
    parser.add_argument("--count", type=int, default=100, help="mutants of each seed")
    parser.add_argument("--packages", nargs="+", default=[], help="such as tasks or replay; all of them by default")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    logs = golden_logs(CHECKOUT)
    tests = list((CHECKOUT / "tests").rglob("*.py"))
    of = digest([*sources(CHECKOUT), *logs, *tests])
    lines = lines_run(CHECKOUT, options.out.with_suffix(".lines.json"))
    replayed(CHECKOUT)  # what there is to import is there before every fork
    found = candidates(CHECKOUT, lines, options.packages)
    chosen = {one.mutant.id: one for seed in options.seeds for one in draw(found, options.count, seed)}
    for package in sorted({one.mutant.package for one in chosen.values()}):
        if failed := in_child(lambda name=package: failed_test(CHECKOUT, name), _TESTS_CPU_S)[1]:
            raise SystemExit(f"a test of {package} fails without a mutant: {failed}")
    known = verdicts(options.out, of)
    waiting = [one for id_, one in chosen.items() if id_ not in known]
    print(f"{len(waiting)} of {len(chosen)} mutants are to be judged", flush=True)
    in_parts(options.jobs, waiting, lines, logs, of, options.out)
    known = verdicts(options.out, of)
    print(report([known[id_] for id_ in chosen if id_ in known]))
    return int(any(id_ not in known for id_ in chosen))


if __name__ == "__main__":
    sys.exit(main())
