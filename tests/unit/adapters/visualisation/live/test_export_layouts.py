import json
import re
from pathlib import Path

from palpate.adapters.visualisation.live.display import BASE, SERIES


def test_the_layout_shows_series_and_frames_that_there_are() -> None:
    layout = Path(__file__).parents[5] / "docs" / "how-to" / "foxglove-live-layout.json"
    panels = json.loads(layout.read_text(encoding="utf-8"))["configById"]
    assert panels["3D!cell"]["followTf"] == BASE
    shown = re.findall(r'"/(\w+)\.(\w+)"', json.dumps(panels))
    assert {("wrench", "fx_N"), ("tip", "z_mm"), ("timing", "late_ms")} <= set(shown)
    assert all(field in SERIES[topic] for topic, field in shown if topic in SERIES)
