"""Notices printed by commands that run trials, and prompts for a rig's operator."""

import importlib.util
import shlex
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from palpate.adapters.cli.options import LiveSettings, RunOptions, TrainOptions
from palpate.adapters.config import RigFile, RunConfig
from palpate.adapters.experiments import MakeRig, Run, RunFolder, TrialRow, TrialsObserver, note, open_rig
from palpate.adapters.log import LOG_FOLDER, counted
from palpate.core.errors import UsageError
from palpate.core.ports import Rig
from palpate.core.trial import ReadyPose
from palpate.simulation.work_cell import validity_lines


@contextmanager
def watched(options: LiveSettings) -> Iterator[TrialsObserver | None]:
    """Yield the requested live view, or None if none was requested."""
    if not options.live:
        yield None
        return
    if importlib.util.find_spec("rerun") is None:
        raise UsageError("--live needs rerun-sdk, which is not installed: pip install 'palpate[rerun]'")
    from palpate.adapters.visualisation.live import LiveView

    with LiveView.serving(options.live_port) as view:
        sys.stderr.write(f"palpate: live view: rerun --connect {view.address}\n")
        yield view


def command(*words: object) -> str:
    """Return a palpate command line, quoted for a shell."""
    return shlex.join(["palpate", *map(str, words)])


def say(text: str) -> None:
    """Print a line and flush it, for programs that read from a pipe."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def run_of(
    options: RunOptions | TrainOptions, live: TrialsObserver | None = None, make_rig: MakeRig | None = None
) -> Run:
    """Return the run requested by a command."""

    def requested(config: RunConfig, ready: ReadyPose) -> Rig:
        """Check the settings, ask for confirmation, and return the rig, still unopened."""
        accepted = options.accept_kinematics
        rig = open_rig(config, ready, options.rig, options.acknowledge, accept_kinematics=accepted)
        if options.rig:
            ask_before_motion(options)
        return rig

    return Run(options.run, rig=options.rig, live=live, notify=note, make_rig=make_rig or requested)


def ask_before_motion(options: RunOptions | TrainOptions) -> None:
    """Print how a rig's arm will move and, unless it is emulated, ask the operator to confirm.

    Raises:
        UsageError: There is no terminal.
        ConfigurationError: ``--confirm`` names a different rig.
        KeyboardInterrupt: The operator does not confirm.
    """
    file, run = RigFile.load(Path(options.rig)), options.run
    policy, trials = options.policy or run.learner, options.trials
    places = ", then ".join(f"({x:g}, {y:g}, {z:g})" for x, y, z in run.place.centres_mm)
    sys.stderr.write(
        f"palpate: the arm of {file.name!r} will move: from its current pose to 100 mm above"
        f" {places} mm and down to {run.task.ready_height_mm:g} mm above it,"
        f" joints at up to {file.approach_rad_s:g} rad/s; then {counted(trials, 'trial')}: {run.task.name}, {policy}\n"
    )
    if file.emulated:
        return
    if options.confirm:
        options.require("confirm", options.confirm == file.name, f"{file.name!r}, the name of this rig")
        return
    if not sys.stdin.isatty():
        raise UsageError(f"no terminal for a confirmation: --confirm {file.name!r} lets this rig move")
    sys.stderr.write("palpate: keep a hand at the emergency stop; Enter starts, anything else ends: ")
    sys.stderr.flush()
    if sys.stdin.readline() not in ("\n", "\r\n"):
        raise KeyboardInterrupt


def trial_line(row: TrialRow) -> str:
    """Return a line that describes a finished trial, numbered as its log."""
    end = f"{row.outcome} after {row.exploration_time_s:.2f} s{f' ({row.trip})' if row.trip else ''}"
    return f"trial {row.trial}: {end}, peak force {row.peak_force_N:.1f} N"


@contextmanager
def logs_named(options: RunOptions | TrainOptions, folder: RunFolder) -> Iterator[None]:
    """If an error ends the trials on a rig, print the location of their logs."""
    try:
        yield
    except Exception:
        logs = folder.path / LOG_FOLDER
        if options.rig and logs.is_dir():
            sys.stderr.write(f"palpate: logs in {logs}\n")
        raise


def validity_note(config: RunConfig, rig: str = "") -> str:
    """Return the note to print below a success rate, or an empty string for a rig or a valid simulator."""
    return "" if rig else "".join(f"{line}\n" for line in validity_lines(config.cell))


def flagged_line(summary: Mapping[str, Any], *, learned: bool | None = None) -> str:
    """Return the number of trials flagged for timing, their use in learning, and the reasons, or "" if none."""
    if not summary["flagged"]:
        return ""
    why = ", ".join(f"{reason} {count}" for reason, count in summary["flagged_reasons"].items())
    fate = "" if learned is None else ", learned from anyway" if learned else ", not learned from"
    return f"flagged for their timing: {summary['flagged']} of {summary['trials']} trials{fate} ({why})\n"


def trips_line(summary: Mapping[str, Any]) -> str:
    """Return the number of trials that ended in a trip, and the reasons, or an empty string if there are none."""
    if not summary["trips"]:
        return ""
    reasons = ", ".join(f"{reason} {count}" for reason, count in summary["trips"].items())
    count = sum(summary["trips"].values())
    return f"trips: {count} of {summary['trials']} trials, counted as failures at the time limit ({reasons})\n"
