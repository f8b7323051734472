"""A copy of a checkout in which files can be mutated and tests be run."""

from __future__ import annotations

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from benchmarks.checkouts import import_path
from benchmarks.house import ROOTS

_LEFT_OUT: Final = shutil.ignore_patterns(
    ".git", ".venv", "runs", "__pycache__", ".*_cache", ".hypothesis", "node_modules"
)
_PYTEST: Final = ("-x", "-q", "-p", "no:cacheprovider", "--no-header", "--hypothesis-seed=0", "-rfE")
_FAILED: Final = re.compile(r"^(FAILED|ERROR) (\S.*?)(?: - .*)?$", re.MULTILINE)
_MOST_MEMORY_B: Final = 8_000_000_000
_MOST_FILE_B: Final = 2_000_000_000
_LOOK_S: Final = 0.5
_PASSED: Final = (0, 5)
"""Exit codes of pytest: all passed, none there."""


@dataclass(frozen=True)
class Ran:
    """What came of a call of pytest.

    Attributes:
        code: Its exit code; None if it was ended because its time was up.
        seconds: How long it took, but for what other work on the machine kept it from running.
        failed: What failed first; empty for nothing, or if it did not come so far as to say so.
        said: Its last words.
    """

    code: int | None
    seconds: float
    failed: str
    said: str

    @property
    def passed(self) -> bool:
        return self.code in _PASSED


class Tree:
    """A copy of a checkout's files; whatever is run in it imports from it and from nowhere else.

    Args:
        checkout: What is copied.
        folder: Where to; does not exist yet.
    """

    def __init__(self, checkout: Path, folder: Path) -> None:
        self._tree, self._scratch = folder / "tree", folder / "tmp"
        shutil.copytree(checkout, self._tree, ignore=_LEFT_OUT, symlinks=True)
        self._scratch.mkdir()
        self._path = [*import_path(self._tree, folder / "metadata"), str(self._tree)]
        self._changes = 0
        compiled = [sys.executable, "-m", "compileall", "-q", *ROOTS]
        subprocess.run(compiled, cwd=self._tree, check=False, stdout=subprocess.DEVNULL)

    @contextmanager
    def holding(self, file: str, source: str) -> Iterator[None]:
        """While inside, a file has another text."""
        path = self._tree / file
        original, times = path.read_bytes(), path.stat()
        self._changes += 1
        try:
            path.write_text(source, encoding="utf-8")
            # Bytecode is told apart by the source's size and time in seconds: no two texts may have the same.
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns + self._changes * 1_000_000_000))
            yield
        finally:
            path.write_bytes(original)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))

    def run(self, tests: Sequence[str], limit_s: float | None, left_out: Sequence[str] = ()) -> Ran:
        """Run tests up to the first failure.

        Args:
            tests: Files, or names of tests.
            limit_s: When this time is up everything is ended; None waits. Time in which pytest was ready to run and
                other work had the processors does not count: it says nothing of the tests.
            left_out: Names of tests that are not run.
        """
        shutil.rmtree(self._scratch, ignore_errors=True)
        self._scratch.mkdir()
        words = [*tests, *(word for name in left_out for word in ("--deselect", name))]
        begin = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *_PYTEST, *words],
            cwd=self._tree,
            env=self._environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
            preexec_fn=_limit,
        )
        code: int | None = None
        starved_s = 0.0
        try:
            while code is None:
                try:
                    said, _ = process.communicate(timeout=_LOOK_S)
                    code = process.returncode
                except subprocess.TimeoutExpired:
                    starved_s = _starved_s(process.pid)
                    if limit_s is not None and time.monotonic() - begin - starved_s > limit_s:
                        _end_all_of(process)
                        said, _ = process.communicate()
                        break
        finally:
            _end_all_of(process)
        seconds = time.monotonic() - begin - starved_s
        failed = _FAILED.findall(said)
        first = failed[0][1] if failed and code not in (None, *_PASSED) else ""
        return Ran(code, seconds, first, "\n".join(said.splitlines()[-15:]))

    def _environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(self._path),
            "TMPDIR": str(self._scratch),
            "HYPOTHESIS_STORAGE_DIRECTORY": str(self._scratch / "hypothesis"),
        }


def _starved_s(pid: int) -> float:
    """How long a process's main thread has waited for a processor up to now; 0 where the system keeps no account."""
    path = Path(f"/proc/{pid}/schedstat")
    return int(path.read_text().split()[1]) * 1e-9 if path.exists() else 0.0


def _limit() -> None:
    # A mutant may well grow without end: it alone shall come to grief of it.
    resource.setrlimit(resource.RLIMIT_DATA, (_MOST_MEMORY_B, _MOST_MEMORY_B))
    resource.setrlimit(resource.RLIMIT_FSIZE, (_MOST_FILE_B, _MOST_FILE_B))


def _end_all_of(process: subprocess.Popen[str]) -> None:
    """End the process and what it has started and left behind."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
