"""``palpate replay --watch``: again, in a new process, whenever a source file changes."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import palpate
from palpate.adapters.cli.options import ReplayOptions
from palpate.core.errors import UsageError

_EVERY_S: Final = 0.5


def watch(options: ReplayOptions) -> int:
    """Replay until Ctrl-C; returns the last replay's exit code."""
    for name in ("out", "markdown"):
        if getattr(options, name):
            raise UsageError(f"--watch with --{name}: the second replay would find {getattr(options, name)} there")
    folders = [Path(place) for place in palpate.__path__]
    module = options.policy.partition(":")[0]
    if ":" in options.policy and (spec := find_spec(module.partition(".")[0])) and spec.origin:
        folders.append(Path(spec.origin).parent)
    command = [sys.executable, "-m", "palpate", "replay", *words_of(options)]
    return repeat(lambda: subprocess.run(command, check=False).returncode, lambda: stamps(folders))


def repeat(run: Callable[[], int], state: Callable[[], object], pause: Callable[[float], None] = time.sleep) -> int:
    """Run now, and again whenever the state is another than before; gives what the last run returned after Ctrl-C."""
    code = 0
    try:
        while True:
            before = state()
            code = run()
            sys.stdout.write("replays again when the source changes; Ctrl-C ends it\n")
            sys.stdout.flush()
            while state() == before:
                pause(_EVERY_S)
    except KeyboardInterrupt:
        sys.stdout.write("\n")
        return code


def stamps(folders: list[Path]) -> Mapping[Path, int]:
    """When each Python file in or below some folders was written, in ns."""
    found = {}
    for path in (path for folder in folders for path in folder.rglob("*.py*")):
        if path.suffix in (".py", ".pyi"):
            try:
                found[path] = path.stat().st_mtime_ns
            except FileNotFoundError:
                continue  # an editor has just replaced it
    return found


def words_of(options: ReplayOptions) -> Iterator[str]:
    """The words of a command line that these options come of, without --watch."""
    yield from options.logs
    for field in fields(options):
        value = getattr(options, field.name)
        if field.name in ("logs", "watch") or value == field.default:
            continue
        flag = f"--{field.name.replace('_', '-')}"
        for one in value if isinstance(value, tuple) else (value,):
            yield from (flag,) if one is True else (flag, str(one))
