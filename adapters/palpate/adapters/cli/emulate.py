"""``palpate emulate``."""

from __future__ import annotations

import os
import signal
import sys
from dataclasses import replace
from pathlib import Path
from types import FrameType

from palpate.adapters.cli.options import EmulateOptions
from palpate.adapters.config import scenario
from palpate.adapters.hardware import EmulatedCell, EmulationConfig
from palpate.adapters.hardware.real_time import take_real_time
from palpate.core.errors import OutputError
from palpate.core.insertion import find_ready_pose
from palpate.core.ports import Truth


def emulate(options: EmulateOptions) -> int:
    """Serve until ended from outside; returns the exit code."""
    config = replace(scenario(options.scenario), seed=options.seed)
    emulation = EmulationConfig(
        options.arm, options.force, options.baud, options.divider, options.wrist_backlash_deg, options.usb_latency_ms
    )
    if options.rig_file and os.path.lexists(options.rig_file):
        raise OutputError(options.rig_file, "is there already", "name another file with --rig-file")
    ended = False

    def end(number: int, frame: FrameType | None) -> None:
        nonlocal ended
        ended = True

    if options.priority:
        # Before any thread is started: all that serve inherit it.
        sys.stderr.write(f"palpate: {take_real_time(options.priority)}\n")
    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        counts = str(Path(options.rig_file).resolve().with_suffix(".counts.json")) if options.rig_file else ""
        with EmulatedCell(config, find_ready_pose(config.arm, config.task), emulation, counts) as cell:
            rig = cell.rig_toml()
            if options.rig_file:
                _write_new(Path(options.rig_file), rig)
            _say(rig + "\n# serving; end with Ctrl-C\n")

            def show(truth: Truth) -> None:
                _say(f"# inserted {cell.insertions}: depth {truth.depth_m * 1e3:.2f} mm, peak force so far"
                     f" {truth.peak_force_N:.1f} N\n")  # fmt: skip

            cell.run(lambda: ended, show)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return 0


def _write_new(path: Path, text: str) -> None:
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except OSError as error:
        raise OutputError(str(path), f"cannot be written ({error.strerror})", "name another file") from error


def _say(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()
