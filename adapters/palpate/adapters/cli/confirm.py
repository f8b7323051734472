"""What a person at a rig reads and answers: what will move, each trial, and where the logs are."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from palpate.adapters.cli.options import RunOptions, TrainOptions
from palpate.adapters.config import RigFile
from palpate.adapters.experiments import RunFolder, TrialRow
from palpate.adapters.log import LOG_FOLDER
from palpate.core.errors import UsageError


def ask_before_motion(options: RunOptions | TrainOptions) -> None:
    """Say what will move on a rig and, unless it is emulated, ask a person once.

    Raises:
        UsageError: There is no terminal to ask at.
        ConfigurationError: ``--confirm`` names another rig.
        KeyboardInterrupt: The person does not confirm.
    """
    file, run = RigFile.load(Path(options.rig)), options.run
    place, policy, trials = run.place, options.policy or run.learner, options.trials
    sys.stderr.write(
        f"palpate: the arm of {file.name!r} will move: from where it is to 100 mm above"
        f" ({place.x_mm:g}, {place.y_mm:g}, {place.z_mm:g}) mm and down to {run.task.ready_height_mm:g} mm above it,"
        f" joints at up to {file.approach_rad_s:g} rad/s; then {trials} trials of {run.task.name}, {policy}\n"
    )
    if file.emulated:
        return
    if options.confirm:
        options.require("confirm", options.confirm == file.name, f"{file.name!r}, the name of this rig")
        return
    if not sys.stdin.isatty():
        raise UsageError(f"no terminal to ask at: --confirm {file.name!r} lets this rig move")
    sys.stderr.write("palpate: a hand at the emergency stop; Enter begins, anything else ends: ")
    sys.stderr.flush()
    if sys.stdin.readline() not in ("\n", "\r\n"):
        raise KeyboardInterrupt


def trial_line(row: TrialRow) -> str:
    """Return a line about a finished trial."""
    end = f"{row.outcome}{f', {row.trip}' if row.trip else ''}"
    return f"trial {row.trial + 1}: {end} after {row.exploration_time_s:.2f} s, peak force {row.peak_force_N:.1f} N"


@contextmanager
def logs_named(options: RunOptions | TrainOptions, folder: RunFolder) -> Iterator[None]:
    """Say where the logs of a rig's trials are if an error ends them."""
    try:
        yield
    except Exception:
        logs = folder.path / LOG_FOLDER
        if options.rig and logs.is_dir():
            sys.stderr.write(f"palpate: logs in {logs}\n")
        raise
