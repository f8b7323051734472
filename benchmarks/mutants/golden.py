"""The golden logs, replayed in a fork of this process: whether the core that is loaded there gives them again."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import resource
import signal
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, Final

from benchmarks.house import ROOTS

_CORE: Final = "core/palpate/core"
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
    told = hashlib.sha256()
    for path in sorted(paths):
        told.update(f"{path.name}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return told.hexdigest()[:16]


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
    """The core's lines that replaying the golden logs runs, by file, each with the logs that run it.

    Args:
        checkout: Whose core, and whose logs.
        kept: Where they are written to, and taken from as long as neither core nor logs change.
    """
    logs = golden_logs(checkout)
    of = digest([*sources(checkout), *logs])
    told = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
    if told.get("of") != of:
        kind, value = in_child(lambda: _traced(checkout, logs), _TRACED_CPU_S)
        if kind != "done":
            raise SystemExit(str(value))
        told = {"of": of, "lines": value}
        kept.write_text(json.dumps(told), encoding="utf-8")
    return {file: {int(line): set(ran) for line, ran in ones.items()} for file, ones in told["lines"].items()}


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
        if not name.startswith(_CORE):
            return None
        whole = code.co_name == "run_trial"
        trials += whole
        if trials and code.co_name != "<module>":
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
