"""The run's end of a live view: it never waits, and counts what it drops."""

import os
import signal
import time
from pathlib import Path

import pytest

from palpate.adapters.log import Opening, ProcessSink, message_frame
from palpate.adapters.visualisation.live.live_view import LiveView, require_viewer
from palpate.core.errors import UsageError

TICK = message_frame(2, 5, b"x" * 1000)


def test_a_viewer_that_hangs_costs_messages_and_no_time() -> None:
    process = ProcessSink(queue_bytes=2000, patient=False, patience_s=0.1)
    process.await_writer()
    os.kill(process.process_id, signal.SIGSTOP)
    view = LiveView(process)
    began = time.monotonic()
    for _ in range(4):
        view.open(Opening(Path("none"), {}))
        assert view.put(message_frame(1, 0, b"s" * 2_000_000), vital=True)
        for _ in range(100):
            assert view.put(TICK * 14)
        view.close(message_frame(8, 9, b"e"))
    # To wait at each message for as long as the end is waited for would take 40 s.
    assert time.monotonic() - began < 20.0
    # Two beginnings fit and their ends; then a beginning that does not takes its ticks with it.
    assert view.dropped_messages >= 4 * 100 * 14
    assert process.queued_bytes < 8_000_000
    assert (view.gone, view.trouble()) == (False, None)
    view.end()
    assert "live view: 56" in view.account()


def test_a_viewer_that_is_not_installed_is_refused_with_the_remedy() -> None:
    with pytest.raises(UsageError, match=r"^this needs nowhere-sdk, .* pip install 'palpate\[nowhere\]'$"):
        require_viewer("nowhere")
