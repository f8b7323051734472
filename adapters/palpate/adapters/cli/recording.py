"""What the commands that record say about it."""

from __future__ import annotations

import sys
from dataclasses import replace

from palpate.adapters.config import RecordingConfig, RunConfig
from palpate.adapters.recording.trials import TrialRecorder

_MOST = 5


def recording_for(config: RunConfig, rig_file: str) -> RecordingConfig:
    """The recorder's settings for a rig: real time waits for nobody, whatever is configured."""
    return replace(config.recording, when_full="drop") if rig_file else config.recording


def report_troubles(recorder: TrialRecorder | None) -> None:
    """Tell what could not be recorded; nothing when all was."""
    if recorder is None or not recorder.troubles:
        return
    for trouble in recorder.troubles[:_MOST]:
        sys.stderr.write(f"palpate: recording: {trouble}\n")
    more = len(recorder.troubles) - _MOST
    if more > 0:
        sys.stderr.write(f"palpate: recording: and {more} more like these\n")
