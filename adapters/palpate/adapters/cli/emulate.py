"""The ``palpate emulate`` command."""

import os
import sys
from hashlib import sha256
from pathlib import Path
from threading import Event
from typing import Final

from palpate.adapters.cli.notices import say
from palpate.adapters.cli.options import EmulateOptions
from palpate.adapters.experiments import interrupting, ready_pose
from palpate.adapters.files import write_whole
from palpate.adapters.hardware import EVENTS, EmulatedCell, PlannedEvent
from palpate.adapters.hardware.real_time import take_real_time
from palpate.core.errors import OutputError
from palpate.core.ports import GroundTruth

_MARK: Final = "# Written by palpate emulate, which replaces this file unless it is changed: "


def emulate(options: EmulateOptions) -> int:
    """Emulate the devices until a signal ends the command, and return the exit code."""
    config = options.run
    path = Path(options.rig_file) if options.rig_file else None
    job_path = None if path is None else path.parent / f"{path.stem}.job.toml"
    for file in (path, job_path):
        _require_own(file)
    ended = Event()
    if options.priority:
        # Set before any thread starts, because the server threads inherit the priority.
        sys.stderr.write(f"palpate: {take_real_time(options.priority)}\n")
    counts = str(path.resolve().with_suffix(".counts.json")) if path else ""
    ready = ready_pose(config)
    with interrupting(ended.set), EmulatedCell(config, ready, options, counts, options.event) as cell:
        rig = cell.rig_toml("" if job_path is None else job_path.name)
        _write(job_path, cell.job_toml())
        _write(path, rig)
        say(rig + "\n# running; press Ctrl-C to stop")

        def show(truth: GroundTruth) -> None:
            say(f"# inserted {cell.insertions}: depth {truth.depth_m * 1e3:.2f} mm, peak force so far"
                f" {truth.peak_force_N:.1f} N")  # fmt: skip

        def happened(event: PlannedEvent) -> None:
            say(f"# {event.name}: {EVENTS[event.name]}")

        cell.run(ended.is_set, show, happened)
    return 0


def _require_own(path: Path | None) -> None:
    """Raise an error if a file's first line has no valid digest, which indicates that a person wrote or edited it."""
    if path is None or not os.path.lexists(path):
        return
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    first, _, rest = text.partition("\n")
    if first != _MARK + _digest(rest):
        problem = "exists, and was changed since palpate emulate wrote it"
        raise OutputError(str(path), problem, "name another file with --rig-file, or remove it")


def _write(path: Path | None, text: str) -> None:
    if path is not None:
        write_whole(path, f"{_MARK}{_digest(text)}\n{text}")


def _digest(text: str) -> str:
    return sha256(text.encode("utf-8")).hexdigest()[:12]
