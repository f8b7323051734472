"""The golden logs, replayed in a fork of this process: whether the core that is loaded there gives them again."""

from __future__ import annotations

import os
import pickle
import resource
import signal
import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import Any, Final

from benchmarks.house import ROOTS

_CORE: Final = "core/palpate/core"
_CPU_S: Final = 30
_TRACED_CPU_S: Final = 300
_WALL_S: Final = 300.0
_MOST_MEMORY_B: Final = 8_000_000_000


def golden_logs(checkout: Path) -> list[Path]:
    return sorted((checkout / "tests" / "golden").glob("*.mcap"))


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

        for path in golden_logs(checkout):
            log = path.stem
            problem = replayed(checkout, lambda: sys.settrace(trace), [path])
            sys.settrace(None)
            if problem:
                raise SystemExit(f"the golden logs do not replay: {problem}")
        return {file: dict(lines) for file, lines in found.items() if file in in_trials}

    kind, value = in_child(work, _TRACED_CPU_S)
    if kind != "done":
        raise SystemExit(str(value))
    lines: dict[str, dict[int, set[str]]] = value
    return lines
