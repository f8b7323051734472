"""``palpate emulate``."""

import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from threading import Event

from palpate.adapters.cli.notices import say, watched
from palpate.adapters.cli.options import EmulateOptions
from palpate.adapters.config import scenario
from palpate.adapters.experiments import interrupting, ready_pose
from palpate.adapters.hardware import EmulatedCell
from palpate.adapters.hardware.real_time import take_real_time
from palpate.core.ports import Truth, new_file, require_no_file


def emulate(options: EmulateOptions) -> int:
    """Serve until ended from outside; returns the exit code."""
    config = replace(scenario(options.scenario), seed=options.seed)
    if options.rig_file:
        require_no_file(Path(options.rig_file), "--rig-file")
    ended = Event()
    kept = ExitStack()
    # Before the priority is taken, which is for the devices alone.
    live = kept.enter_context(watched(options))
    if options.priority:
        # Before any thread is started: all that serve inherit it.
        sys.stderr.write(f"palpate: {take_real_time(options.priority)}\n")
    counts = str(Path(options.rig_file).resolve().with_suffix(".counts.json")) if options.rig_file else ""
    ready = ready_pose(config)
    with kept, interrupting(ended.set), EmulatedCell(config, ready, options, counts) as cell:
        rig = cell.rig_toml()
        if options.rig_file:
            with new_file(Path(options.rig_file), "--rig-file") as passing:
                passing.write_text(rig, encoding="utf-8")
        say(rig + "\n# serving; end with Ctrl-C")

        view = None
        if live is not None:
            from palpate.adapters.visualisation.live import EmulationView

            view = EmulationView(live, config, ready, cell.cell.truth())

        def show(truth: Truth) -> None:
            if view is not None:
                view.inserted(cell.insertions, truth)
            say(f"# inserted {cell.insertions}: depth {truth.depth_m * 1e3:.2f} mm, peak force so far"
                f" {truth.peak_force_N:.1f} N")  # fmt: skip

        cell.run(ended.is_set, show, None if view is None else view.moment)
    return 0
