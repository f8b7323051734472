"""Mutants of the core, each replayed against the golden logs in a fork of its own: what does the gate not see?

Only what a trial runs is mutated: functions of modules in which a trial runs lines, as far as setting up and running
the golden trials runs them, and the constants of those modules; no functions or statements that only refuse settings,
and nothing that only makes texts. Mutants are drawn by a fixed seed, some of every module. A mutant is killed when a
golden log does not replay equal in every bit; one that survives may be equivalent, and then the reason is in
``equivalent.json``, by the mutant's id: that follows from what the function says, so a reason lapses when the function
changes.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import pickle
import random
import re
import resource
import signal
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import FrameType
from typing import Any, Final

from benchmarks.house import ROOTS
from benchmarks.mutants.functions import functions_in, normalised
from benchmarks.mutants.operators import Place, places
from benchmarks.mutants.swapping import forget, swapped

SEED: Final = 17
COUNT: Final = 400
LEAST: Final = 4
"""So many mutants of each module, if it has them."""
EQUIVALENT: Final = Path(__file__).with_name("equivalent.json")
NOT_RUN: Final = Path(__file__).with_name("not_run.json")
"""Why no trial that is recorded runs a statement, by its function and what it says."""
_SAME_BITS: Final = "it differs only where two numbers that are computed from samples are equal in every bit"
THOROUGH: Final = ("core/palpate/core/supervision/", "core/palpate/core/tasks/")
"""Where no survivor stays unexplained, and every line is to be run, if a trial runs the module at all."""
_REFUSING: Final = ("check", "_check_index", "__post_init__", "require", "_require")
"""How functions are called, or begin, that refuse what was set before any trial."""
_CHECKING: Final = {
    "Range", "check_known", "check_names", "require_finite", "require_floor", "require_keys", "require_names",
    "require_one_of", "require_room", "require_whole",
}  # fmt: skip
"""Functions that only refuse settings and files, or numbers that the filter has refused before; what they are called
with is no behaviour of a trial."""
_SETTING: Final = re.compile(r"[a-z_]+(\.\w+)+")
"""How a setting is called where it is checked: with the table that it stands in."""
_MODULE: Final = "<module>"
_CORE: Final = "core/palpate/core"
_CPU_S: Final = 30
_TRACED_CPU_S: Final = 300
_WALL_S: Final = 300.0
_MOST_MEMORY_B: Final = 8_000_000_000
_OPERATORS: Final = ("arithmetic", "boolean", "branches", "comparison", "constant", "statement")


@dataclass(frozen=True)
class CoreMutant:
    """One small change of the core.

    Attributes:
        id: The same for the same change of the same function.
        file: Relative to the checkout.
        line: Where the change is.
        function: In which function; ``<module>`` for none.
        operator: Kind of the change.
        was: What is replaced.
        becomes: By this.
    """

    id: str
    file: str
    line: int
    function: str
    operator: str
    was: str
    becomes: str


@dataclass(frozen=True)
class _Candidate:
    """A mutant, how it is made, and the lines of which a log runs one if it can show it; none if every log can."""

    mutant: CoreMutant
    place: Place
    variant: int
    lines: frozenset[int]


def _logs(checkout: Path) -> list[Path]:
    return sorted((checkout / "tests" / "golden").glob("*.mcap"))


def _replay(checkout: Path, prepared: Callable[[], None] = lambda: None, logs: Sequence[Path] = ()) -> str:
    """What the gate says: the first log that does not replay, and why; empty if all do.

    Args:
        checkout: Whose core, and whose logs.
        prepared: Is called when all is imported.
        logs: All of them in this order; in that of their names if there are none.
    """
    for root in reversed(ROOTS):
        sys.path.insert(0, str(checkout / root))
    from palpate.adapters.replay.batch import replay_file
    from palpate.adapters.replay.engine import Verdict
    from palpate.adapters.replay.rebuild import Rebuilder

    prepared()
    rebuilder = Rebuilder()
    # Each twice with the same objects, as the trials of a run share theirs: what one leaves must not reach the next.
    for path in (path for path in logs or _logs(checkout) for _ in range(2)):
        one = replay_file(path, rebuilder)
        if one.verdict is not Verdict.EQUAL:
            return f"{path.stem}: {one.first or one.problem}"
    return ""


def _in_child(work: Callable[[], Any], cpu_s: int = _CPU_S) -> tuple[str, Any]:
    """What the work gives in a fork of this process; how it ended if it gave nothing."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.close(reader)
            silent = os.open(os.devnull, os.O_WRONLY)
            os.dup2(silent, 1)
            os.dup2(silent, 2)
            resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 5))
            resource.setrlimit(resource.RLIMIT_DATA, (_MOST_MEMORY_B, _MOST_MEMORY_B))
            try:
                told: Any = ("done", work())
            except BaseException as error:
                told = ("raised", f"{type(error).__name__}: {error}")
            with os.fdopen(writer, "wb") as stream:
                pickle.dump(told, stream)
            code = 0
        finally:
            os._exit(code)
    os.close(writer)
    signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
    signal.setitimer(signal.ITIMER_REAL, _WALL_S)
    with os.fdopen(reader, "rb") as stream:
        data = stream.read()
    _, status = os.waitpid(child, 0)
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    if data and os.waitstatus_to_exitcode(status) == 0:
        kind, value = pickle.loads(data)
        return str(kind), value
    return "ended", f"by {-os.waitstatus_to_exitcode(status)} (its time was up, or it crashed)"


def lines_run(checkout: Path) -> dict[str, dict[int, set[str]]]:
    """The core's lines that replaying the golden logs runs, by file, each with the logs that run it."""
    root = str(checkout) + os.sep

    def work() -> dict[str, dict[int, set[str]]]:
        found: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        in_trials: set[str] = set()
        trials, log = 0, ""

        def trace(frame: FrameType, event: str, argument: Any) -> Any:
            nonlocal trials
            name = frame.f_code.co_filename.removeprefix(root)
            if not name.startswith(_CORE):
                return None
            whole = frame.f_code.co_name == "run_trial"
            trials += whole
            lines = found[name]
            if trials and frame.f_code.co_name != "<module>":
                in_trials.add(name)

            def local(inner: FrameType, event: str, argument: Any) -> Any:
                nonlocal trials
                lines[inner.f_lineno].add(log)
                trials -= whole and event == "return"
                return local

            lines[frame.f_lineno].add(log)
            return local

        for path in _logs(checkout):
            log = path.stem
            problem = _replay(checkout, lambda: sys.settrace(trace), [path])
            sys.settrace(None)
            if problem:
                raise SystemExit(f"the golden logs do not replay: {problem}")
        return {file: dict(lines) for file, lines in found.items() if file in in_trials}

    kind, value = _in_child(work, _TRACED_CPU_S)
    if kind != "done":
        raise SystemExit(str(value))
    lines: dict[str, dict[int, set[str]]] = value
    return lines


def candidates(checkout: Path, lines: Mapping[str, Collection[int]]) -> dict[str, list[_Candidate]]:
    """All mutants of lines that are run, by file."""
    found: dict[str, list[_Candidate]] = {}
    for file, run in sorted(lines.items()):
        source = (checkout / file).read_text(encoding="utf-8")
        ours = list(_candidates(file, source, run))
        if ours:
            found[file] = ours
    return found


def _candidates(file: str, source: str, run: Collection[int]) -> Iterator[_Candidate]:
    named = functions_in(source, file)
    bodies: list[tuple[str, str, Any]] = [(f.name, normalised(f.node), f.node) for f in named]
    inside = {node for _, _, function in bodies for node in ast.walk(function)}
    module = ast.parse(source)
    # Texts of a module's own statements are told apart by where they stand among them.
    bodies += [
        (_MODULE, ast.unparse(one), one)
        for one in module.body
        if isinstance(one, ast.Assign | ast.AnnAssign) and one not in inside and not _unread(one, module, run)
    ]
    for name, text, node in bodies:
        if name.rpartition(".")[2].startswith(_REFUSING):
            continue
        starts, idle = _statement_lines(node), _idle(node)
        for operator, ones in sorted(places(node).items()):
            if operator == "statement" and name == _MODULE:
                continue  # without it nothing can even be imported
            for number, place in enumerate(ones):
                if place.node in idle:
                    continue
                ours = frozenset({place.node.lineno, starts.get(place.node, -1)} & set(run))
                if name != _MODULE and not ours:
                    continue
                for variant, becomes in enumerate(place.variants):
                    key = "\0".join((Path(file).name, name, text, operator, str(number), str(variant)))
                    yield _Candidate(
                        CoreMutant(
                            hashlib.sha256(key.encode()).hexdigest()[:10],
                            file,
                            place.node.lineno,
                            name,
                            operator,
                            ast.unparse(place.node),
                            becomes,
                        ),
                        place,
                        variant,
                        frozenset() if name == _MODULE else ours,
                    )


def _unread(constant: ast.Assign | ast.AnnAssign, module: ast.Module, run: Collection[int]) -> bool:
    """Whether this is a module's own constant, and no line that is run reads it."""
    target = constant.target if isinstance(constant, ast.AnnAssign) else constant.targets[0]
    name, lines = ast.unparse(target), _statement_lines(module)
    read = {*run, *(one.lineno for one in module.body if not isinstance(one, ast.FunctionDef | ast.ClassDef))}
    found = (node for node in ast.walk(module) if isinstance(node, ast.Name) and node.id == name and node is not target)
    return name.startswith("_") and not any({node.lineno, lines[node]} & read for node in found)


def _idle(function: ast.AST) -> set[ast.AST]:
    """What no trial can show: what only refuses settings, zip's ``strict=``, a return where a function ends anyway."""
    found: set[ast.AST] = set()
    for node in ast.walk(function):
        if _names_accepted(node) or (isinstance(node, ast.If) and not node.orelse and all(map(_refuses, node.body))):
            found |= set(ast.walk(node))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and _checks(node.value):
            found |= set(ast.walk(node))
        elif isinstance(node, ast.Call) and _checks(node):
            found |= {inner for inner in ast.walk(node) if isinstance(inner, ast.Constant)}
        elif isinstance(node, ast.keyword) and node.arg == "strict":
            found.add(node.value)
        elif isinstance(node, ast.FunctionDef) and _returns_nothing(node.body[-1]):
            found |= set(ast.walk(node.body[-1]))
    return found


def _refuses(statement: ast.stmt) -> bool:
    raises = isinstance(statement, ast.Raise) and "ConfigurationError" in ast.unparse(statement)
    return raises or _names_accepted(statement)


def _names_accepted(node: ast.AST) -> bool:
    """Whether this is the text of a refusal: what would be accepted."""
    return isinstance(node, ast.Assign) and [ast.unparse(target) for target in node.targets] == ["accepted"]


def _checks(call: ast.Call) -> bool:
    """Whether it is called for what it refuses: by its name, or with a setting's name first."""
    name = ast.unparse(call.func).rpartition(".")[2]
    first = call.args[0] if call.args else None
    setting = isinstance(first, ast.Constant) and _SETTING.fullmatch(str(first.value)) is not None
    return name in _CHECKING or setting


def _returns_nothing(statement: ast.stmt) -> bool:
    value = statement.value if isinstance(statement, ast.Return) else statement
    return value is None or (isinstance(value, ast.Constant) and value.value is None)


def _statement_lines(function: ast.AST) -> dict[ast.AST, int]:
    """The line on which the statement begins that a node is part of."""
    found: dict[ast.AST, int] = {}

    def walk(node: ast.AST, line: int) -> None:
        here = node.lineno if isinstance(node, ast.stmt) else line
        found[node] = here
        for child in ast.iter_child_nodes(node):
            walk(child, here)

    walk(function, getattr(function, "lineno", -1))
    return found


def draw(found: dict[str, list[_Candidate]], count: int, seed: int) -> list[_Candidate]:
    """Some of every file, the others by their number of places; one change at each place."""
    generator, chosen = random.Random(seed), list[_Candidate]()
    total = sum(map(len, found.values()))
    for ones in found.values():
        by_place: dict[int, list[_Candidate]] = defaultdict(list)
        for one in ones:
            by_place[id(one.place)].append(one)
        share = max(LEAST, round(count * len(ones) / total))
        kept = generator.sample(list(by_place.values()), min(share, len(by_place)))
        chosen += sorted((generator.choice(variants) for variants in kept), key=lambda one: one.mutant.line)
    return chosen


def unrun(checkout: Path, lines: Mapping[str, Collection[int]]) -> dict[str, str]:
    """Statements of the thorough files that no golden log runs, and why; empty where no reason is known."""
    reasons: dict[str, str] = json.loads(NOT_RUN.read_text(encoding="utf-8"))
    told = {}
    for file in sorted(lines):
        if not file.startswith(THOROUGH):
            continue
        source = (checkout / file).read_text(encoding="utf-8")
        for function in functions_in(source, file):
            for node in ast.walk(function.node):
                if isinstance(node, ast.stmt) and node is not function.node and not _is_text(node):
                    statement = f"{function.name}: {ast.unparse(node).splitlines()[0]}"
                    # A condition in brackets begins below its "elif".
                    if not {node.lineno, getattr(node, "test", node).lineno} & set(lines[file]):
                        told[f"{file}:{node.lineno} {statement}"] = reasons.get(statement, "")
    return told


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _judged(checkout: Path, one: _Candidate, logs: Sequence[Path]) -> tuple[str, str]:
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
            return _replay(checkout, logs=logs)
        forget()
        SourceFileLoader.get_data, SourceFileLoader.path_stats = data, stats  # type: ignore[method-assign, assignment]
        return _replay(checkout, logs=logs)

    kind, value = _in_child(work)
    if kind == "done":
        return ("killed", value) if value else ("survived", "")
    return "killed", f"{kind} {value}"


def run(checkout: Path, out: Path, count: int, seed: int, only: str = "") -> int:
    """Judge all mutants that ``out`` does not know yet, and print the report; 1 if the aim is missed."""
    checkout = checkout.resolve()
    lines = lines_run(checkout)
    _replay(checkout)  # what there is to import is there before every fork
    chosen = [one for one in draw(candidates(checkout, lines), count, seed) if only in one.mutant.file]
    chosen.sort(key=lambda one: not one.mutant.file.startswith(THOROUGH))  # those that must not survive come first
    # Short ones first: most mutants do not get far.
    done, logs = read(out), sorted(_logs(checkout), key=lambda path: path.stat().st_size)
    begin = time.monotonic()
    for number, one in enumerate(chosen):
        if one.mutant.id in done:
            continue
        runs = {log for line in one.lines for log in lines[one.mutant.file][line]}
        verdict, by = _judged(checkout, one, [path for path in logs if not one.lines or path.stem in runs])
        # The log that killed one mutant often kills its neighbours.
        logs.sort(key=lambda path: path.stem != by.partition(":")[0])
        told = {**asdict(one.mutant), "verdict": verdict, "killed_by": by}
        done[one.mutant.id] = told
        with out.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(told) + "\n")
        if verdict == "survived" or number % 50 == 0:
            print(f"{number + 1}/{len(chosen)} {time.monotonic() - begin:.0f} s {verdict} {one.mutant.file}"
                  f":{one.mutant.line} {one.mutant.was} -> {one.mutant.becomes}", flush=True)  # fmt: skip
    judged = [done[one.mutant.id] for one in chosen]
    text, missed = report(judged, json.loads(EQUIVALENT.read_text(encoding="utf-8")), unrun(checkout, lines))
    print(text)
    return int(missed)


def read(path: Path) -> dict[str, dict[str, Any]]:
    """Verdicts by the mutants' ids."""
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return {one["id"]: one for one in map(json.loads, text.splitlines())}


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
