"""Opens reports in a real browser, without a network, and says what is wrong with them.

`python3 check_report.py DIR` looks at every DIR/*/report.html as on a laptop and as on a telephone, leaves screenshots
in DIR/screenshots, and ends with 1 if a page asks for anything outside itself, says anything on the console, is wider
than its window, has a picture that does not load or is not described, or text with too little contrast.

Needs Debian's chromium, chromium-driver and python3-selenium, and nothing of palpate; `make browser-check` installs
them.
"""

import base64
import json
import sys
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

DEVICES = {"laptop": (1280, 800, 1.0), "phone": (390, 844, 2.0)}
TALLEST = 12_000
"""Pixels of a screenshot; what is below is not in it."""

FAULTS = """
const faults = [];
const root = document.documentElement;
if (root.scrollWidth > root.clientWidth) {
  const wide = [...document.querySelectorAll('body *')].filter(
    e => e.getBoundingClientRect().right > root.clientWidth + 1 && !e.closest('.scroll, pre, .skip'));
  faults.push(`is ${root.scrollWidth} px wide in a window of ${root.clientWidth} px: ` +
    wide.slice(0, 3).map(e => e.outerHTML.slice(0, 80)).join(' '));
}
for (const image of document.images) {
  if (!image.complete || image.naturalWidth === 0) faults.push('a picture does not load: ' + image.alt.slice(0, 60));
  if (image.alt.length < 20) faults.push('a picture is not described: ' + image.alt);
  const ratio = image.clientWidth / image.clientHeight / (image.naturalWidth / image.naturalHeight);
  if (Math.abs(ratio - 1) > 0.02) faults.push('a picture is distorted: ' + image.alt.slice(0, 60));
}
if (document.scripts.length) faults.push('has scripts');
if (document.querySelectorAll('h1').length !== 1) faults.push('has not one heading of the first order');
if (!root.lang || !document.title) faults.push('has no language or no title');
for (const link of document.querySelectorAll('a[href^="#"]'))
  if (!document.getElementById(link.hash.slice(1))) faults.push('leads nowhere: ' + link.textContent);
const luminance = colour => {
  const part = colour.match(/[\\d.]+/g).slice(0, 3).map(Number).map(v => v / 255)
    .map(v => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
};
const ground = element => {
  for (let e = element; e; e = e.parentElement) {
    const colour = getComputedStyle(e).backgroundColor;
    if (!/, 0\\)$/.test(colour)) return colour;
  }
  return 'rgb(255, 255, 255)';
};
let words = 0;
for (const element of document.querySelectorAll('body *')) {
  if (![...element.childNodes].some(n => n.nodeType === 3 && n.data.trim())) continue;
  words += 1;
  const style = getComputedStyle(element);
  const [a, b] = [luminance(style.color), luminance(ground(element))].sort((x, y) => y - x);
  if ((a + 0.05) / (b + 0.05) < 4.5) faults.push('too little contrast: ' + element.textContent.slice(0, 60));
  if (parseFloat(style.fontSize) < 12) faults.push('letters too small: ' + element.textContent.slice(0, 60));
}
if (words < 10) faults.push('says hardly anything');
return faults;
"""


def main() -> int:
    """Look at all reports below a folder; returns 1 if one has a fault."""
    desk = Path(sys.argv[1]).resolve()
    pages = sorted(desk.glob("*/report.html"))
    shots = desk / "screenshots"
    shots.mkdir(exist_ok=True)
    bad = 0
    for device, (width, height, density) in DEVICES.items():
        with browser(width, height, density) as driver:
            for number, page in enumerate(pages, 1):
                faults = look_at(driver, page, shots / f"{number}-{page.parent.name[:20]}-{device}.png", width, density)
                bad += bool(faults)
                sys.stdout.write(f"{'BAD ' if faults else 'good'} {device:<7}{page.parent.name[:60]}\n")
                sys.stdout.write("".join(f"     {fault}\n" for fault in faults))
    sys.stdout.write(f"{len(pages)} pages, screenshots in {shots}\n")
    return 1 if bad or not pages else 0


def browser(width: int, height: int, density: float, *, reaches: str = "MAP * ~NOTFOUND") -> webdriver.Chrome:
    """A browser with a window of that size, in which no name leads anywhere unless told otherwise."""
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for word in (
        "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-background-networking",
        f"--host-resolver-rules={reaches}", "--allow-file-access-from-files",
    ):  # fmt: skip
        options.add_argument(word)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    metrics = {"width": width, "height": height, "pixelRatio": density, "mobile": width < 600}
    options.add_experimental_option("mobileEmulation", {"deviceMetrics": metrics})
    return webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)


def look_at(driver: webdriver.Chrome, page: Path, shot: Path, width: int, density: float) -> list[str]:
    """Open a page, take a picture of the whole of it, and find its faults."""
    driver.get_log("browser"), driver.get_log("performance")
    driver.get(page.as_uri())
    faults: list[str] = driver.execute_script(FAULTS)
    faults += [f"console: {entry['message']}" for entry in driver.get_log("browser")]
    for entry in driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        url = message.get("params", {}).get("request", {}).get("url", "")
        if message["method"] == "Network.requestWillBeSent" and url != page.as_uri() and not url.startswith("data:"):
            faults.append(f"asks for {url[:100]}")
    if driver.execute_script("return window.innerWidth") != width:
        faults.append("the browser's window has another width than asked for: nothing was tried")
    # Folded parts must fit, too.
    driver.execute_script("document.querySelectorAll('details').forEach(e => e.open = true)")
    faults += [f"unfolded: {fault}" for fault in driver.execute_script(FAULTS) if "px wide" in fault]
    driver.execute_script("document.querySelectorAll('details').forEach(e => e.open = false)")
    tall = min(TALLEST, driver.execute_script("return document.documentElement.scrollHeight"))
    clip = {"x": 0, "y": 0, "width": width, "height": tall, "scale": 1.0 / density}
    taken = driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": clip})
    shot.write_bytes(base64.b64decode(taken["data"]))
    return faults


if __name__ == "__main__":
    sys.exit(main())
