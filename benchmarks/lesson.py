"""A lesson on an emulated rig over its wires: a hand on a gamepad, which sees the tip in the live view.

    palpate emulate --arm zebra-nmc --force jr3-can --priority 30 --rig-file rig.toml &
    python -m benchmarks.lesson rig.toml --trials 6 --out lesson --seed 8

Further words are those of palpate teach. The gamepad is a named pipe with the records of Linux's joystick interface;
the hand presses the button anew for each trial and holds the stick towards the hole, whose place it knows.
"""

from __future__ import annotations

import json
import os
import pty
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from math import hypot
from pathlib import Path

from websockets.sync.client import connect

BUTTON, AXIS, HOLD, PORT = 1, 2, 4, 8790
REST_MM = 0.25


def watch(tell: Callable[[float, float], None]) -> None:
    """Tell where the tip is, mm from the hole, for as long as the view is served."""
    names: dict[int, str] = {}
    with connect(f"ws://127.0.0.1:{PORT}", subprotocols=["foxglove.sdk.v1"], max_size=None) as server:
        for message in server:
            if isinstance(message, bytes):
                if message[0] == 1 and names[int.from_bytes(message[1:5], "little")] == "/tip":
                    tip = json.loads(message[13:])
                    tell(tip["x_mm"], tip["y_mm"])
            elif (told := json.loads(message))["op"] == "advertise":
                names |= {each["id"]: each["topic"] for each in told["channels"]}
                asked = [{"id": each["id"], "channelId": each["id"]} for each in told["channels"]]
                server.send(json.dumps({"op": "subscribe", "subscriptions": asked}))


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "js0"
        os.mkfifo(path)
        pad = os.open(path, os.O_RDWR)

        def send(kind: int, number: int, value: int) -> None:
            os.write(pad, struct.pack("=IhBB", 0, value, kind, number))

        def lead(x_mm: float, y_mm: float) -> None:
            way = max(hypot(x_mm, y_mm), REST_MM)
            full = 32767 if way > REST_MM else 0
            send(AXIS, 0, round(-full * y_mm / way))
            send(AXIS, 1, round(full * x_mm / way))

        def see() -> None:
            while process.poll() is None:
                try:
                    watch(lead)
                except OSError:
                    time.sleep(0.3)

        # Any key of the terminal would stop the arm: this one has none pressed.
        _, terminal = pty.openpty()
        words = [
            "teach",
            "--rig",
            *sys.argv[1:],
            "--gamepad",
            str(path),
            "--live",
            "foxglove",
            "--live-port",
            str(PORT),
        ]
        call = [sys.executable, "-m", "palpate", *words]
        process = subprocess.Popen(call, stdin=terminal, stderr=subprocess.PIPE, text=True)
        threading.Thread(target=see, daemon=True).start()
        for line in process.stderr or ():
            sys.stderr.write(line)
            if "press button" in line or line.startswith("trial "):
                send(BUTTON, HOLD, 0)
                # Not before the lesson waits for it: a button that is held all the while must be let go first.
                time.sleep(3.0)
                send(BUTTON, HOLD, 1)
        return process.wait()


if __name__ == "__main__":
    sys.exit(main())
