"""The fake devices of the example of a whole rig."""

import socket
from pathlib import Path

from palpate.adapters.contracts import FakeClock


def test_a_client_that_leaves_within_a_tick_does_not_keep_the_next_one_waiting(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples" / "third_party_rig"))
    from third_party_rig.fake import FakeDevice

    device = FakeDevice("bench", FakeClock(), lambda: (0.0,))
    try:
        for _ in range(20):
            with socket.create_connection(device.address, 5.0) as client:
                assert client.recv(100) == b"HELLO bench 1\n"
            # This thread and the one that serves race for the end of the connection.
            device.tick()
    finally:
        device.close()
