"""The run's end of a live view: what the recorder packs goes to the viewer's process too, as far as there is room."""

import dataclasses
import importlib.util
import json
from collections.abc import Sequence
from typing import Final, Self

from typing_extensions import override

from palpate.adapters.experiments import TrialRow
from palpate.adapters.log import FRAME, Opening, ProcessSink, Sink, messages_in
from palpate.adapters.visualisation.live.display import LearningSoFar
from palpate.adapters.visualisation.live.viewer_process import NOTE
from palpate.core.errors import ConfigurationError, UsageError

PORTS: Final = {"foxglove": 8765, "rerun": 9876}
"""Viewers, and the port at which each of them looks by itself."""
_HOW_TO: Final = {
    "foxglove": "open ws://127.0.0.1:{port} in Foxglove; docs/how-to/foxglove-live-layout.json is a layout for it",
    "rerun": "rerun --connect rerun+http://127.0.0.1:{port}/proxy",
}
_QUEUE_BYTES: Final = 1 << 18
_MOST_BYTES: Final = 1 << 22
"""Beginnings and ends of trials are queued beyond that, up to this."""
_PATIENCE_S: Final = 5.0


def require_viewer(viewer: str) -> None:
    """Make sure that a viewer's package is installed.

    Raises:
        UsageError: It is not.
    """
    if importlib.util.find_spec(viewer) is None:
        raise UsageError(f"this needs {viewer}-sdk, which is not installed: pip install 'palpate[{viewer}]'")


class LiveView(Sink):
    """A viewer's server in a process of its own, which outlives a recorder. A context manager.

    Nothing here waits while trials run: what the viewer's process does not take in time is dropped and counted. Whether
    that process lives makes no difference to the run.

    Args:
        process: The viewer's process; what is refused there is dropped.
    """

    def __init__(self, process: ProcessSink, how_to: str = "") -> None:
        self._sink, self.how_to = process, how_to
        self.dropped_messages = 0
        self._blind, self._told = False, ""

    @classmethod
    def serving(cls, viewer: str, port: int = 0) -> Self:
        """A view for whoever connects with a viewer.

        Args:
            port: Where viewers connect; 0 for the viewer's usual one.

        Raises:
            UsageError: The viewer is not installed.
            ConfigurationError: The port is taken.
        """
        require_viewer(viewer)
        port = port or PORTS[viewer]
        program = ("palpate.adapters.visualisation.live.viewer_process", viewer, str(port))
        process = ProcessSink(
            queue_bytes=_QUEUE_BYTES, patient=False, patience_s=_PATIENCE_S, program=program, called="live view"
        )
        process.await_writer()
        if problem := process.trouble():
            process.shut()
            accepted = f"a free port ({problem.partition(': ')[2]}); --live-port chooses another"
            raise ConfigurationError("live_port", port, accepted)
        return cls(process, _HOW_TO[viewer].format(port=port))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    @property
    @override
    def gone(self) -> bool:
        # For a recorder: a view that is gone is no reason to end anything.
        return False

    @override
    def open(self, opening: Opening) -> None:
        """The trial's first message says it all."""

    @override
    def put(self, frames: bytes, *, vital: bool = False) -> bool:
        """Hand frames over if there is room; never refuses anything."""
        if vital:
            # Ticks of a trial whose beginning was dropped could not be shown.
            self._blind = False
        if self._blind or not self._sent(frames, vital=vital):
            self._blind |= vital
            self.dropped_messages += len(messages_in(frames))
        return True

    @override
    def close(self, frames: bytes) -> None:
        if frames and (self._blind or not self._sent(frames, vital=True)):
            self.dropped_messages += len(messages_in(frames))

    def end(self) -> None:
        """Show what waits, as far as that takes no more than some seconds; the process is gone then."""
        self._told = self._told or self._sink.shut() or ""

    def note(self, time_ns: int, text: str, rows: Sequence[TrialRow], label: str = "") -> None:
        """Show a text, and what came of the trials of a run, which takes the place of what was shown of others.

        Args:
            time_ns: On whichever clock the view runs.
        """
        curve = LearningSoFar(label)
        for row in rows:
            curve.add(row.trial, row.exploration_time_s, row.success, row.peak_force_N)
        content = json.dumps({"text": text, "curve": dataclasses.asdict(curve)}).encode()
        self.dropped_messages += not self._sent(FRAME.pack(NOTE, 0, time_ns, len(content)) + content, vital=True)

    def account(self) -> str:
        """What became of it, for the end of a run."""
        gone = f"; its process {self._told.partition('live view ')[2]}" if self._told else ""
        return f"live view: {self.dropped_messages} messages dropped{gone}"

    def _sent(self, frames: bytes, *, vital: bool) -> bool:
        if self._sink.gone or (vital and self._sink.queued_bytes > _MOST_BYTES):
            return False
        return self._sink.put(frames, vital=vital)
