"""Opens a recorded trial in Foxglove Studio, and holds what it shows against the log.

`python3 check_foxglove.py DIR` expects in DIR what `python -m tests.browser.foxglove_desk LOG DIR` leaves, and the npm
packages of that desk. It serves them on this machine alone, opens the log in a headless browser with the layout of
docs/how-to, waits until Foxglove has read it, leaves foxglove.png, and ends with 1 if a topic is missing or a number of
the tick that is shown is another than in the log.

Foxglove's packages of this age are under the MPL-2.0; nothing of them is part of palpate. Needs Debian's chromium,
chromium-driver and python3-selenium; `make foxglove-check` installs all of it.
"""

import functools
import http.server
import json
import re
import sys
import threading
import time
from pathlib import Path

from check_report import browser
from selenium import webdriver

WIDTH, HEIGHT = 1700, 1100
MOST_S = 180.0
NUMBER = r"\s+(-?[0-9.e+-]+)"


class Desk(http.server.SimpleHTTPRequestHandler):
    """Serves files, and parts of them, as Foxglove asks for."""

    def end_headers(self) -> None:
        self.send_header("Accept-Ranges", "bytes")
        super().end_headers()

    def log_message(self, *words: object) -> None:
        """Nothing is logged."""

    def do_GET(self) -> None:
        path = Path(self.translate_path(self.path))
        part = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        if part is None or not path.is_file():
            super().do_GET()
            return
        content = path.read_bytes()
        first = int(part[1])
        piece = content[first : int(part[2]) + 1 if part[2] else None]
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{first + len(piece) - 1}/{len(content)}")
        self.send_header("Content-Length", str(len(piece)))
        self.end_headers()
        self.wfile.write(piece)


def faults_in(text: str, expected: dict[str, object]) -> list[str]:
    """What the page says that is not in the log."""
    faults = [f"topic {topic} is not listed" for topic in expected["topics"] if f"{topic}\n" not in text]
    shown = re.search(r"\btick\s+(\d+)", text)
    if shown is None:
        return [*faults, "no tick is shown"]
    tick = expected["ticks"][int(shown[1])]
    for name in ("force_N", "torque_Nm"):
        row = re.search(rf"{name}\s+\[\]\s+3\s+items\s+0{NUMBER}\s+1{NUMBER}\s+2{NUMBER}", text)
        if row is None or [float(number) for number in row.groups()] != tick[name]:
            faults.append(f"{name} of tick {shown[1]} is {row and row.groups()}, in the log {tick[name]}")
    for name in ("time_ns", "sequence"):
        row = re.search(rf"\b{name}\s+(\d+)", text)
        if row is None or int(row[1]) != tick[name]:
            faults.append(f"{name} of tick {shown[1]} is {row and row[1]}, in the log {tick[name]}")
    return faults


def text_of(driver: webdriver.Chrome) -> str:
    return str(driver.execute_script("return document.body.innerText"))


def main() -> int:
    """Open the log; returns 1 if what is shown is not what was recorded."""
    desk = Path(sys.argv[1]).resolve()
    expected = json.loads((desk / "expected.json").read_text())
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Desk, directory=str(desk)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with browser(WIDTH, HEIGHT, 1.0, reaches="MAP * ~NOTFOUND, EXCLUDE 127.0.0.1") as driver:
        driver.set_page_load_timeout(MOST_S)
        driver.get(f"http://127.0.0.1:{server.server_port}/index.html")
        end_s = time.monotonic() + MOST_S
        while (faults := faults_in(text_of(driver), expected)) and time.monotonic() < end_s:
            time.sleep(1.0)
        # The curves come after the numbers.
        time.sleep(10.0)
        driver.save_screenshot(str(desk / "foxglove.png"))
    sys.stdout.write("".join(f"BAD  {fault}\n" for fault in faults))
    sys.stdout.write(
        f"{'BAD ' if faults else 'good'} Foxglove, {len(expected['topics'])} topics; {desk}/foxglove.png\n"
    )
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
