"""Golden logs and unit tests in a fork of this process, with a mutant in place of a file of the source."""

from __future__ import annotations

import gc
import hashlib
import json
import os
import pickle
import resource
import signal
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any, Final

ROOTS: Final = ("core", "adapters", "drivers", "simulation")
_CORE: Final = "core/palpate/core/"
_MUTATED: Final = (_CORE, "adapters/palpate/adapters/log/", "adapters/palpate/adapters/replay/")
"""What is mutated: the core, and what records and replays its trials."""
_CPU_S: Final = 30
_TRACED_CPU_S: Final = 900
_WALL_PER_CPU: Final = 60.0
"""A replay never sleeps: only on a busy machine does it take longer than its processor time."""
_MOST_MEMORY_B: Final = 8_000_000_000


def golden_logs(checkout: Path) -> list[Path]:
    return sorted((checkout / "tests" / "golden").glob("*.mcap"))


def sources(checkout: Path) -> list[Path]:
    """The core, and what replays its logs."""
    return [path for root in ("core", "adapters") for path in (checkout / root).rglob("*.py")]


def digest(paths: Iterable[Path]) -> str:
    whole = hashlib.sha256()
    for path in sorted(paths):
        whole.update(f"{path.name}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return whole.hexdigest()[:16]


def replayed(checkout: Path, prepared: Callable[[], None] = lambda: None, logs: Sequence[Path] = ()) -> str:
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
    for path in (path for path in logs or golden_logs(checkout) for _ in range(2)):
        one = replay_file(path, rebuilder)
        if one.verdict is not Verdict.EQUAL:
            return f"{path.stem}: {one.first or one.problem}"
    return ""


def in_child(work: Callable[[], Any], cpu_s: int = _CPU_S) -> tuple[str, Any]:
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
                result: Any = ("done", work())
            except BaseException as error:
                result = ("raised", f"{type(error).__name__}: {error}")
            with os.fdopen(writer, "wb") as stream:
                pickle.dump(result, stream)
            code = 0
        finally:
            os._exit(code)
    os.close(writer)
    signal.signal(signal.SIGALRM, lambda *_: os.kill(child, signal.SIGKILL))
    signal.setitimer(signal.ITIMER_REAL, _WALL_PER_CPU * cpu_s)
    with os.fdopen(reader, "rb") as stream:
        data = stream.read()
    _, status = os.waitpid(child, 0)
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    if data and os.waitstatus_to_exitcode(status) == 0:
        kind, value = pickle.loads(data)
        return str(kind), value
    return "ended", f"by {-os.waitstatus_to_exitcode(status)} (its time was up, or it crashed)"


def lines_run(checkout: Path, kept: Path) -> dict[str, dict[int, set[str]]]:
    """The lines that replaying the golden logs runs, by file, each with the logs that run it.

    Args:
        checkout: Whose core, and whose logs.
        kept: Where they are written to, and taken from as long as neither core nor logs change.
    """
    logs = golden_logs(checkout)
    of = digest([*sources(checkout), *logs])
    known = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    if known.get("of") != of:
        kind, value = in_child(lambda: _traced(checkout, logs), _TRACED_CPU_S)
        if kind != "done":
            raise SystemExit(str(value))
        known = {"of": of, "lines": value}
        kept.write_text(json.dumps(known), encoding="utf-8")
    return {file: {int(line): set(ran) for line, ran in ones.items()} for file, ones in known["lines"].items()}


def _traced(checkout: Path, logs: Sequence[Path]) -> dict[str, dict[int, list[str]]]:
    root = str(checkout) + os.sep
    found: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
    left: dict[CodeType, set[int]] = {}
    in_trials: set[str] = set()
    trials, log = 0, ""

    def trace(frame: FrameType, event: str, argument: Any) -> Any:
        nonlocal trials
        code = frame.f_code
        name = code.co_filename.removeprefix(root)
        if not name.startswith(_MUTATED) or name.endswith("_pb2.py"):
            return None
        whole = code.co_name == "run_trial"
        trials += whole
        if (trials or not name.startswith(_CORE)) and code.co_name != "<module>":
            in_trials.add(name)
        if code not in left:
            left[code] = {line for _, _, line in code.co_lines() if line is not None}
        elif not left[code] and not whole:
            return None  # all its lines have been run by this log
        lines, missing = found[name], left[code]

        def local(inner: FrameType, event: str, argument: Any) -> Any:
            nonlocal trials
            lines[inner.f_lineno].add(log)
            missing.discard(inner.f_lineno)
            trials -= whole and event == "return"
            return local

        return local(frame, event, argument)

    for path in logs:
        log = path.stem
        left.clear()
        problem = replayed(checkout, lambda: sys.settrace(trace), [path])
        sys.settrace(None)
        if problem:
            raise SystemExit(f"the golden logs do not replay: {problem}")
    return {file: {line: sorted(ran) for line, ran in found[file].items()} for file in sorted(in_trials)}


@contextmanager
def loaded_as(path: str, text: str) -> Iterator[None]:
    """Reload palpate on its next import, with another text of this file."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "palpate"]:
        del sys.modules[name]
    get_data, path_stats = SourceFileLoader.get_data, SourceFileLoader.path_stats

    def data(self: SourceFileLoader, file: str) -> bytes:
        return text.encode() if file == path else get_data(self, file)

    def stats(self: SourceFileLoader, file: str) -> Any:
        if file == path:
            raise OSError("its bytecode is that of another text")
        return path_stats(self, file)

    SourceFileLoader.get_data, SourceFileLoader.path_stats = data, stats  # type: ignore[method-assign, assignment]
    try:
        yield
    finally:
        SourceFileLoader.get_data, SourceFileLoader.path_stats = get_data, path_stats  # type: ignore[method-assign]


def swapped(path: str, name: str, source: str) -> bool:
    """Give a function of the file the code that it has in another text of the file; nothing is imported again.

    Returns:
        Whether it has other code now; not so where the texts differ in what is run at the import, such as a default.
    """
    compiled = compile(source, path, "exec", dont_inherit=True)
    others = {code.co_firstlineno: code for code in _codes(compiled) if code.co_qualname == name}
    found = False
    for function in [one for one in gc.get_objects() if type(one) is FunctionType]:
        code = function.__code__
        if code.co_filename == path and code.co_qualname == name:
            other = others.get(code.co_firstlineno)
            if other is not None and other != code:
                function.__code__, found = other, True
    return found


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def unit_tests(checkout: Path, package: str) -> list[str]:
    """Where the tests of a package are."""
    folders = [checkout / "tests" / "unit" / root for root in ("core", "adapters")]
    found = [path for folder in folders for path in (folder / package, *folder.glob(f"test_{package}*.py"))]
    return [str(path) for path in found if path.exists()]


def failed_test(checkout: Path, package: str) -> str:
    """The first unit test of a package that fails with the source as it is loaded here; empty if none does."""
    import pytest

    class Failures:
        first = ""

        def pytest_runtest_logreport(self, report: Any) -> None:
            if report.failed and not self.first:
                self.first = report.nodeid

        def pytest_collectreport(self, report: Any) -> None:
            self.pytest_runtest_logreport(report)

    tests, failures = unit_tests(checkout, package), Failures()
    if not tests:
        return ""
    # Assertions as they are: what rewrites them also loads the project's plug-in, and without the mutant.
    words = ["-x", "-q", "-p", "no:cacheprovider", "--assert=plain", f"--rootdir={checkout}"]
    code = pytest.main([*words, *tests], plugins=[failures])
    return failures.first or ("" if code == 0 else f"pytest ended with {int(code)}")
