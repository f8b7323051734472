"""Recorded trials as files that Foxglove and Rerun open as pictures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from palpate.adapters.files import new_folder
from palpate.adapters.log import TICK, names_for, read_log, sound_messages
from palpate.adapters.visualisation.live.display import Display
from palpate.adapters.visualisation.live.live_view import require_viewer
from palpate.adapters.visualisation.live.trial_stream import TrialStream

ENDINGS: Final = {"foxglove": ".foxglove.mcap", "rerun": ".rrd"}
"""Viewers, and how the files that they open end."""
_AT_ONCE: Final = 140
"""Ticks whose numbers are written together."""


def export_pictures(paths: Sequence[Path], out: Path, viewer: str) -> list[Path]:
    """Write a file for each log into a folder; returns the files.

    Raises:
        UsageError: The viewer's package is not installed.
        OutputError: The folder cannot be written, or holds something.
        LogError: A log cannot be used.
    """
    require_viewer(viewer)
    names = [f"{name}{ENDINGS[viewer]}" for name in names_for(paths)]
    with new_folder(out) as passing:
        for path, name in zip(paths, names, strict=True):
            # Refused whole before anything is written of it.
            read_log(path)
            _export(path, _display(viewer, passing / name))
    return [out / name for name in names]


def _display(viewer: str, path: Path) -> Display:
    if viewer == "foxglove":
        from palpate.adapters.visualisation.live.foxglove_display import FoxgloveDisplay

        return FoxgloveDisplay.file(path)
    from palpate.adapters.visualisation.live.rerun_display import RerunDisplay

    return RerunDisplay.file(path, path.stem)


def _export(path: Path, display: Display) -> None:
    stream, ticks = TrialStream(display), 0
    try:
        for message in sound_messages(str(path), path.read_bytes()):
            stream.take(message)
            ticks += message.channel == TICK.id
            if ticks % _AT_ONCE == 0:
                stream.flush()
        stream.flush()
    finally:
        display.close()
