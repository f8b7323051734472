"""What the commands that run trials print about recording, about weakened limits and about a cell of less accuracy."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from palpate.adapters.cli.options import LiveSettings
from palpate.adapters.config import RunConfig
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.log import TrialRecorder
from palpate.core.supervision import limits_line, weakened_lines
from palpate.simulation.work_cell import accuracy_lines, inertia_lines, validity_lines

if TYPE_CHECKING:
    from palpate.adapters.visualisation.live import LiveView

_MOST = 5


@contextmanager
def watched(options: LiveSettings) -> Iterator[LiveView | None]:
    """The live view that was asked for, and at the end what became of it; None where none was."""
    if not options.live:
        yield None
        return
    from palpate.adapters.visualisation.live import LiveView

    with LiveView.serving(options.live, options.live_port) as view:
        sys.stderr.write(f"palpate: live view: {view.how_to}\n")
        try:
            yield view
        finally:
            view.end()
            sys.stderr.write(f"palpate: {view.account()}\n")


def say(text: str) -> None:
    """Print a line that a reader at the end of a pipe has at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def print_grants(session: RealTimeSession | None, config: RunConfig) -> None:
    """Print, on a rig, what the system was asked for and what it answered, and which force will stop the arm."""
    if session is not None:
        for line in (*session.grants, limits_line(config.supervision, config.task)):
            sys.stderr.write(f"palpate: {line}\n")


def print_weakened(config: RunConfig) -> None:
    """Print which limits of the supervisor, or which accuracy of the cell, are weaker than by default."""
    print_lines((*weakened_lines(config.supervision), *accuracy_lines(config.cell)))


def print_part(config: RunConfig, rig: str = "") -> None:
    """Print, once nothing can refuse the run any more, its part and in the simulator what the arm's model lacks."""
    print_lines((config.part.describe(), *(() if rig else inertia_lines(config.arm))))


def print_lines(lines: Sequence[str]) -> None:
    """Print what a person should know before a run."""
    for line in lines:
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


def unrecorded(recorder: TrialRecorder | None) -> bool:
    """Whether anything could not be recorded: then a run has not gone well."""
    return recorder is not None and bool(recorder.troubles)


def print_troubles(troubles: Sequence[str]) -> None:
    """Print what could not be recorded; nothing when all was."""
    for trouble in troubles[:_MOST]:
        sys.stderr.write(f"palpate: recording: {trouble}\n")
    more = len(troubles) - _MOST
    if more > 0:
        sys.stderr.write(f"palpate: recording: and {more} more like these\n")
