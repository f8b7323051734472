"""Rerun's real server: it serves this computer only, and ends with the view."""

import signal
import socket
import time
from pathlib import Path

import pytest
import rerun as rr

from palpate.adapters.visualisation.live import LiveView

STARTED_S = 60.0


def listened_on(port):
    """Return the addresses on which a process listens at this port, as the kernel writes them."""
    lines = [line.split() for kind in ("tcp", "tcp6") for line in Path(f"/proc/net/{kind}").read_text().splitlines()]
    return {line[1].partition(":")[0] for line in lines if line[1].endswith(f":{port:04X}") and line[3] == "0A"}


@pytest.mark.parametrize("ended_by", [None, signal.SIGKILL, signal.SIGSTOP])
def test_rerun_serves_only_this_computer_and_ends_with_the_view(ended_by):
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = int(found.getsockname()[1])
    end_s = time.monotonic() + STARTED_S
    with LiveView.serving(port) as view:
        while not listened_on(port) and time.monotonic() < end_s:
            time.sleep(0.02)
        assert listened_on(port) == {"0100007F"}
        if ended_by is not None:
            view._server.send_signal(ended_by)
            view._stream.log("decision", rr.TextDocument("after that"))
    while listened_on(port) and time.monotonic() < end_s:
        time.sleep(0.02)
    assert not listened_on(port)
