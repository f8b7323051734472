"""Mutants of the core, each replayed against the golden logs in a fork of its own: what does the gate not see?

Only what a trial runs is mutated: functions of modules in which a trial runs lines, as far as setting up and running
the golden trials runs them, and the constants of those modules; no functions or statements that only refuse settings,
and nothing that only makes texts. Mutants are drawn by a fixed seed, some of every module, each by itself: while a
function says what it says, the same of its mutants are drawn, whatever changes elsewhere. A mutant is killed when a
golden log does not replay equal in every bit; one that survives may be equivalent, and then the reason is in
``equivalent.json``, by the mutant's id: that follows from what the function says, so a reason lapses when the function
changes.

It can be ended and begun again at any time: verdicts are appended to ``--out`` as they are reached, with a digest of
what they hold for, and the lines that the logs run stand beside it. A verdict is reached anew if the core has changed
since, or the log that killed the mutant, or any log if it survived. So the same command ends with 0 soon after the
last survivor has its reason.

Begun anew it takes a minute of processor time for the lines, and four to five for 360 mutants, on two processors that
others use five times as long; called again where nothing has changed, some ten seconds.
"""

from __future__ import annotations

import json
import os
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import Any, Final

from benchmarks.mutants.core_mutants import Candidate, candidates, draw
from benchmarks.mutants.golden import digest, golden_logs, in_child, lines_run, replayed, sources
from benchmarks.mutants.never_run import THOROUGH, unrun
from benchmarks.mutants.swapping import forget, swapped
from benchmarks.mutants.verdicts import end_line, read

SEED: Final = 17
ONE_IN: Final = 24
"""One place in so many is drawn: some 400 of 9500."""
EQUIVALENT: Final = Path(__file__).with_name("equivalent.json")
_SAME_BITS: Final = "it differs only where two numbers that are computed from samples are equal in every bit"
_OPERATORS: Final = ("arithmetic", "boolean", "branches", "comparison", "constant", "statement")


def _judged(checkout: Path, one: Candidate, logs: Sequence[Path]) -> tuple[str, str]:
    """Verdict, and what killed it; the core is imported already."""
    target = str(checkout / one.mutant.file)
    source = (checkout / one.mutant.file).read_text(encoding="utf-8")
    text = one.place.applied(source, one.variant)
    mutated = text.encode()
    get_data, path_stats = SourceFileLoader.get_data, SourceFileLoader.path_stats

    def data(self: SourceFileLoader, path: str) -> bytes:
        return mutated if path == target else get_data(self, path)

    def stats(self: SourceFileLoader, path: str) -> Any:
        if path == target:
            raise OSError("its bytecode is that of another text")
        return path_stats(self, path)

    def work() -> str:
        if swapped(target, one.mutant.function, text):
            return replayed(checkout, logs=logs)
        forget()
        SourceFileLoader.get_data, SourceFileLoader.path_stats = data, stats  # type: ignore[method-assign, assignment]
        return replayed(checkout, logs=logs)

    kind, value = in_child(work)
    if kind == "done":
        return ("killed", value) if value else ("survived", "")
    return "killed", f"{kind} {value}"


def run(checkout: Path, out: Path, one_in: int, seed: int, only: str = "", jobs: int = 1) -> int:
    """Judge all mutants of which no verdict in ``out`` still holds, and print the report; 1 if the aim is missed."""
    checkout = checkout.resolve()
    lines = lines_run(checkout, out.with_suffix(".lines.json"))
    replayed(checkout)  # what there is to import is there before every fork
    chosen = [one for one in draw(candidates(checkout, lines), one_in, seed) if only in one.mutant.file]
    chosen.sort(key=lambda one: not one.mutant.file.startswith(THOROUGH))  # those that must not survive come first
    logs, core = golden_logs(checkout), digest(sources(checkout))
    holds_for = {path.stem: f"{core} {digest([path])}" for path in logs} | {"": f"{core} {digest(logs)}"}

    def done() -> dict[str, dict[str, Any]]:
        return {id_: one for id_, one in read(out).items() if one.get("of") == holds_for.get(one.get("log", ""))}

    end_line(out)
    known = done()
    waiting = [one for one in chosen if one.mutant.id not in known]
    print(f"{len(waiting)} of {len(chosen)} mutants are to be judged", flush=True)
    shares = [waiting[first::jobs] for first in range(jobs)]
    children = [_in_part(partial(_judge, checkout, share, lines, logs, holds_for, out)) for share in shares]
    for child in children:
        os.waitpid(child, 0)
    known = done()
    judged = [known[one.mutant.id] for one in chosen if one.mutant.id in known]
    text, missed = report(judged, json.loads(EQUIVALENT.read_text(encoding="utf-8")), unrun(checkout, lines))
    print(text)
    return int(missed or len(judged) < len(chosen))


def _in_part(work: Callable[[], None]) -> int:
    """Do it in a fork of this process."""
    child = os.fork()
    if child == 0:
        try:
            work()
        except BaseException:  # mutants that it leaves unjudged miss the aim; why has to be seen
            traceback.print_exc()
        finally:
            os._exit(0)
    return child


def _judge(
    checkout: Path,
    ones: Sequence[Candidate],
    lines: Mapping[str, Mapping[int, set[str]]],
    logs: Sequence[Path],
    holds_for: Mapping[str, str],
    out: Path,
) -> None:
    # Short ones first: most mutants do not get far.
    logs = sorted(logs, key=lambda path: path.stat().st_size)
    for number, one in enumerate(ones, 1):
        runs = {log for line in one.lines for log in lines[one.mutant.file][line]}
        verdict, by = _judged(checkout, one, [path for path in logs if not one.lines or path.stem in runs])
        log = by.partition(":")[0]
        # The log that killed one mutant often kills its neighbours.
        logs.sort(key=lambda path: path.stem != log)
        log = log if log in holds_for else ""
        told = {**asdict(one.mutant), "verdict": verdict, "killed_by": by, "log": log, "of": holds_for[log]}
        with out.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(told) + "\n")
        if verdict == "survived" or number % 25 == 0:
            print(f"{number}/{len(ones)} {verdict} {one.mutant.file}:{one.mutant.line}"
                  f" {one.mutant.was} -> {one.mutant.becomes}", flush=True)  # fmt: skip


def report(judged: Sequence[dict[str, Any]], reasons: dict[str, str], lines: Mapping[str, str]) -> tuple[str, bool]:
    """For people: how many are killed, and every survivor; and whether the aim is missed.

    Args:
        judged: The mutants and their verdicts.
        reasons: Why some are equivalent, by their ids.
        lines: Statements that are never run, and why.
    """
    survived = [one for one in judged if one["verdict"] == "survived"]
    equivalent = [one for one in survived if one["id"] in reasons]
    unexplained = [one for one in survived if one["id"] not in reasons]
    killed, counted = len(judged) - len(survived), len(judged) - len(equivalent)
    modules = Counter(one["file"] for one in judged)
    text = [
        f"{len(judged)} mutants of {len(modules)} modules: {killed} killed, {len(equivalent)} shown equivalent,"
        f" {len(unexplained)} survived; killed of those not shown equivalent: {killed / max(counted, 1):.1%}"
    ]
    same_bits = sum(reasons[one["id"]] == _SAME_BITS for one in equivalent)
    text.append(f"of those shown equivalent {same_bits} differ only where two computed numbers are equal in every bit")
    by_operator = Counter(one["operator"] for one in judged)
    text.append("by operator: " + ", ".join(f"{by_operator[name]} {name}" for name in _OPERATORS))
    for title, ones in (("survived", unexplained), ("shown equivalent", equivalent)):
        for one in ones:
            text.append(f"{title}: {one['id']} {one['file']}:{one['line']} {one['function']} ({one['operator']})")
            text.append(f"    {one['was']}\n -> {one['becomes']}")
            text += [f"    because {reasons[one['id']]}"] if one["id"] in reasons else []
    text += [f"never run: {line}" + (f", because {why}" if why else "") for line, why in lines.items()]
    wrong = [one for one in judged if one["verdict"] == "killed" and one["id"] in reasons]
    text += [f"called equivalent, and yet killed: {one['id']} {one['file']}:{one['line']}" for one in wrong]
    thorough = [one for one in unexplained if one["file"].startswith(THOROUGH)]
    return "\n".join(text), killed < 0.95 * counted or bool(thorough or wrong) or not all(lines.values())
