import json
import re
from pathlib import Path

from palpate.adapters.visualisation.live.display import BASE, SERIES
from palpate.adapters.visualisation.live.export import write_layout


def test_the_layout_shows_series_and_frames_that_there_are(tmp_path: Path) -> None:
    write_layout("foxglove", tmp_path / "layout.json")
    panels = json.loads((tmp_path / "layout.json").read_text())["configById"]
    assert panels["3D!cell"]["followTf"] == BASE
    shown = re.findall(r'"/(\w+)\.(\w+)"', json.dumps(panels))
    assert {("wrench", "fx_N"), ("tip", "z_mm"), ("timing", "late_ms")} <= set(shown)
    assert all(field in SERIES[topic] for topic, field in shown if topic in SERIES)
