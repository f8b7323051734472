"""A live view over its real server: viewers come, go and come again, and the process may be killed."""

import json
import os
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from websockets.sync.client import connect

from palpate.adapters.log import END, START, message_frame, sound_messages
from palpate.adapters.visualisation.live import LiveView
from palpate.core.errors import ConfigurationError
from tests.golden.record import HERE as GOLDEN

TOPICS = {
    *("/tf", "/scene", "/force", "/log", "/wrench", "/tip", "/timing", "/command", "/decision", "/action_values"),
    *("/supervisor", "/learning_curve"),
}
STARTED_S = 60.0


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.fixture(scope="module")
def served() -> Iterator[tuple[LiveView, int]]:
    port = free_port()
    with LiveView.serving("foxglove", port) as view:
        yield view, port


def topics_seen(port: int) -> set[str]:
    """Connect as Foxglove does, subscribe to all, and wait until something came of each topic."""
    names: dict[int, str] = {}
    seen: set[str] = set()
    end_s = time.monotonic() + STARTED_S
    with connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"], max_size=None) as server:  # type: ignore[list-item]
        while seen != TOPICS and time.monotonic() < end_s:
            message = server.recv(timeout=STARTED_S)
            if isinstance(message, bytes):
                if message[0] == 1:
                    seen.add(names[int.from_bytes(message[1:5], "little")])
                continue
            told = json.loads(message)
            if told["op"] == "advertise":
                names |= {each["id"]: each["topic"] for each in told["channels"]}
                asked = [{"id": each["id"], "channelId": each["id"]} for each in told["channels"]]
                server.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
    return seen


def show(view: LiveView, name: str) -> None:
    path = GOLDEN / f"{name}.mcap"
    for message in sound_messages(str(path), path.read_bytes()):
        framed = message_frame(message.channel, message.time_ns, message.payload)
        if message.channel == END.id:
            view.close(framed)
        else:
            view.put(framed, vital=message.channel == START.id)


def test_a_viewer_that_comes_again_is_shown_all_though_nothing_happens(served: tuple[LiveView, int]) -> None:
    view, port = served
    show(view, "train-paper")
    assert view.dropped_messages == 0
    assert topics_seen(port) == TOPICS
    assert topics_seen(port) == TOPICS


def test_a_port_that_is_taken_is_refused_in_one_line(served: tuple[LiveView, int]) -> None:
    with pytest.raises(ConfigurationError, match=r"^live_port = \d+ .*Address already in use.*--live-port") as refused:
        LiveView.serving("rerun", served[1])
    assert "\n" not in str(refused.value)


def listened_on(port: int) -> set[str]:
    """The addresses on which anybody listens at this port, as the kernel writes them."""
    lines = [line.split() for kind in ("tcp", "tcp6") for line in Path(f"/proc/net/{kind}").read_text().splitlines()]
    return {line[1].partition(":")[0] for line in lines if line[1].endswith(f":{port:04X}") and line[3] == "0A"}


@pytest.mark.parametrize("killed", [False, True])
def test_rerun_serves_this_computer_alone_and_not_for_longer_than_the_view(killed: bool) -> None:
    port = free_port()
    with LiveView.serving("rerun", port) as view:
        end_s = time.monotonic() + STARTED_S
        while not listened_on(port) and time.monotonic() < end_s:
            time.sleep(0.02)
        assert listened_on(port) == {"0100007F"}
        if killed:
            os.kill(view._sink.process_id, signal.SIGKILL)
    while listened_on(port) and time.monotonic() < end_s:
        time.sleep(0.02)
    assert not listened_on(port)


def test_a_process_that_is_killed_ends_nothing(served: tuple[LiveView, int]) -> None:
    view, _ = served
    os.kill(view._sink.process_id, signal.SIGKILL)
    for _ in range(200):
        show(view, "train-sarsa")
        if view.dropped_messages:
            break
        time.sleep(0.05)
    view.end()
    assert view.dropped_messages
    assert "its process is gone" in view.account()
