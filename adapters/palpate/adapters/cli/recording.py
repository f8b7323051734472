"""What the commands that record say about it."""

from __future__ import annotations

import sys

from palpate.adapters.recording.trials import TrialRecorder

_MOST = 5


def report_troubles(recorder: TrialRecorder | None) -> None:
    """Tell what could not be recorded; nothing when all was."""
    if recorder is None or not recorder.troubles:
        return
    for trouble in recorder.troubles[:_MOST]:
        sys.stderr.write(f"palpate: recording: {trouble}\n")
    more = len(recorder.troubles) - _MOST
    if more > 0:
        sys.stderr.write(f"palpate: recording: and {more} more like these\n")
