"""Runs mutants against their guards, and compares what came of two such runs."""

from __future__ import annotations

import json
import tempfile
import threading
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

from benchmarks.mutants.draw import Mutant, mutated
from benchmarks.mutants.functions import functions_of, unique
from benchmarks.mutants.guards import guards
from benchmarks.mutants.trees import Ran, Tree

KILLED: Final = "killed"
BY_TIMEOUT: Final = "killed by timeout"
IN_TIME: Final = "not killed in time"
SURVIVED: Final = "survived"
GONE: Final = "gone"

Verdict = dict[str, Any]


class Judge:
    """Runs one mutant after the other in one tree.

    Args:
        tree: The copy that is mutated.
        limit_s: For all tests of a mutant together.
    """

    def __init__(self, tree: Tree, limit_s: float) -> None:
        self._tree, self._limit_s = tree, limit_s
        self._needed_s: dict[frozenset[str], float | None] = {}

    def verdict(self, file: str, source: str, stages: Sequence[tuple[str, list[str]]]) -> Verdict:
        """What the guards say to a file with this text, and how long they took for it."""
        left_s, distrusted = self._limit_s, list[str]()
        for stage, tests in stages:
            given_s = left_s
            while True:
                with self._tree.holding(file, source):
                    ran = self._tree.run(tests, left_s, distrusted)
                left_s -= ran.seconds
                told = {"stage": stage, "seconds": round(self._limit_s - left_s, 1), "distrusted": distrusted}
                if ran.passed:
                    break
                if ran.code is None:
                    verdict = BY_TIMEOUT if self._would_have_passed(tests, 0.5 * given_s) else IN_TIME
                    return {"verdict": verdict, "killed_by": "", **told}
                if self._trusted(file, source, tests, ran):
                    return {"verdict": KILLED, "killed_by": ran.failed or ran.said, **told}
                distrusted.append(ran.failed)
                if left_s < 1.0:
                    return {"verdict": IN_TIME, "killed_by": "", **told}
            if left_s < 1.0 and stage != stages[-1][0]:
                return {"verdict": IN_TIME, "killed_by": "", **told}
        return {"verdict": SURVIVED, "killed_by": "", "stage": "", "seconds": round(self._limit_s - left_s, 1),
                "distrusted": distrusted}  # fmt: skip

    def _trusted(self, file: str, source: str, tests: Sequence[str], ran: Ran) -> bool:
        """Whether it was the mutation that made a test fail, and not a busy machine."""
        if "::" not in ran.failed:
            # It did not even come to a test; without the mutation it has to.
            plain = self._tree.run([ran.failed] if ran.failed else tests, self._limit_s)
            if plain.code is not None and not plain.passed and "::" not in plain.failed:
                raise SystemExit(f"the tests do not run without a mutation either:\n{plain.said}")
            return True
        with self._tree.holding(file, source):
            again = self._tree.run([ran.failed], self._limit_s)
        return not again.passed and self._tree.run([ran.failed], self._limit_s).passed

    def _would_have_passed(self, tests: Sequence[str], within_s: float) -> bool:
        """Whether the tests without a mutation need so little that only a hang explains that their time was up."""
        key = frozenset(tests)
        if key not in self._needed_s:
            ran = self._tree.run(tests, self._limit_s)
            self._needed_s[key] = ran.seconds if ran.passed else None
        needed_s = self._needed_s[key]
        return needed_s is not None and needed_s <= within_s


def run(
    checkout: Path, mutants: Sequence[Mutant], out: Path, *, jobs: int, limit_s: float, again: bool = False
) -> None:
    """Judge all mutants that ``out`` does not know yet; each verdict is appended to it as it is reached.

    Args:
        checkout: Whose functions and tests.
        mutants: Which.
        out: Lines of JSON.
        jobs: How many at a time.
        limit_s: For all tests of a mutant together.
        again: Those that were not killed in time, too.
    """
    functions, lock = unique(functions_of(checkout)), threading.Lock()
    end_line(out)
    done = {id_ for id_, one in read(out).items() if not (again and one["verdict"] == IN_TIME)}
    waiting = [mutant for mutant in mutants if mutant.id not in done]
    print(f"{len(waiting)} of {len(mutants)} mutants are to be judged")

    def tell(mutant: Mutant, facts: Verdict) -> None:
        line = json.dumps({"id": mutant.id, "name": mutant.name, "operator": mutant.operator, **facts})
        with lock, out.open("a", encoding="utf-8") as stream:
            stream.write(line + "\n")
            print(
                f"{facts['verdict']:<20}{facts.get('seconds', 0.0):5.1f} s  {mutant.name} in {facts['file']}",
                flush=True,
            )

    def judge_share(folder: Path) -> None:
        judge = Judge(Tree(checkout, folder), limit_s)
        while True:
            with lock:
                mutant = waiting.pop(0) if waiting else None
            if mutant is None:
                return
            function = functions.get((mutant.name, mutant.text))
            changed = None
            if function is not None:
                source = (checkout / function.file).read_text(encoding="utf-8")
                changed = mutated(mutant, function, source)
            if changed is None:
                tell(mutant, {"verdict": GONE, "file": "", "line": 0, "diff": "", "killed_by": ""})
                continue
            place = {"file": changed.file, "line": changed.line, "diff": changed.diff}
            tell(mutant, place | judge.verdict(changed.file, changed.source, guards(checkout, changed.file)))

    with tempfile.TemporaryDirectory(prefix="mutants-") as name, ThreadPoolExecutor(jobs) as pool:
        for share in [pool.submit(judge_share, Path(name) / str(number)) for number in range(jobs)]:
            share.result()


def read(path: Path) -> dict[str, Verdict]:
    """Verdicts by the mutants' ids; none where there is no file. A line cut short by a kill is run again."""
    found: dict[str, Verdict] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            verdict = json.loads(line)
        except ValueError:
            continue
        found[verdict["id"]] = verdict
    return found


def end_line(path: Path) -> None:
    """End a line that was cut short, or the next one would be lost with it."""
    if path.exists() and not path.read_bytes().endswith(b"\n"):
        with path.open("a", encoding="utf-8") as stream:
            stream.write("\n")


def is_killed(verdict: Verdict) -> bool:
    return verdict["verdict"] in (KILLED, BY_TIMEOUT)


def lost(before: Mapping[str, Verdict], after: Mapping[str, Verdict]) -> list[str]:
    """Mutants that were killed before, and are not any more."""
    return [id_ for id_, one in before.items() if is_killed(one) and not (id_ in after and is_killed(after[id_]))]


def compared(before: Mapping[str, Verdict], after: Mapping[str, Verdict]) -> str:
    """Both runs beside each other, for people."""
    lines = []
    for title, run_ in (("before", before), ("after", after)):
        counts = ", ".join(f"{n} {word}" for word, n in Counter(one["verdict"] for one in run_.values()).most_common())
        lines.append(f"{title}: {len(run_)} mutants, {counts}")
    newly = [id_ for id_, one in after.items() if is_killed(one) and id_ in before and not is_killed(before[id_])]
    missing = lost(before, after)
    lines.append(f"killed after and not before: {len(newly)}")
    lines.append(f"killed before and not after: {len(missing)}")
    for id_ in missing:
        one, other = before[id_], after.get(id_, {"verdict": "not run", "file": ""})
        where = f"{one['name']}, {one['file']}:{one['line']} -> {other['file']}"
        lines += ["", f"{id_} {where}: {other['verdict']}", f"  killed before by {one['killed_by'] or one['verdict']}"]
        lines += [f"  {line}" for line in one["diff"].splitlines()[2:]]
    return "\n".join(lines)
