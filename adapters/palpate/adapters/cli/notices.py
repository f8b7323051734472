"""What the commands that run trials print besides their results."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from palpate.adapters.cli.options import LiveSettings, RunOptions, TrainOptions
from palpate.adapters.config import RunConfig
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.core.errors import UsageError
from palpate.core.supervision import limits_line
from palpate.simulation.work_cell import validity_lines

if TYPE_CHECKING:
    from palpate.adapters.experiments import MakeRig, Run, TrialsObserver
    from palpate.core.ports import Rig
    from palpate.core.trial import ReadyPose


@contextmanager
def watched(options: LiveSettings) -> Iterator[TrialsObserver | None]:
    """Give the live view that was asked for; None where none was."""
    if not options.live:
        yield None
        return
    if importlib.util.find_spec("rerun") is None:
        raise UsageError("--live needs rerun-sdk, which is not installed: pip install 'palpate[rerun]'")
    from palpate.adapters.visualisation.live import LiveView

    with LiveView.serving(options.live_port) as view:
        sys.stderr.write(f"palpate: live view: rerun --connect {view.address}\n")
        yield view


def say(text: str) -> None:
    """Print a line that a reader at the end of a pipe has at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def run_of(
    options: RunOptions | TrainOptions, live: TrialsObserver | None = None, make_rig: MakeRig | None = None
) -> Run:
    """Return the run that a command asks for."""
    from palpate.adapters.cli.confirm import ask_before_motion
    from palpate.adapters.experiments import Run, note, open_rig

    def asked(config: RunConfig, ready: ReadyPose) -> Rig:
        """The rig, not entered: its settings are known to be good, and nothing has got power yet."""
        accepted = options.accept_kinematics
        rig = open_rig(config, ready, options.rig, options.acknowledge, accept_kinematics=accepted)
        if options.rig:
            ask_before_motion(options)
        return rig

    return Run(options.run, rig=options.rig, live=live, notify=note, make_rig=make_rig or asked)


def print_grants(session: RealTimeSession, config: RunConfig) -> None:
    """Print what the system was asked for and what it answered, and which force will stop the arm."""
    for line in (*session.grants, limits_line(config.supervision, config.task)):
        sys.stderr.write(f"palpate: {line}\n")


def validity_note(config: RunConfig, rig: str = "") -> str:
    """Return the lines below a success rate: none on a rig, or where the simulator is valid."""
    return "" if rig else "".join(f"{line}\n" for line in validity_lines(config.cell))


def marked_line(summary: Mapping[str, Any], *, learned: bool | None = None) -> str:
    """How many trials were marked for their timing, and why; empty for none.

    Args:
        learned: Whether such trials are learned from; None where nothing is.
    """
    if not summary["marked"]:
        return ""
    why = ", ".join(f"{reason} {count}" for reason, count in summary["marked_why"].items())
    fate = "" if learned is None else ", learned from all the same" if learned else ", not learned from"
    return f"marked for their timing: {summary['marked']} of {summary['trials']} trials{fate} ({why})\n"


def trips_line(summary: Mapping[str, Any]) -> str:
    """How many trials a trip ended, and for which reasons; empty for none."""
    if not summary["trips"]:
        return ""
    reasons = ", ".join(f"{reason} {count}" for reason, count in summary["trips"].items())
    count = sum(summary["trips"].values())
    return f"trips: {count} of {summary['trials']} trials, counted as failures at the time limit ({reasons})\n"
